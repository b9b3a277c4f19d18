"""How the cost of a step grows with the number of inputs: what is measured, and its records.

Source: spec section 5, claim 9. A step is one whole decision of a learning agent without its
environment: acting in a new random state and learning the transition to it. Times are the only
results that no seed fixes; they are stored like trials, and figures are drawn from what is stored.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sdnn.experiments.engine import Observer
    from sdnn.experiments.store import ResultStore


@dataclass(frozen=True)
class Series:
    """One curve of the figure.

    Parameters
    ----------
    id
        The word used in the result file.
    title
        The word used in figures and tables.
    agent
        Id of the agent.
    growth
        What the number of operations is proportional to, for a reader (mathtext).
    """

    id: str
    title: str
    agent: str
    growth: str


SERIES = (
    Series("sdnn-c", "SDNN-C", "sdnn-c", "$d(d-1)$ groups of columns"),
    Series("fql", "FQL", "fql", "$2^d$ fired rules of $9^d$"),
    Series("rbfn", "RBFN, factored", "rbfn", "$4^{d+1}$ weights"),
    Series("rbfn-plain", "RBFN, plain", "rbfn", "$601 \\cdot 4^{d+1}$ basis values"),
)


@dataclass(frozen=True, kw_only=True)
class CostConfig:
    """How thoroughly costs are measured.

    Parameters
    ----------
    n_inputs
        Numbers of inputs d.
    n_rounds
        Rounds; each gives the median over its steps, and rounds are what intervals are drawn from.
    round_seconds
        Time of a round, as far as steps allow: every round has at least `min_steps`.
    min_steps
        Fewest steps in a round.
    n_learned
        Steps of learning before the first round: an agent at work has no fresh weights.
    most_plain_inputs
        Largest number of inputs of RBFN evaluated plainly: seconds a step with 8.
    """

    n_inputs: tuple[int, ...] = (2, 3, 4, 5, 6, 7, 8)
    n_rounds: int = 5
    round_seconds: float = 0.1
    min_steps: int = 1
    n_learned: int = 500
    most_plain_inputs: int = 8

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of the values."""
        text = json.dumps(asdict(self), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


QUICK_COST = CostConfig(n_rounds=3, round_seconds=0.01, min_steps=1, most_plain_inputs=5)


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


MeasureSteps: TypeAlias = Callable[[Series, int, CostConfig], "StepTimes | None"]
"""Measures a series at a number of inputs; None where there is no memory for it."""


def cost_keys(config: CostConfig) -> tuple[CostKey, ...]:
    """Keys of all measurements, each series in ascending numbers of inputs."""
    return tuple(
        CostKey(series.id, n_inputs, config.config_hash)
        for series in SERIES
        for n_inputs in sorted(config.n_inputs)
        if series.id != "rbfn-plain" or n_inputs <= config.most_plain_inputs
    )


def measure_costs(
    config: CostConfig,
    store: ResultStore,
    measure: MeasureSteps,
    *,
    version: str,
    machine: str,
    observer: Observer,
) -> None:
    """Measure what is not stored yet, one after another, and store each at once.

    Parameters
    ----------
    config
        How thoroughly.
    store
        Where the records go.
    measure
        Measures one of them.
    version
        Version of the library.
    machine
        Processor and instruction set.
    observer
        Told what happens.

    Raises
    ------
    StoreError
        If the store cannot be read or written.
    """
    stored = {record.key for record in store.load_costs(config.config_hash)}
    missing = [key for key in cost_keys(config) if key not in stored]
    observer.costs_begun(len(missing))
    for key, series in _with_series(missing):
        times = measure(series, key.n_inputs, config)
        if times is not None:
            record = CostRecord(
                key=key,
                version=version,
                machine=machine,
                finished_at=datetime.now(timezone.utc).isoformat(timespec="seconds"),
                times=times,
            )
            store.add_cost(record)
        observer.cost_measured(f"{series.title}, {key.n_inputs} inputs")


def _with_series(keys: list[CostKey]) -> Iterator[tuple[CostKey, Series]]:
    series = {series.id: series for series in SERIES}
    for key in keys:
        yield key, series[key.series]
