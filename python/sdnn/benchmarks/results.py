"""The results, as written to JSON. All times are in microseconds unless named otherwise."""

from __future__ import annotations

from typing import TypedDict


class Machine(TypedDict):
    """What was measured on."""

    processor: str
    system: str
    n_cores: int
    """Cores this process may use."""
    caches: dict[str, int]
    """Bytes of each cache that one core sees, by name."""
    python: str
    numpy: str
    blas: str


class Spread(TypedDict):
    """Quartiles over repetitions."""

    lower: float
    median: float
    upper: float


class NetworkResult(TypedDict):
    """The network's parts, at one number of inputs."""

    n_inputs: int
    n_hidden_units: int
    n_columns: int
    n_actions: int
    n_learning_episodes: int
    """Episodes the network had learned before it was timed."""
    values: dict[str, Spread]
    """All action values of a new state, by instruction set: encoding, hidden pass, windows."""
    remembered_values: Spread
    """All action values of the same state again."""
    correction: Spread
    """One learning step of a state just asked about."""
    n_corrected: int
    selection: Spread
    """Selecting those units, without correcting them."""
    dense: dict[str, Spread]
    """A dense float32 product of n_hidden_units x n_columns weights, by who computes it."""
    read: Spread
    """Reading a buffer of weight_bytes once."""
    weight_bytes: int
    pass_bytes: float
    """Bytes of the weights that a pass has to read, on average."""
    gigabytes_per_second: float
    """The rate of that reading."""
    least_time: float
    """pass_bytes at that rate: no pass can be quicker."""
    ratio_to_dense: dict[str, float]
    """Time of `values` over that of the quickest dense product, by instruction set."""
    share_of_limit: dict[str, float]
    """least_time over time of `values`, by instruction set."""


class AcrobotResult(TypedDict):
    """The simulated acrobot."""

    decision: Spread
    n_integration_steps: int
    integration_step_ns: float


class DecisionsResult(TypedDict):
    """Whole decisions of a short trial: acting, the acrobot, its sensors, learning.

    A trial makes the same decisions whenever it is run; the time of a decision is its median over
    `n_runs` runs, so that what else the machine did shows little.
    """

    n_inputs: int
    noise: float
    n_episodes: int
    n_decisions: int
    n_runs: int
    mean: float
    p50: float
    p99: float
    max: float
    max_over_p50: float
    max_of_all_runs: float
    """The longest single decision of any run, whatever disturbed it."""


class ThreadsResult(TypedDict):
    """Equal trials at once, on a thread each, against one alone; the quickest of several runs.

    Wall-clock times tell about the cores that are free; the processor's time that one trial takes
    tells whether trials are in each other's way.
    """

    n_inputs: int
    noise: float
    n_episodes: int
    n_threads: int
    alone_s: float
    together_s: float
    speedup: float
    """n_threads * alone_s / together_s."""
    processor_alone_s: float
    processor_together_s: float
    """Processor time per trial."""


class Results(TypedDict):
    """Everything that ``sdnn bench --json`` prints."""

    sdnn: str
    date: str
    quick: bool
    machine: Machine
    instruction_set: str
    best_instruction_set: str
    instruction_sets: list[str]
    networks: list[NetworkResult]
    acrobot: AcrobotResult
    decisions: list[DecisionsResult]
    threads: ThreadsResult
