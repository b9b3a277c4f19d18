"""How the cost of a step grows with the number of inputs: what is measured, and how.

Source: method.md, section 5.4, claim 9. A step is one whole decision of a learning agent without
its environment: acting in a new random state and learning the transition to it. Times are the only
results that no seed fixes; they are stored like trials, and figures are drawn from what is stored.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box

from sdnn import _core, machine
from sdnn.runs.engine import Observer
from sdnn.runs.registry import AgentEntry, CostSeries, cost_series
from sdnn.runs.store import ResultStore

SEED = 1
KIND = "cost"  # of these measurements in a result file

COST_ROW_HEADER = (
    "series", "n_inputs", "round", "microseconds", "n_steps", "table_bytes", "version", "machine"
)  # fmt: skip
"""Columns of the file of all rounds of cost measurements."""


class CostKey(NamedTuple):
    """What makes two measurements the same: stored once, not measured again."""

    series: str
    n_inputs: int
    config_hash: str


@dataclass(frozen=True, kw_only=True)
class CostRecord:
    """The cost of a series at one number of inputs."""

    series: str
    n_inputs: int
    microseconds: tuple[float, ...]  # median time of a step in each round
    n_steps: int  # in a round
    table_bytes: int  # memory of what the agent learns
    machine: str
    version: str
    config_hash: str

    @property
    def key(self) -> CostKey:
        """Which measurement it is."""
        return CostKey(self.series, self.n_inputs, self.config_hash)

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold, without its settings."""
        return {k: v for k, v in asdict(self).items() if k != "config_hash"}


def round_rows(costs: Iterable[CostRecord]) -> Iterator[tuple[object, ...]]:
    """All rounds of cost measurements under `COST_ROW_HEADER`."""
    for cost in costs:
        end = (cost.n_steps, cost.table_bytes, cost.version, cost.machine)
        for number, microseconds in enumerate(cost.microseconds):
            yield (cost.series, cost.n_inputs, number, microseconds, *end)


def load_costs(store: ResultStore, config_hash: str) -> tuple[CostRecord, ...]:
    """Read the stored measurements under the given settings, sorted by key."""
    found = (
        CostRecord(**values | {"microseconds": tuple(values["microseconds"])})
        for values in store.measurements(KIND).values()
        if values["config_hash"] == config_hash
    )
    return tuple(sorted(found, key=lambda record: record.key))


@dataclass(frozen=True, kw_only=True)
class CostConfig:
    """How thoroughly costs are measured.

    Each round gives the median over its steps; intervals are drawn from rounds.
    """

    n_inputs: tuple[int, ...] = (2, 3, 4, 5, 6, 7, 8)
    n_rounds: int = 5
    round_seconds: float = 0.1
    min_steps: int = 1  # in a round
    n_learned: int = 500  # steps before the first round, so that no weights are fresh
    most_plain_inputs: int = 8  # of plain evaluations, seconds a step with 8 inputs

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of the values, the version and the machine.

        Times of another machine or version are no part of one comparison.
        """
        told = {**asdict(self), "version": _core.__version__, "machine": machine.description()}
        text = json.dumps(told, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


QUICK_COST = CostConfig(n_rounds=3, round_seconds=0.01, min_steps=1, most_plain_inputs=5)


def cost_keys(config: CostConfig, agents: Iterable[str] | None = None) -> tuple[CostKey, ...]:
    """Return the keys of all measurements of some agents (default: all), series by series."""
    return tuple(
        CostKey(series.id, n_inputs, config.config_hash)
        for _, series in cost_series(agents)
        for n_inputs in sorted(config.n_inputs)
        if not series.is_plain or n_inputs <= config.most_plain_inputs
    )


def measure_costs(
    keys: Sequence[CostKey], config: CostConfig, store: ResultStore, observer: Observer
) -> None:
    """Measure what is not stored yet, one after another, and store each at once."""
    stored = {record.key for record in load_costs(store, config.config_hash)}
    missing = [key for key in keys if key not in stored]
    observer.costs_begun(len(missing))
    by_id = {series.id: (entry, series) for entry, series in cost_series()}
    for key in missing:
        entry, series = by_id[key.series]
        measured = measure_steps(entry, series, key.n_inputs, config)
        if measured is not None:
            names = ("microseconds", "n_steps", "table_bytes")
            made = {"machine": machine.description(), "version": _core.__version__}
            record = key._asdict() | dict(zip(names, measured, strict=True)) | made
            store.put(KIND, repr(tuple(key)), record)
        observer.cost_measured(f"{series.title}, {key.n_inputs} inputs")


def measure_steps(
    entry: AgentEntry, series: CostSeries, n_inputs: int, config: CostConfig
) -> tuple[tuple[float, ...], int, int] | None:
    """Measure a step of an agent of the paper's sizes: acting in a new state and learning.

    Returns microseconds in each round, steps in a round, and bytes of what the agent learns; None
    where there is no memory for the agent.
    """
    approximator = entry.approximator(**(dict(series.settings) | {"n_inputs": n_inputs}))
    given: dict[str, Any] = {"approximator": approximator, "learning": entry.learning()}
    try:
        if series.core_agent is not None:
            agent = series.core_agent(**given, seed=SEED)
        else:
            spaces = Box(0.0, 1.0, (n_inputs,), np.float64), Box(-1.0, 1.0, (1,), np.float64)
            made: Any = entry.agent(*spaces, **given, seed=SEED)
            agent = made.core
    except MemoryError:
        return None
    step_seconds = float(_core.time_agent_steps(agent, 1, SEED)[0]) / 1e9
    in_a_round = int(config.round_seconds / step_seconds)
    n_learned = min(config.n_learned, in_a_round)
    learning = _core.time_agent_steps(agent, n_learned, SEED + 1)
    if n_learned:
        in_a_round = int(config.round_seconds * 1e9 / float(np.median(learning)))
    n_steps = max(config.min_steps, in_a_round)
    medians = tuple(
        float(np.median(_core.time_agent_steps(agent, n_steps, SEED + 2 + number))) / 1e3
        for number in range(config.n_rounds)
    )
    return medians, n_steps, series.learned_bytes(approximator)
