"""Makes the environments known to Gymnasium, as soon as something imports that.

Gymnasium and NumPy take several times longer to import than all that ``import sdnn`` needs, so it
does not wait for them; a command's ``--help`` and its errors come at once.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

__all__ = ["register_when_gymnasium_is_imported"]

ENVIRONMENT_ID = "sdnn/AcrobotSwingUp-v0"


def register_when_gymnasium_is_imported() -> None:
    """Register at once if Gymnasium is there already, else right after its import."""
    if "gymnasium" in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _GymnasiumFinder())


def _register() -> None:
    import gymnasium as gym

    if ENVIRONMENT_ID not in gym.registry:
        gym.register(
            id=ENVIRONMENT_ID,
            entry_point="sdnn.environments.acrobot:AcrobotSwingUpEnv",
            vector_entry_point="sdnn.environments.vector_env:AcrobotSwingUpVectorEnv",
            reward_threshold=10.0,
        )


class _GymnasiumFinder:
    """Finds Gymnasium where the other finders do; it registers once that has been executed."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        others = (finder for finder in sys.meta_path if finder is not self)
        found = (finder.find_spec(name, path, target) for finder in others)
        spec = next((spec for spec in found if spec is not None), None)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)  # if it fails, the next import comes here again
                if self in sys.meta_path:
                    sys.meta_path.remove(self)
                _register()

            # The loader stays the one that it is: importlib.resources and others ask for its class.
            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
