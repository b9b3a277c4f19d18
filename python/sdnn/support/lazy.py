"""Names of a package that are loaded when they are first used."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module


def attach(
    package: str, file: str
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Make ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose ``__file__`` is given.

    Its names are those that the stub beside it, ``__init__.pyi``, imports: nothing but statements
    such as ``from sdnn.runs.run import Goal as Goal, Run as Run``. Type checkers read the same.

    Examples
    --------
    >>> import sdnn
    >>> load, names, public = attach("sdnn", sdnn.__file__)
    >>> load("coding").__name__, "SDNNRegressor" in names(), "SDNNRegressor" in public
    ('sdnn.coding', True, True)
    """
    with open(file.rpartition(".")[0] + ".pyi", encoding="utf-8") as stub:
        words = stub.read().translate({ord(mark): " " for mark in "(),"}).split()
    modules: dict[str, str] = {}
    for place, word in enumerate(words):
        if word == "from":
            module = words[place + 1]
        elif word == "as":
            modules[words[place + 1]] = module

    def load(name: str) -> object:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if modules[name] == package:
            return import_module(f"{package}.{name}")
        return getattr(import_module(modules[name]), name)

    return load, lambda: sorted(modules), sorted(modules)
