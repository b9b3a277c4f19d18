"""Measurement of the cost of a step against the number of inputs.

Source: method.md, section 5.4, claim 9. A step is one whole decision of a learning agent without
its environment: acting in a new random state and learning the transition to it, in the processor's
time where a step is long. Times are the only results that no seed fixes; they are stored like
trials, and figures are drawn from what is stored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field

import msgspec
import numpy as np

from sdnn import _core
from sdnn.agents.registry import AGENTS, split_label
from sdnn.runs.engine import Counted, Observer
from sdnn.runs.store import ResultStore
from sdnn.runs.trial import canonical_json, config_hash
from sdnn.support import machine

SEED = 1
KIND = "cost"  # the type of these measurements in a result file

COST_ROW_HEADER = (
    "series", "n_inputs", "round", "microseconds", "n_steps", "table_bytes", "version", "machine"
)  # fmt: skip
"""Columns of the file of all rounds of cost measurements."""


@dataclass(frozen=True)
class CostSeries:
    """A curve in the figure of costs: an agent of the core, evaluated in one way.

    Agents in Python have none: their time would be the interpreter's.
    """

    id: str  # the word used in the result file
    title: str
    agent: str
    growth: str  # what the number of operations is proportional to (mathtext)
    core_agent: Callable[..., _core.BareAgent | _core.PlainRBFQLearning]
    settings: Mapping[str, int] = field(default_factory=dict)  # that are not the default
    is_plain: bool = False
    """Whether every basis value is computed, without the use of their product structure.

    Steps with many inputs then take seconds.
    """


SERIES = (
    CostSeries("sdnn-c", "SDNN-C", "sdnn-c", "$d(d-1)$ groups of columns", _core.BareAgent),
    CostSeries("fuzzy", "FQL", "fuzzy", "$2^d$ fired rules of $9^d$", _core.BareAgent,
               {"max_table_bytes": 2**32}),  # with 8 inputs it has 3.6 GB, nearly all untouched
    CostSeries("rbf", "RBFN, factored", "rbf", "$4^{d+1}$ weights", _core.BareAgent),
    CostSeries("rbf-plain", "RBFN, plain", "rbf", "$601 \\cdot 4^{d+1}$ basis values",
               _core.PlainRBFQLearning, is_plain=True),
)  # fmt: skip
"""All curves, in the order of the figure."""


def cost_series(agents: Iterable[str] | None = None) -> tuple[CostSeries, ...]:
    """Return the curves of some agents (default: all); ValueError if there is no such agent."""
    if agents is None:
        return SERIES
    labels = [split_label(agent) for agent in agents]
    # Costs are those of default sizes: an agent with a preset has no curve.
    names = [name for name, preset in labels if preset is None]
    return tuple(series for name in names for series in SERIES if series.agent == name)


class CostRecord(msgspec.Struct, frozen=True):
    """The cost of a series at one number of inputs."""

    series: str
    n_inputs: int
    config_hash: str
    microseconds: tuple[float, ...]  # median time of a step in each round
    n_steps: int  # in a round
    table_bytes: int  # memory of what the agent learns
    machine: str
    version: str

    def to_json(self) -> dict[str, object]:
        """Return it as values that JSON can hold, without its settings."""
        return {k: v for k, v in msgspec.structs.asdict(self).items() if k != "config_hash"}


def round_rows(costs: Iterable[CostRecord]) -> Iterator[tuple[object, ...]]:
    """Yield all rounds of cost measurements, as rows under `COST_ROW_HEADER`."""
    for cost in costs:
        end = (cost.n_steps, cost.table_bytes, cost.version, cost.machine)
        for number, microseconds in enumerate(cost.microseconds):
            yield (cost.series, cost.n_inputs, number, microseconds, *end)


def load_costs(store: ResultStore, config_hash: str) -> tuple[CostRecord, ...]:
    """Read the stored measurements under the given settings, by series and number of inputs."""
    records = msgspec.convert([*store.measurements(KIND).values()], list[CostRecord])
    matching = [record for record in records if record.config_hash == config_hash]
    return tuple(sorted(matching, key=lambda record: (record.series, record.n_inputs)))


@dataclass(frozen=True, kw_only=True)
class CostConfig:
    """Effort of the measurement of costs.

    Each round gives the median over its steps; intervals are drawn from rounds. The numbers are
    chosen.
    """

    n_inputs: tuple[int, ...] = (2, 3, 4, 5, 6, 7, 8)
    n_rounds: int = 5
    round_seconds: float = 0.02
    n_slow_rounds: int = 3  # rounds of a single step, if a step takes longer than that
    slow_seconds: float = 1.0  # limit of all these rounds; else the first step is the only one
    n_learned: int = 500  # steps before the first round: untrained weights are faster
    most_plain_inputs: int = 8  # limit of plain evaluations: a step with 8 takes seconds

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of the values, the version and the machine.

        Times of another machine or version are no part of one comparison.
        """
        values = {**asdict(self), "version": _core.__version__, "machine": machine.description()}
        return config_hash(canonical_json(values))


QUICK_COST = CostConfig(n_rounds=3, round_seconds=0.01, most_plain_inputs=5)


def planned_costs(
    config: CostConfig, agents: Iterable[str] | None = None
) -> dict[str, tuple[CostSeries, int]]:
    """Return the measurements of some agents (default: all) by their keys in the store.

    Each is a series and a number of inputs. Equal measurements have equal keys and run once.
    """
    config_hash = config.config_hash
    return {
        repr((series.id, n_inputs, config_hash)): (series, n_inputs)
        for series in cost_series(agents)
        for n_inputs in sorted(config.n_inputs)
        if not series.is_plain or n_inputs <= config.most_plain_inputs
    }


def measure_costs(
    planned: Mapping[str, tuple[CostSeries, int]],
    config: CostConfig,
    store: ResultStore,
    observe: Observer,
) -> None:
    """Run the measurements that are not stored, and store each immediately."""
    stored = store.measurements(KIND)
    missing = [key for key in planned if key not in stored]
    for number, key in enumerate(missing):
        series, n_inputs = planned[key]
        observe(Counted(f"cost: {series.title}, {n_inputs} inputs", number, len(missing)))
        measured = measure_steps(series, n_inputs, config)
        if measured is not None:
            here = machine.description(), _core.__version__
            record = CostRecord(series.id, n_inputs, config.config_hash, *measured, *here)
            store.put(KIND, key, msgspec.structs.asdict(record))


def measure_steps(
    series: CostSeries, n_inputs: int, config: CostConfig
) -> tuple[tuple[float, ...], int, int] | None:
    """Measure a step, acting in a new state and learning, of an agent of the paper's sizes.

    Returns microseconds in each round, steps in a round, and bytes of what the agent learns; None
    where there is no memory for the agent.
    """
    entry = AGENTS[series.agent]
    approximator = entry.approximator(**(dict(series.settings) | {"n_inputs": n_inputs}))
    try:
        agent = series.core_agent(approximator=approximator, learning=entry.learning(), seed=SEED)
    except MemoryError:
        return None
    table_bytes = entry.table_bytes(approximator) if entry.table_bytes else 0
    first_step = _core.time_agent_steps(agent, 1, SEED)  # nanoseconds, shape (1,)
    step_seconds = float(first_step[0]) / 1e9
    steps_per_round = int(config.round_seconds / step_seconds)
    # Steps before the measurement fill the agent's memory, and are a better estimate of the time.
    n_learned = min(config.n_learned, steps_per_round)
    learning_steps = _core.time_agent_steps(agent, n_learned, SEED + 1)
    if n_learned:
        steps_per_round = int(config.round_seconds * 1e9 / float(np.median(learning_steps)))
    if steps_per_round <= 1:  # a single step fills a round
        n_slow = min(config.n_slow_rounds, int(config.slow_seconds / step_seconds))
        slow_steps = _core.time_agent_steps(agent, n_slow, SEED + 2) if n_slow else first_step
        return tuple((slow_steps / 1e3).tolist()), 1, table_bytes
    rounds = (
        _core.time_agent_steps(agent, steps_per_round, SEED + 2 + number)
        for number in range(config.n_rounds)
    )
    medians = tuple(float(np.median(steps)) / 1e3 for steps in rounds)
    return medians, steps_per_round, table_bytes
