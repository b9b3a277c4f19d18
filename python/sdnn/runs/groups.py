"""Which runs differ in their seeds only, and names that tell the others apart."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from sdnn.runs.config import RunConfig
from sdnn.runs.run import Run

__all__ = ["Group", "groups_of"]

_CHANGES_NOTHING = ("format", "seed", "checkpoint_every", "tensorboard")
"""Of a configuration: what may differ within a group."""


@dataclass(frozen=True, kw_only=True)
class Group:
    """Runs that differ in their seeds only.

    Parameters
    ----------
    task, agent
        What was learned by what; no other group has both names.
    runs
        In the order in which they were given.
    """

    task: str
    agent: str
    runs: tuple[Run, ...]


def groups_of(runs: Sequence[Run]) -> list[Group]:
    """Put runs together that differ in their seeds only, in the order of the first of each."""
    alike: dict[str, list[Run]] = {}
    for run in runs:
        alike.setdefault(_definition(run), []).append(run)
    members = list(alike.values())
    tasks = [_task(group[0].config) for group in members]
    agents = [_agent(group[0].config) for group in members]
    agents = _told_apart(tasks, agents, [_details(group[0]) for group in members])
    folders = [{"folder": str(group[0].folder)} for group in members]
    agents = _told_apart(tasks, agents, folders)
    return [
        Group(task=task, agent=agent, runs=tuple(group))
        for task, agent, group in zip(tasks, agents, members, strict=True)
    ]


def _told_apart(
    tasks: Sequence[str], agents: Sequence[str], details: Sequence[dict[str, str]]
) -> list[str]:
    """Add to equal names those details in which they differ."""
    names = list(zip(tasks, agents, strict=True))
    counts = Counter(names)
    found = []
    for name, own in zip(names, details, strict=True):
        others = [one for other, one in zip(names, details, strict=True) if other == name]
        words = [word for key, word in own.items() if any(other[key] != word for other in others)]
        found.append(", ".join([name[1], *words]) if counts[name] > 1 else name[1])
    return found


def _definition(run: Run) -> str:
    """All that defines what a run learns, but for its seed."""
    values = run.config.values()
    for name in _CHANGES_NOTHING:
        values.pop(name, None)
    return json.dumps([values, _goals(run)], sort_keys=True)


def _goals(run: Run) -> list[tuple[int | None, str]]:
    """Its goals, each after the step where it was given, if that was the user's choice."""
    config = run.config
    goals: list[tuple[int | None, str]] = [(None, _goal(config.steps, config.episodes))]
    due = None if config.target_return is not None else config.steps
    for goal in run.goals:
        is_early = due is not None and goal.at_step < due
        goals.append((goal.at_step if is_early else None, _goal(goal.steps, goal.episodes)))
        due = goal.steps
    return goals


def _goal(steps: int | None, episodes: int | None) -> str:
    return f"{episodes} episodes" if steps is None else f"{steps} steps"


def _task(config: RunConfig) -> str:
    environment = config.environment
    words = [environment.id]
    words += [f"{name}={value}" for name, value in environment.kwargs.items()]
    words += [f"range {key}: {low} to {high}" for key, (low, high) in environment.ranges.items()]
    if environment.noise:
        words.append(f"noise {environment.noise}")
    if environment.redundant:
        words.append(f"{environment.redundant} redundant")
    return ", ".join(words)


def _agent(config: RunConfig) -> str:
    words = [config.agent if config.preset is None else f"{config.agent} {config.preset}"]
    words += [
        f"{name}={value}" for values in config.settings.values() for name, value in values.items()
    ]
    if config.angle_pairs != "none":
        words.append("angle pairs")
    return ", ".join(words)


def _details(run: Run) -> dict[str, str]:
    """Say what else may tell runs of one task and agent apart."""
    config = run.config
    every, target = config.evaluate_every, config.target_return
    goals = [goal if step is None else f"from {step} on {goal}" for step, goal in _goals(run)]
    return {
        "goals": ", then ".join(goals),
        "n_envs": f"{config.n_envs} environment{'s' if config.n_envs > 1 else ''}",
        "target": "no target" if target is None else f"target {target:g}",
        "evaluate_every": f"evaluated every {every} steps" if every else "not evaluated",
        "evaluation_episodes": f"in {config.evaluation_episodes} episodes",
        "version": f"sdnn {config.version}",
    }
