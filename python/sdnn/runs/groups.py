"""Which runs differ in their seeds only, and names that tell the others apart."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sdnn.runs.run import Run

__all__ = ["Group", "groups_of"]

_CHANGES_NOTHING = ("seed", "output")
"""Of a configuration: what may differ within a group."""

_NOT_NAMED = ("0", "0.0", "none", "false", "null")
"""Values of an environment or agent that its name leaves out."""


@dataclass(frozen=True, kw_only=True)
class Group:
    """Runs that differ in their seeds only; no other group has both its task and its agent."""

    task: str
    agent: str
    runs: tuple[Run, ...]


def groups_of(runs: Sequence[Run]) -> list[Group]:
    """Put runs together that differ in their seeds only, in the order of the first of each."""
    groups: dict[tuple[tuple[str, str], ...], list[Run]] = {}
    for run in runs:
        groups.setdefault(tuple(sorted(_definition(run).items())), []).append(run)
    names = [_names(dict(_flat(members[0].spec.values()))) for members in groups.values()]
    names = _told_apart(names, [dict(definition) for definition in groups])
    names = _told_apart(names, [{"folder": str(own[0].folder)} for own in groups.values()])
    return [
        Group(task=task, agent=agent, runs=tuple(members))
        for (task, agent), members in zip(names, groups.values(), strict=True)
    ]


def _told_apart(
    names: Sequence[tuple[str, str]], definitions: Sequence[Mapping[str, str]]
) -> list[tuple[str, str]]:
    """Add the values in which they differ to the agents of equal names."""
    counts = Counter(names)
    found = []
    for name, own in zip(names, definitions, strict=True):
        others = [one for other, one in zip(names, definitions, strict=True) if other == name]
        keys = sorted({key for one in others for key in one if one[key] != own.get(key)})
        words = [_word(key, own[key]) for key in keys if key in own]
        found.append((name[0], ", ".join([name[1], *words])) if counts[name] > 1 else name)
    return found


def _definition(run: Run) -> dict[str, str]:
    """Return what defines what a run learns, but for its seed, as texts by dotted keys."""
    values = {k: v for k, v in run.spec.full_values().items() if k not in _CHANGES_NOTHING}
    return dict(_flat(values)) | {"goals": ", then ".join(_goals(run))}


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        elif f"{prefix}{name}" not in ("budget.steps", "budget.episodes"):
            yield f"{prefix}{name}", value if isinstance(value, str) else json.dumps(value)


def _names(values: Mapping[str, str]) -> tuple[str, str]:
    """Return the name of the task and that of the agent."""
    task = [values.get("environment.id", "acrobot")]
    agent = [" ".join(values[key] for key in ("agent.name", "agent.preset") if key in values)]
    for key, value in values.items():
        table, _, name = key.partition(".")
        if table in ("environment", "acrobot", "goal", "sensors") and name != "id":
            task += [_word(key, value)] * (value not in _NOT_NAMED)
        if table in ("agent", "approximator", "learning") and name not in ("name", "preset"):
            agent.append(_word(key, value))
    return ", ".join(task), ", ".join(agent)


def _word(key: str, value: str) -> str:
    return value if key in ("goals", "folder") else f"{key.rpartition('.')[2]}={value}"


def _goals(run: Run) -> list[str]:
    """Write its goals, each after the step where it was given, if that was the user's choice."""
    budget = run.spec.budget
    words = [f"{budget.episodes} episodes" if budget.steps is None else f"{budget.steps} steps"]
    due = None if budget.target_return is not None else budget.steps
    for goal in run.goals:
        text = f"{goal.episodes} episodes" if goal.steps is None else f"{goal.steps} steps"
        is_early = due is not None and goal.at_step < due
        words.append(f"from {goal.at_step} on {text}" if is_early else text)
        due = goal.steps
    return words
