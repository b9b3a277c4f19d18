"""How agents, runs and results show themselves, in a terminal and in a notebook."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape


class Displayed:
    """Shows what `_facts` returns, by name.

    >>> class Room(Displayed):
    ...     def _facts(self):
    ...         return {"area": "20 m2", "doors": 1}
    >>> Room()
    <Room: area 20 m2, doors 1>
    """

    def _facts(self) -> Mapping[str, object]:
        """Return what is shown."""
        raise NotImplementedError

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {value}" for name, value in self._facts().items())
        return f"<{type(self).__name__}: {facts}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(str(value))}</td></tr>"
            for name, value in self._facts().items()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"
