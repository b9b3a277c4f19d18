"""Names of a package that are loaded when they are first used."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from typing import Any

__all__ = ["attach"]


def attach(namespace: dict[str, Any]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Make ``__getattr__`` and ``__dir__`` of a package from its imports for type checkers.

    What a package imports under ``if TYPE_CHECKING:`` is thus written once, for type checkers,
    for readers and for loading. ``namespace`` is the package's ``globals()``.

    Examples
    --------
    >>> import sdnn
    >>> load, names = attach(vars(sdnn))
    >>> load("coding").__name__, "SDNNRegressor" in names()
    ('sdnn.coding', True)
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

    return load, lambda: sorted({*namespace, *homes})
