"""Representations of agents, runs and results in a terminal and in a notebook."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape


class Displayed:
    """An object that is displayed as the facts that `_facts` returns.

    >>> class Room(Displayed):
    ...     def _facts(self):
    ...         return {"area": "20 m2", "doors": 1}
    >>> Room()
    <Room: area 20 m2, doors 1>
    """

    def _facts(self) -> Mapping[str, object]:
        """Return the facts by name."""
        raise NotImplementedError

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {fact}" for name, fact in self._facts().items())
        return f"<{type(self).__name__}: {facts}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(str(fact))}</td></tr>"
            for name, fact in self._facts().items()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"
