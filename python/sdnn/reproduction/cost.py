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
from datetime import datetime, timezone
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from sdnn import _core, machine
from sdnn.runs.engine import Observer
from sdnn.runs.registry import AgentEntry, CostSeries, cost_series
from sdnn.runs.store import ResultStore

SEED = 1
KIND = "cost"
"""Of these measurements in a result file."""

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
class StepTimes:
    """Measured times of an agent's steps.

    Parameters
    ----------
    microseconds : (n_rounds,)
        Median time of a step in each round.
    n_steps
        Steps in a round.
    table_bytes
        Memory of what the agent learns.
    """

    microseconds: NDArray[np.float64]
    n_steps: int
    table_bytes: int


@dataclass(frozen=True, kw_only=True)
class CostRecord:
    """The cost of a series at one number of inputs.

    Parameters
    ----------
    key
        Which measurement it is.
    version
        Version of the library.
    machine
        Processor and instruction set.
    finished_at
        Time of the end, ISO 8601, UTC.
    times
        What was measured.
    """

    key: CostKey
    version: str
    machine: str
    finished_at: str
    times: StepTimes

    @property
    def microseconds(self) -> NDArray[np.float64]:
        """Median time of a step in each round, (n_rounds,)."""
        return self.times.microseconds

    def stored(self) -> dict[str, Any]:
        """Return it as the result file has it; `load_costs` reads it."""
        values = {"config_hash": self.key.config_hash, "finished_at": self.finished_at}
        return {**self.to_json(), **values}

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold."""
        return {
            "series": self.key.series,
            "n_inputs": self.key.n_inputs,
            "microseconds": self.microseconds.tolist(),
            "n_steps": self.times.n_steps,
            "table_bytes": self.times.table_bytes,
            "machine": self.machine,
            "version": self.version,
        }


def round_rows(costs: Iterable[CostRecord]) -> Iterator[tuple[object, ...]]:
    """All rounds of cost measurements under `COST_ROW_HEADER`."""
    for cost in costs:
        end = (cost.times.n_steps, cost.times.table_bytes, cost.version, cost.machine)
        for number, microseconds in enumerate(cost.microseconds.tolist()):
            yield (cost.key.series, cost.key.n_inputs, number, microseconds, *end)


def load_costs(store: ResultStore, config_hash: str) -> tuple[CostRecord, ...]:
    """Read the stored measurements under the given settings, sorted by key."""
    found = []
    for told in store.measurements(KIND).values():
        if told["config_hash"] == config_hash:
            times = StepTimes(
                microseconds=np.array(told["microseconds"], np.float64),
                n_steps=told["n_steps"],
                table_bytes=told["table_bytes"],
            )
            key = CostKey(told["series"], told["n_inputs"], config_hash)
            rest = {name: told[name] for name in ("version", "machine", "finished_at")}
            found.append(CostRecord(key=key, times=times, **rest))
    return tuple(sorted(found, key=lambda record: record.key))


@dataclass(frozen=True, kw_only=True)
class CostConfig:
    """How thoroughly costs are measured.

    Each of `n_rounds` gives the median over its steps, at least `min_steps` of them; intervals are
    drawn from rounds. An agent learns `n_learned` steps before the first, so it has no fresh
    weights. Plain evaluations, seconds a step with 8 inputs, end at `most_plain_inputs`.
    """

    n_inputs: tuple[int, ...] = (2, 3, 4, 5, 6, 7, 8)
    n_rounds: int = 5
    round_seconds: float = 0.1
    min_steps: int = 1
    n_learned: int = 500
    most_plain_inputs: int = 8

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
    """Keys of all measurements of some agents (default: all), inputs ascending in each series."""
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
        times = measure_steps(entry, series, key.n_inputs, config)
        if times is not None:
            record = CostRecord(
                key=key,
                version=_core.__version__,
                machine=machine.description(),
                finished_at=datetime.now(timezone.utc).isoformat(timespec="seconds"),
                times=times,
            )
            store.put(KIND, repr(tuple(key)), record.stored())
        observer.cost_measured(f"{series.title}, {key.n_inputs} inputs")


def measure_steps(
    entry: AgentEntry, series: CostSeries, n_inputs: int, config: CostConfig
) -> StepTimes | None:
    """Measure a step of an agent of the paper's sizes: acting in a new state and learning.

    It is None where there is no memory for the agent.
    """
    approximator = entry.approximator(**(dict(series.settings) | {"n_inputs": n_inputs}))
    try:
        agent = _core_agent(entry, series, approximator)
    except MemoryError:
        return None
    step_seconds = float(_core.time_agent_steps(agent, 1, SEED)[0]) / 1e9
    in_a_round = int(config.round_seconds / step_seconds)
    n_learned = min(config.n_learned, in_a_round)
    learning = _core.time_agent_steps(agent, n_learned, SEED + 1)
    if n_learned:
        in_a_round = int(config.round_seconds * 1e9 / float(np.median(learning)))
    n_steps = max(config.min_steps, in_a_round)
    medians = [
        float(np.median(_core.time_agent_steps(agent, n_steps, SEED + 2 + number))) / 1e3
        for number in range(config.n_rounds)
    ]
    return StepTimes(
        microseconds=np.array(medians, np.float64),
        n_steps=n_steps,
        table_bytes=series.learned_bytes(approximator),
    )


def _core_agent(entry: AgentEntry, series: CostSeries, approximator: Any) -> Any:
    learning = entry.learning()
    if series.core_agent is not None:
        return series.core_agent(approximator=approximator, learning=learning, seed=SEED)
    states = Box(0.0, 1.0, (approximator.n_inputs,), np.float64)
    actions = Box(-1.0, 1.0, (1,), np.float64)
    agent: Any = entry.make_agent(
        states, actions, approximator=approximator, learning=learning, seed=SEED
    )
    return agent.core
