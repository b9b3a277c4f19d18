"""The network as scikit-learn estimators; needs ``pip install "sdnn[sklearn]"``.

Names are loaded when they are first used, so that ``import sdnn`` needs no scikit-learn.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdnn.estimators.base import OutOfRangeWarning
    from sdnn.estimators.classifier import SDNNClassifier
    from sdnn.estimators.kernel_ridge import SDNNKernelRidge
    from sdnn.estimators.libsdnn import read_model_file, read_parameter_file
    from sdnn.estimators.regressor import SDNNRegressor

_HOME_OF = {
    "OutOfRangeWarning": "base",
    "SDNNClassifier": "classifier",
    "SDNNKernelRidge": "kernel_ridge",
    "SDNNRegressor": "regressor",
    "read_model_file": "libsdnn",
    "read_parameter_file": "libsdnn",
}

__all__ = [
    "OutOfRangeWarning",
    "SDNNClassifier",
    "SDNNKernelRidge",
    "SDNNRegressor",
    "read_model_file",
    "read_parameter_file",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] == "sdnn":
            raise
        raise ModuleNotFoundError(
            f'{name} needs {error.name}: pip install "sdnn[sklearn]"', name=error.name
        ) from error


def __dir__() -> list[str]:
    return __all__
