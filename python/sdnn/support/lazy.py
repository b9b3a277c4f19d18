"""Names of a package that are loaded when they are first used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def attach(
    package: str, names: Mapping[str, str], others: str = ""
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Make ``__getattr__``, ``__dir__`` and ``__all__`` of a package that imports names on demand.

    ``names`` maps each module to the names that it provides, with spaces between them; the names of
    the package itself are its submodules. Type checkers read a stub beside the package instead; it
    cannot replace ``names``, as a frozen program lacks it. If an unknown name is in one of the
    packages ``others``, also with spaces between them, the error says so.

    >>> load, names, public = attach("sdnn", {"sdnn": "coding", "sdnn.estimators": "SDNNRegressor"})
    >>> load("coding").__name__, names(), public
    ('sdnn.coding', ['SDNNRegressor', 'coding'], ['SDNNRegressor', 'coding'])
    """
    modules = {name: module for module, listed in names.items() for name in listed.split()}

    def load(name: str) -> Any:
        """Import a module or a name from its module: the package's ``__getattr__``."""
        if name not in modules:
            from sdnn.support.habits import error_of_name

            raise error_of_name(package, name, modules, others)
        if modules[name] == package:
            return import_module(f"{package}.{name}")
        return getattr(import_module(modules[name]), name)

    return load, lambda: sorted(modules), sorted(modules)
