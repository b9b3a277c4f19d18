"""Names of a package that are loaded when they are first used."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from typing import Any


def attach(
    namespace: dict[str, Any],
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Make ``__getattr__``, ``__dir__`` and ``__all__`` of a package from its imports.

    What a package imports under ``if TYPE_CHECKING:`` is thus written once, for type checkers,
    for readers and for loading: ``from sdnn.module import Name as Name``, which type checkers take
    for a public name. ``namespace`` is the package's ``globals()``.

    Examples
    --------
    >>> import sdnn
    >>> load, names, public = attach(vars(sdnn))
    >>> load("coding").__name__, "SDNNRegressor" in names(), "SDNNRegressor" in public
    ('sdnn.coding', True, True)
    """
    package = namespace["__name__"]
    with open(namespace["__file__"], encoding="utf-8") as source:
        blocks = [node for node in ast.parse(source.read()).body if isinstance(node, ast.If)]
    imports = [node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom)]
    homes = {name.name: str(node.module) for node in imports for name in node.names}

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if homes[name] == package:  # a module of the package
            return import_module(f"{package}.{name}")
        return getattr(import_module(homes[name]), name)

    return load, lambda: sorted({*namespace, *homes}), sorted(homes)
