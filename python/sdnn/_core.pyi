"""
The compiled core of sdnn; use it through the package's rooms.
"""
from __future__ import annotations
import collections.abc
import enum
import numpy
import numpy.typing
import typing
class Stream(enum.Enum):
    """
    What a random number is for
    """
    code_books = 1
    evaluation_sensor_noise = 8
    evaluation_ties = 7
    exploration = 5
    permutations = 2
    sensor_noise = 6
    ties = 4
    weights = 3
class SelectiveDesensitization:
    """
    The desensitized code of a sample, from its bins
    """
    def __init__(self, modified: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.int8]], modifiers: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.int8]], pairs: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> None:
        ...
    def gram(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], other_bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None) -> numpy.typing.NDArray[numpy.int32]:
        """
        Inner products of codes
        """
    def transform(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.int8]:
        """
        Entries +1, 0, -1, sample by sample
        """
    @property
    def n_columns(self) -> int:
        ...
    @property
    def n_inputs(self) -> int:
        ...
    @property
    def n_pairs(self) -> int:
        ...
    @property
    def n_units(self) -> int:
        ...
class InitialWeights(enum.Enum):
    """
    How the weights start
    """
    ternary = 0
    uniform = 1
class Rounding(enum.Enum):
    """
    How numbers of units are rounded
    """
    away = 2
    half_up = 0
    random = 1
class SDNNCConfig:
    """
    Everything that defines an SDNN-C
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, n_inputs: typing.SupportsInt | typing.SupportsIndex = 4, max_pairs: typing.SupportsInt | typing.SupportsIndex = 0, n_pattern_units: typing.SupportsInt | typing.SupportsIndex = 200, n_anchor_patterns: typing.SupportsInt | typing.SupportsIndex = 9, n_interpolated: typing.SupportsInt | typing.SupportsIndex = 44, balanced_anchors: bool = True, circular: collections.abc.Sequence[bool] = [], n_symbols: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], n_hidden_units: typing.SupportsInt | typing.SupportsIndex = 900, n_active_units: typing.SupportsInt | typing.SupportsIndex = 300, n_actions: typing.SupportsInt | typing.SupportsIndex = 0, q_low: typing.SupportsFloat | typing.SupportsIndex = -20.0, q_high: typing.SupportsFloat | typing.SupportsIndex = 20.0, u_low: typing.SupportsInt | typing.SupportsIndex | None = None, u_high: typing.SupportsInt | typing.SupportsIndex | None = None, learning_coefficient: typing.SupportsFloat | typing.SupportsIndex = 0.1, lattice: typing.SupportsInt | typing.SupportsIndex = 1, initial_threshold: typing.SupportsFloat | typing.SupportsIndex = 200.0, initial_weights: InitialWeights = InitialWeights.ternary, initial_weight_limit: typing.SupportsFloat | typing.SupportsIndex = 0.1, rounding: Rounding = Rounding.half_up, averaging_interval: typing.SupportsInt | typing.SupportsIndex = 0, max_table_bytes: typing.SupportsInt | typing.SupportsIndex = 1073741824) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def averaging_interval(self) -> int:
        ...
    @property
    def balanced_anchors(self) -> bool:
        ...
    @property
    def circular(self) -> list[bool]:
        ...
    @property
    def initial_threshold(self) -> float:
        ...
    @property
    def initial_weight_limit(self) -> float:
        ...
    @property
    def initial_weights(self) -> InitialWeights:
        ...
    @property
    def lattice(self) -> int:
        ...
    @property
    def learning_coefficient(self) -> float:
        ...
    @property
    def max_pairs(self) -> int:
        ...
    @property
    def max_table_bytes(self) -> int:
        ...
    @property
    def n_actions(self) -> int:
        ...
    @property
    def n_active_units(self) -> int:
        ...
    @property
    def n_anchor_patterns(self) -> int:
        ...
    @property
    def n_hidden_units(self) -> int:
        ...
    @property
    def n_inputs(self) -> int:
        ...
    @property
    def n_interpolated(self) -> int:
        ...
    @property
    def n_pattern_units(self) -> int:
        ...
    @property
    def n_symbols(self) -> list[int]:
        ...
    @property
    def q_high(self) -> float:
        ...
    @property
    def q_low(self) -> float:
        ...
    @property
    def rounding(self) -> Rounding:
        ...
    @property
    def u_high(self) -> int | None:
        ...
    @property
    def u_low(self) -> int | None:
        ...
class SDNNC:
    """
    A network that gives Q(s, a) for every action at once
    """
    @typing.overload
    def __init__(self, config: SDNNCConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @typing.overload
    def __init__(self, config: SDNNCConfig, seed: typing.SupportsInt | typing.SupportsIndex, tables: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.int8]]) -> None:
        """
        With the patterns of each input: (n_bins, m) of -1, +1
        """
    def averaged_thresholds(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        Their average, or the thresholds: (n,)
        """
    def averaged_values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        As values, by the average of the weights: (l,) -> (n_actions,)
        """
    def averaged_weights(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        Their average, or the weights: (n, D)
        """
    def first_units(self) -> numpy.typing.NDArray[numpy.uint32]:
        """
        Where the window of every action begins: (n_actions,)
        """
    def output_values(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        g(u) of u = 0 .. n' active units: (n' + 1,)
        """
    def permutation(self, mu: typing.SupportsInt | typing.SupportsIndex, nu: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.uint32]:
        """
        sigma_mu_nu: (m,)
        """
    def potentials(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.int32]:
        """
        Inner potentials in lattice steps; shapes (l,) -> (n,)
        """
    def set_parameters(self, weights: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], thresholds: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> None:
        ...
    def table(self, input: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
        """
        Patterns of an input: (n_bins, m) of -1, +1
        """
    def thresholds(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        A copy, in lattice steps: (n,)
        """
    def update(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.SupportsInt | typing.SupportsIndex, target: typing.SupportsFloat | typing.SupportsIndex, rate: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        """
        One correction of Q = Q(state, action) towards (1 - rate) Q + rate target
        """
    def value(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.SupportsInt | typing.SupportsIndex) -> float:
        ...
    def values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q(state, a) for every action; shapes (n_inputs,) -> (n_actions,)
        """
    def weights(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        A copy, in lattice steps: (n, D)
        """
    @property
    def config(self) -> SDNNCConfig:
        ...
    @property
    def correction_counts(self) -> tuple[int, int, int, int]:
        """
        Corrections that changed units, that were rounded to no change, that wanted values outside the range, and all of them
        """
    @property
    def n_actions(self) -> int:
        ...
    @property
    def n_inputs(self) -> int:
        ...
    @property
    def output_range(self) -> tuple[float, float]:
        """
        (q_low, q_high) as they are now
        """
    @property
    def pairs(self) -> list[tuple[int, int]]:
        """
        (mu, nu) of every group of x_SD, in its order
        """
    @property
    def u_high(self) -> int:
        ...
    @property
    def u_low(self) -> int:
        ...
class FuzzyRulesConfig:
    """
    The sizes of a table of fuzzy rules
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, n_inputs: typing.SupportsInt | typing.SupportsIndex = 4, n_sets: typing.SupportsInt | typing.SupportsIndex = 9, n_actions: typing.SupportsInt | typing.SupportsIndex = 21, max_table_bytes: typing.SupportsInt | typing.SupportsIndex = 1073741824) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def max_table_bytes(self) -> int:
        ...
    @property
    def n_actions(self) -> int:
        ...
    @property
    def n_inputs(self) -> int:
        ...
    @property
    def n_sets(self) -> int:
        ...
class FuzzyRules:
    """
    Rules over a grid of triangular sets
    """
    def __init__(self, config: FuzzyRulesConfig) -> None:
        ...
    def fire(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.uint64], numpy.typing.NDArray[numpy.float64]]:
        """
        The rules that fire and their truth values
        """
    def values(self, rule: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float32]:
        """
        A copy of v(rule, a) for every action: (n_actions,)
        """
    @property
    def n_rules(self) -> int:
        ...
class RBFNetworkConfig:
    """
    The sizes of an RBF network
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, n_inputs: typing.SupportsInt | typing.SupportsIndex = 4, n_bases: typing.SupportsInt | typing.SupportsIndex = 4, n_actions: typing.SupportsInt | typing.SupportsIndex = 601, width: typing.SupportsFloat | typing.SupportsIndex = 0.5, gradient_rate: typing.SupportsFloat | typing.SupportsIndex = 3.0, max_table_bytes: typing.SupportsInt | typing.SupportsIndex = 1073741824) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def gradient_rate(self) -> float:
        ...
    @property
    def max_table_bytes(self) -> int:
        ...
    @property
    def n_actions(self) -> int:
        ...
    @property
    def n_bases(self) -> int:
        ...
    @property
    def n_inputs(self) -> int:
        ...
    @property
    def width(self) -> float:
        ...
class RBFNetwork:
    """
    Q(s, a) linear in normalized Gaussian bases
    """
    def __init__(self, config: RBFNetworkConfig) -> None:
        ...
    def set_weights(self, weights: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def update(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.SupportsInt | typing.SupportsIndex, target: typing.SupportsFloat | typing.SupportsIndex, rate: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        """
        One correction of Q = Q(state, action) towards (1 - rate) Q + rate target
        """
    def values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q(state, a) for every action; shapes (n_inputs,) -> (n_actions,)
        """
    def weights(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        A copy, row-major over inputs and action: (n_bases^(d+1),)
        """
    @property
    def config(self) -> RBFNetworkConfig:
        ...
    @property
    def n_actions(self) -> int:
        ...
    @property
    def n_joint_bases(self) -> int:
        ...
class GoalScheduleKind(enum.Enum):
    """
    The formula of lambda(k)
    """
    constant = 2
    inverse_linear = 0
    inverse_sqrt = 1
class GoalScheduleConfig:
    """
    How lambda(k) falls
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, kind: GoalScheduleKind = GoalScheduleKind.inverse_linear, scale: typing.SupportsFloat | typing.SupportsIndex = 100.0, last_episode: typing.SupportsInt | typing.SupportsIndex = 10000, floor: typing.SupportsFloat | typing.SupportsIndex = 0.01, constant_value: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def constant_value(self) -> float:
        ...
    @property
    def floor(self) -> float:
        ...
    @property
    def kind(self) -> GoalScheduleKind:
        ...
    @property
    def last_episode(self) -> int:
        ...
    @property
    def scale(self) -> float:
        ...
class GoalSchedule:
    """
    lambda as a function of the learning episode
    """
    def __call__(self, episode: typing.SupportsInt | typing.SupportsIndex) -> float:
        ...
    def __init__(self, config: GoalScheduleConfig) -> None:
        ...
class GoalTest(enum.Enum):
    """
    When the goal is looked for
    """
    decision_instant = 1
    every_step = 0
class AcrobotConfig:
    """
    The numbers of the acrobot's task
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, link_mass_1: typing.SupportsFloat | typing.SupportsIndex = 1.0, link_mass_2: typing.SupportsFloat | typing.SupportsIndex = 1.0, link_length_1: typing.SupportsFloat | typing.SupportsIndex = 1.0, link_length_2: typing.SupportsFloat | typing.SupportsIndex = 1.0, center_of_mass_1: typing.SupportsFloat | typing.SupportsIndex = 0.5, center_of_mass_2: typing.SupportsFloat | typing.SupportsIndex = 0.5, inertia_1: typing.SupportsFloat | typing.SupportsIndex = 1.0, inertia_2: typing.SupportsFloat | typing.SupportsIndex = 1.0, gravity: typing.SupportsFloat | typing.SupportsIndex = 9.8, max_torque: typing.SupportsFloat | typing.SupportsIndex = 10.0, decision_interval: typing.SupportsFloat | typing.SupportsIndex = 1.0, integration_step: typing.SupportsFloat | typing.SupportsIndex = 0.02, max_decisions: typing.SupportsInt | typing.SupportsIndex = 50, goal_height: typing.SupportsFloat | typing.SupportsIndex = 1.5, goal_velocity_1: typing.SupportsFloat | typing.SupportsIndex = 9.42477796076938, goal_velocity_2: typing.SupportsFloat | typing.SupportsIndex = 15.707963267948966, goal_test: GoalTest = GoalTest.every_step, goal_reward: typing.SupportsFloat | typing.SupportsIndex = 10.0, penalty: typing.SupportsFloat | typing.SupportsIndex = -5.0, idle_angle: typing.SupportsFloat | typing.SupportsIndex = 0.08726646259971647) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def center_of_mass_1(self) -> float:
        ...
    @property
    def center_of_mass_2(self) -> float:
        ...
    @property
    def decision_interval(self) -> float:
        ...
    @property
    def goal_height(self) -> float:
        ...
    @property
    def goal_reward(self) -> float:
        ...
    @property
    def goal_test(self) -> GoalTest:
        ...
    @property
    def goal_velocity_1(self) -> float:
        ...
    @property
    def goal_velocity_2(self) -> float:
        ...
    @property
    def gravity(self) -> float:
        ...
    @property
    def idle_angle(self) -> float:
        ...
    @property
    def inertia_1(self) -> float:
        ...
    @property
    def inertia_2(self) -> float:
        ...
    @property
    def integration_step(self) -> float:
        ...
    @property
    def link_length_1(self) -> float:
        ...
    @property
    def link_length_2(self) -> float:
        ...
    @property
    def link_mass_1(self) -> float:
        ...
    @property
    def link_mass_2(self) -> float:
        ...
    @property
    def max_decisions(self) -> int:
        ...
    @property
    def max_torque(self) -> float:
        ...
    @property
    def penalty(self) -> float:
        ...
class Acrobot:
    """
    Dynamics, reward and episode end of the acrobot
    """
    def __init__(self, config: AcrobotConfig) -> None:
        ...
    def decisions(self) -> int:
        ...
    def reset(self) -> None:
        ...
    def set_state(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def state(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def step(self, torque: typing.SupportsFloat | typing.SupportsIndex, goal_tolerance: typing.SupportsFloat | typing.SupportsIndex) -> tuple[float, bool, bool]:
        """
        (reward, terminated, truncated)
        """
    def tip_height(self) -> float:
        ...
class AcrobotBatch:
    """
    Many acrobots in step, in vector lanes
    """
    def __init__(self, config: AcrobotConfig, n_acrobots: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def __len__(self) -> int:
        ...
    def decisions(self, index: typing.SupportsInt | typing.SupportsIndex) -> int:
        ...
    def observations(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        s1..s4 of every state
        """
    def reset(self, mask: typing.Annotated[numpy.typing.ArrayLike, numpy.bool]) -> None:
        ...
    def set_state(self, index: typing.SupportsInt | typing.SupportsIndex, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def states(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def step(self, torques: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], goal_tolerances: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], moving: typing.Annotated[numpy.typing.ArrayLike, numpy.bool]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.bool], numpy.typing.NDArray[numpy.bool]]:
        """
        (rewards, terminated, truncated)
        """
    def tip_heights(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class SensorEdge(enum.Enum):
    """
    What noise does at the ends of a sensor's range
    """
    saturate = 1
    wrap = 0
class SensorNoise:
    """
    Gaussian noise on every channel
    """
    def __init__(self, sigma: typing.SupportsFloat | typing.SupportsIndex, edges: collections.abc.Sequence[SensorEdge], seed: typing.SupportsInt | typing.SupportsIndex, stream: Stream) -> None:
        ...
    def apply(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        A noisy copy
        """
class NoiseEntry(enum.Enum):
    """
    Where noise enters
    """
    basic_sensors = 1
    every_sensor = 0
class SensorConfig:
    """
    Which sensors there are and how noisy
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, n_sensors: typing.SupportsInt | typing.SupportsIndex = 4, noise: typing.SupportsFloat | typing.SupportsIndex = 0.0, noise_entry: NoiseEntry = NoiseEntry.every_sensor, n_constant: typing.SupportsInt | typing.SupportsIndex = 0, n_random: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def n_constant(self) -> int:
        ...
    @property
    def n_random(self) -> int:
        ...
    @property
    def n_sensors(self) -> int:
        ...
    @property
    def noise(self) -> float:
        ...
    @property
    def noise_entry(self) -> NoiseEntry:
        ...
class AcrobotSensors:
    """
    s1..s4, s5 and s6 with their noise
    """
    def __init__(self, config: SensorConfig, seed: typing.SupportsInt | typing.SupportsIndex, stream: Stream) -> None:
        ...
    def observe(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        ...
class ParallelPerceptron:
    """
    Units over a code, with integer weights
    """
    def __init__(self, code: SelectiveDesensitization, n_units: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex = 0, weights: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, thresholds: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, initial_range: typing.SupportsInt | typing.SupportsIndex = 5) -> None:
        ...
    def copy(self) -> ParallelPerceptron:
        """
        A layer of its own with the same weights
        """
    def counts(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], n_groups: typing.SupportsInt | typing.SupportsIndex = 1, n_threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.int32]:
        """
        How many units of each group fire
        """
    def potentials(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], n_threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.int32]:
        ...
    @property
    def n_units(self) -> int:
        ...
    @property
    def thresholds(self) -> numpy.typing.NDArray[numpy.int32]:
        ...
    @property
    def weights(self) -> numpy.typing.NDArray[numpy.int32]:
        ...
class OnlineLayer:
    """
    Weights in bytes, for samples that come one at a time; the layer lags behind
    """
    def __init__(self, layer: ParallelPerceptron) -> None:
        ...
    def learn_counts(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[int, int]:
        """
        The p-delta rule; how many samples and units were corrected. What raises changes nothing.
        """
    def learn_labels(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], labels: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], n_classes: typing.SupportsInt | typing.SupportsIndex, scheme: str) -> tuple[int, int]:
        """
        Error correction; how many samples and units were corrected. What raises changes nothing.
        """
    def potentials(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.int32]:
        ...
    def synchronize(self) -> None:
        """
        Brings the layer up to date
        """
class PDeltaTrainer:
    """
    Trains groups of units to fire in given numbers
    """
    def __init__(self, layer: ParallelPerceptron, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], form: str = 'auto', memory_limit: typing.SupportsInt | typing.SupportsIndex = 1073741824, n_threads: typing.SupportsInt | typing.SupportsIndex = 1, n_epochs: typing.SupportsInt | typing.SupportsIndex = 30) -> None:
        ...
    def present(self, order: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> tuple[int, int]:
        """
        Presents samples in that order; returns how many corrected something, and how many units were corrected
        """
    def synchronize(self) -> None:
        """
        Brings the layer's weights to those of plain training in the same order
        """
    @property
    def form(self) -> str:
        ...
    @property
    def memory(self) -> int:
        """
        Bytes beside the layer
        """
class PerceptronTrainer:
    """
    Trains units to tell classes apart
    """
    def __init__(self, layer: ParallelPerceptron, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], labels: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], n_classes: typing.SupportsInt | typing.SupportsIndex, scheme: str, form: str = 'auto', memory_limit: typing.SupportsInt | typing.SupportsIndex = 1073741824, n_threads: typing.SupportsInt | typing.SupportsIndex = 1, n_epochs: typing.SupportsInt | typing.SupportsIndex = 30) -> None:
        ...
    def present(self, order: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> tuple[int, int]:
        """
        Presents samples in that order; returns how many corrected something, and how many units were corrected
        """
    def synchronize(self) -> None:
        """
        Brings the layer's weights to those of plain training in the same order
        """
    @property
    def form(self) -> str:
        ...
    @property
    def memory(self) -> int:
        """
        Bytes beside the layer
        """
class ObservationScale:
    """
    From what is observed to [0, 1]
    """
    def __call__(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        The state, shape (n_inputs,); None where there is none
        """
    def __init__(self, low: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], high: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], inputs: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]]) -> None:
        ...
class TieRule(enum.Enum):
    """
    Which of several best actions is taken
    """
    lowest = 1
    middle = 2
    uniform = 0
class EpsilonGreedyConfig:
    """
    The policy's parameters
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, epsilon: typing.SupportsFloat | typing.SupportsIndex = 0.1, n_greedy_steps: typing.SupportsInt | typing.SupportsIndex = 10, tie_rule: TieRule = TieRule.uniform, tie_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def epsilon(self) -> float:
        ...
    @property
    def n_greedy_steps(self) -> int:
        ...
    @property
    def tie_rule(self) -> TieRule:
        ...
    @property
    def tie_tolerance(self) -> float:
        ...
class EpsilonGreedy:
    """
    The policy, over rows of values
    """
    def __init__(self, config: EpsilonGreedyConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def select(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], step: typing.SupportsInt | typing.SupportsIndex, explore: bool = True) -> int:
        ...
class ValueRange(enum.Enum):
    """
    Whether the range of values is fixed
    """
    given = 0
    seen = 1
class Schedule(enum.Enum):
    """
    How rates go to their final values
    """
    exponential = 1
    linear = 0
class QLearningConfig:
    """
    The parameters of Q-learning
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, learning_rate: typing.SupportsFloat | typing.SupportsIndex = 0.5, discount: typing.SupportsFloat | typing.SupportsIndex = 0.9, epsilon: typing.SupportsFloat | typing.SupportsIndex = 0.1, n_greedy_steps: typing.SupportsInt | typing.SupportsIndex = 10, tie_rule: TieRule = TieRule.uniform, tie_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.0, n_steps: typing.SupportsInt | typing.SupportsIndex = 1, max_repetitions: typing.SupportsInt | typing.SupportsIndex = 1, final_learning_rate: typing.SupportsFloat | typing.SupportsIndex | None = None, final_epsilon: typing.SupportsFloat | typing.SupportsIndex | None = None, value_range: ValueRange = ValueRange.given, schedule: Schedule = Schedule.linear, exploration_fraction: typing.SupportsFloat | typing.SupportsIndex = 1.0, n_random_steps: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def epsilon_at(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    def learning_rate_at(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    @property
    def discount(self) -> float:
        ...
    @property
    def epsilon(self) -> float:
        ...
    @property
    def exploration_fraction(self) -> float:
        ...
    @property
    def final_epsilon(self) -> float | None:
        ...
    @property
    def final_learning_rate(self) -> float | None:
        ...
    @property
    def learning_rate(self) -> float:
        ...
    @property
    def max_repetitions(self) -> int:
        ...
    @property
    def n_greedy_steps(self) -> int:
        ...
    @property
    def n_random_steps(self) -> int:
        ...
    @property
    def n_steps(self) -> int:
        ...
    @property
    def schedule(self) -> Schedule:
        ...
    @property
    def tie_rule(self) -> TieRule:
        ...
    @property
    def tie_tolerance(self) -> float:
        ...
    @property
    def value_range(self) -> ValueRange:
        ...
class FuzzyQLearningConfig:
    """
    The parameters of fuzzy Q-learning
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, learning_coefficient: typing.SupportsFloat | typing.SupportsIndex = 0.5, discount: typing.SupportsFloat | typing.SupportsIndex = 0.9, trace_decay: typing.SupportsFloat | typing.SupportsIndex = 0.0, epsilon: typing.SupportsFloat | typing.SupportsIndex = 0.1, n_greedy_steps: typing.SupportsInt | typing.SupportsIndex = 10, tie_rule: TieRule = TieRule.uniform, tie_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def discount(self) -> float:
        ...
    @property
    def epsilon(self) -> float:
        ...
    @property
    def learning_coefficient(self) -> float:
        ...
    @property
    def n_greedy_steps(self) -> int:
        ...
    @property
    def tie_rule(self) -> TieRule:
        ...
    @property
    def tie_tolerance(self) -> float:
        ...
    @property
    def trace_decay(self) -> float:
        ...
class FixedRate:
    """
    Waits for ticks at a fixed rate
    """
    def __init__(self, hz: typing.SupportsFloat | typing.SupportsIndex, clock: collections.abc.Callable[[], typing.SupportsFloat | typing.SupportsIndex], sleep: collections.abc.Callable[[float], None]) -> None:
        ...
    def wait(self) -> int:
        """
        Waits for the next tick and returns its number
        """
    @property
    def hz(self) -> float:
        ...
    @property
    def n_misses(self) -> int:
        ...
    @property
    def n_skipped(self) -> int:
        ...
    @property
    def worst_lateness(self) -> float:
        ...
class SDNNQLearning:
    """
    Q-learning with SDNN-C
    """
    @typing.overload
    def __init__(self, *, approximator: SDNNCConfig, learning: QLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @typing.overload
    def __init__(self, *, approximator: SDNNCConfig, learning: QLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex, tables: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.int8]]) -> None:
        """
        With the patterns of each input: (n_bins, m) of -1, +1
        """
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> int:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.SupportsInt | typing.SupportsIndex, reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def q_values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dimension: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q(state, a) of a dimension's actions, as greedy actions follow it; shapes (n_inputs,) -> (n_actions,)
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def set_epsilon(self, epsilon: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_learning_rate(self, rate: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_n_environments(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def set_progress(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def action_value(self) -> SDNNC:
        ...
    @property
    def epsilon(self) -> float:
        ...
    @property
    def learning_rate(self) -> float:
        ...
    @property
    def n_environments(self) -> int:
        ...
    @property
    def progress(self) -> float:
        ...
class DecoupledSDNNQLearning:
    """
    Q-learning with an SDNN-C per dimension
    """
    def __init__(self, *, approximator: SDNNCConfig, n_actions: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], learning: QLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> list[int]:
        ...
    def action_value(self, dimension: typing.SupportsInt | typing.SupportsIndex) -> SDNNC:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def q_values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dimension: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q(state, a) of a dimension's actions, as greedy actions follow it; shapes (n_inputs,) -> (n_actions,)
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def set_epsilon(self, epsilon: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_learning_rate(self, rate: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_n_environments(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def set_progress(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def epsilon(self) -> float:
        ...
    @property
    def learning_rate(self) -> float:
        ...
    @property
    def n_environments(self) -> int:
        ...
    @property
    def progress(self) -> float:
        ...
class RBFQLearning:
    """
    Q-learning with an RBF network
    """
    def __init__(self, *, approximator: RBFNetworkConfig, learning: QLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> int:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.SupportsInt | typing.SupportsIndex, reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def q_values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dimension: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q(state, a) of a dimension's actions, as greedy actions follow it; shapes (n_inputs,) -> (n_actions,)
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def set_epsilon(self, epsilon: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_learning_rate(self, rate: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_n_environments(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def set_progress(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def action_value(self) -> RBFNetwork:
        ...
    @property
    def epsilon(self) -> float:
        ...
    @property
    def learning_rate(self) -> float:
        ...
    @property
    def n_environments(self) -> int:
        ...
    @property
    def progress(self) -> float:
        ...
class DecoupledRBFQLearning:
    """
    Q-learning with an RBF network per dimension
    """
    def __init__(self, *, approximator: RBFNetworkConfig, n_actions: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], learning: QLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> list[int]:
        ...
    def action_value(self, dimension: typing.SupportsInt | typing.SupportsIndex) -> RBFNetwork:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def q_values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dimension: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q(state, a) of a dimension's actions, as greedy actions follow it; shapes (n_inputs,) -> (n_actions,)
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def set_epsilon(self, epsilon: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_learning_rate(self, rate: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    def set_n_environments(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def set_progress(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def epsilon(self) -> float:
        ...
    @property
    def learning_rate(self) -> float:
        ...
    @property
    def n_environments(self) -> int:
        ...
    @property
    def progress(self) -> float:
        ...
class FuzzyQLearning:
    """
    Fuzzy Q-learning; actions are numbers in [-1, 1]
    """
    def __init__(self, *, approximator: FuzzyRulesConfig, learning: FuzzyQLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> float:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def last_action(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> float:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.SupportsFloat | typing.SupportsIndex, reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def set_n_environments(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    def value(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> float:
        """
        V(state)
        """
    @property
    def n_environments(self) -> int:
        ...
    @property
    def rules(self) -> FuzzyRules:
        ...
class VectorFuzzyQLearning:
    """
    Fuzzy Q-learning with rules for each dimension
    """
    def __init__(self, *, approximator: FuzzyRulesConfig, n_dimensions: typing.SupportsInt | typing.SupportsIndex, learning: FuzzyQLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> list[float]:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def last_action(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> list[float]:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def part(self, dimension: typing.SupportsInt | typing.SupportsIndex) -> FuzzyQLearning:
        ...
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def set_n_environments(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    def value(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> float:
        """
        V(state)
        """
    @property
    def n_environments(self) -> int:
        ...
class ProtocolConfig:
    """
    How long a trial is
    """
    __hash__: typing.ClassVar[None] = None
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __init__(self, *, n_learning_episodes: typing.SupportsInt | typing.SupportsIndex = 15000, test_interval: typing.SupportsInt | typing.SupportsIndex = 10, limit_bootstraps: bool = True, noisy_tests: bool = True) -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def limit_bootstraps(self) -> bool:
        ...
    @property
    def n_learning_episodes(self) -> int:
        ...
    @property
    def noisy_tests(self) -> bool:
        ...
    @property
    def test_interval(self) -> int:
        ...
class AcrobotTrial:
    """
    SDNN-C learns the acrobot swing-up
    """
    def __init__(self, *, approximator: SDNNCConfig, learning: QLearningConfig, acrobot: AcrobotConfig, goal: GoalScheduleConfig, sensors: SensorConfig, protocol: ProtocolConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def advance(self, n_episodes: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Runs up to n more learning episodes
        """
    def memory_counts(self) -> dict[str, int]:
        """
        How potentials came about so far: full passes, from neighbours, columns added
        """
    def test_rows(self) -> dict[str, numpy.ndarray]:
        """
        Columns of the test episodes so far
        """
    @property
    def agent(self) -> SDNNQLearning:
        """
        The agent at work: asking for values changes nothing that follows
        """
    @property
    def episode(self) -> int:
        ...
    @property
    def finished(self) -> bool:
        ...
    @property
    def n_decisions(self) -> int:
        ...
class FuzzyAcrobotTrial:
    """
    Fuzzy Q-learning learns the acrobot swing-up
    """
    def __init__(self, *, approximator: FuzzyRulesConfig, learning: FuzzyQLearningConfig, acrobot: AcrobotConfig, goal: GoalScheduleConfig, sensors: SensorConfig, protocol: ProtocolConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def advance(self, n_episodes: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Runs up to n more learning episodes
        """
    def test_rows(self) -> dict[str, numpy.ndarray]:
        """
        Columns of the test episodes so far
        """
    @property
    def agent(self) -> FuzzyQLearning:
        """
        The agent at work: asking for values changes nothing that follows
        """
    @property
    def episode(self) -> int:
        ...
    @property
    def finished(self) -> bool:
        ...
    @property
    def n_decisions(self) -> int:
        ...
class RBFAcrobotTrial:
    """
    Q-learning with an RBF network learns the acrobot swing-up
    """
    def __init__(self, *, approximator: RBFNetworkConfig, learning: QLearningConfig, acrobot: AcrobotConfig, goal: GoalScheduleConfig, sensors: SensorConfig, protocol: ProtocolConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def advance(self, n_episodes: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Runs up to n more learning episodes
        """
    def test_rows(self) -> dict[str, numpy.ndarray]:
        """
        Columns of the test episodes so far
        """
    @property
    def agent(self) -> RBFQLearning:
        """
        The agent at work: asking for values changes nothing that follows
        """
    @property
    def episode(self) -> int:
        ...
    @property
    def finished(self) -> bool:
        ...
    @property
    def n_decisions(self) -> int:
        ...
class PlainRBFQLearning:
    """
    Q-learning with an RBF network evaluated without its product structure; only to be timed
    """
    def __init__(self, *, approximator: RBFNetworkConfig, learning: QLearningConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def action_value(self) -> RBFNetwork:
        """
        A copy of the network behind it
        """
class BufferRead:
    """
    Reads a buffer from front to back
    """
    def __init__(self, n_bytes: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def run(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        Nanoseconds per reading: (n_repetitions,)
        """
    @property
    def n_bytes(self) -> int:
        ...
class DenseProduct:
    """
    A dense float32 matrix-vector product
    """
    def __init__(self, n_rows: typing.SupportsInt | typing.SupportsIndex, n_columns: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def run(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        Nanoseconds per product: (n_repetitions,)
        """
class NetworkParts:
    """
    The network's parts of a decision
    """
    @typing.overload
    def __init__(self, trial: AcrobotTrial, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Times a copy of the trial's network
        """
    @typing.overload
    def __init__(self, network: SDNNC, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Times a copy of the network
        """
    def mean_bytes_of_pass(self, n_states: typing.SupportsInt | typing.SupportsIndex) -> float:
        ...
    def time_corrections(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex, n_corrected: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        Learning steps
        """
    def time_remembered_values(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        All values at the same state again
        """
    def time_selections(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex, n_selections: typing.SupportsInt | typing.SupportsIndex, n_selected: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        n_selections selections of units per repetition
        """
    def time_values(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        All values at a new state: nanoseconds (n_repetitions,)
        """
    @property
    def weight_bytes(self) -> int:
        ...
class AcrobotDecisions:
    """
    The acrobot under random torques
    """
    def __init__(self, config: AcrobotConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def run(self, n_repetitions: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
        """
        Nanoseconds per decision: (n_repetitions,)
        """
    @property
    def n_integration_steps(self) -> int:
        ...
def action_value(action: typing.SupportsInt | typing.SupportsIndex, n_actions: typing.SupportsInt | typing.SupportsIndex, low: typing.SupportsFloat | typing.SupportsIndex, high: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    The value of an action in a range cut evenly
    """
def anchor_patterns(n_units: typing.SupportsInt | typing.SupportsIndex, n_anchor_patterns: typing.SupportsInt | typing.SupportsIndex, n_interpolated: typing.SupportsInt | typing.SupportsIndex, circular: bool, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
    ...
def atan2(y: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
def available_instruction_sets() -> list[str]:
    """
    The instruction sets that this machine offers, in rising order
    """
def basic_observation(state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """
    s1..s4 of a state
    """
def correlation_matrix_patterns(n_units: typing.SupportsInt | typing.SupportsIndex, correlations: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
    ...
def energy_sensor(s3: typing.SupportsFloat | typing.SupportsIndex, s4: typing.SupportsFloat | typing.SupportsIndex) -> float:
    ...
def exp(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
def general_preset(n_inputs: typing.SupportsInt | typing.SupportsIndex) -> tuple[SDNNCConfig, QLearningConfig]:
    """
    Settings of approximator and learning, as recommended for any task
    """
def height_sensor(s1: typing.SupportsFloat | typing.SupportsIndex, s2: typing.SupportsFloat | typing.SupportsIndex) -> float:
    ...
def instruction_set() -> str:
    """
    The instruction set in use
    """
def libsdnn_tables(n_units: typing.SupportsInt | typing.SupportsIndex, inputs: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]], pairs: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], seed: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], library: str = 'libstdc++') -> tuple:
    """
    LIBSDNN's code tables, (modified, modifiers); inputs are (n_bins, n_flipped)
    """
def libsdnn_weights(n_units: typing.SupportsInt | typing.SupportsIndex, n_columns: typing.SupportsInt | typing.SupportsIndex, low: typing.SupportsInt | typing.SupportsIndex, high: typing.SupportsInt | typing.SupportsIndex, seed: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], library: str = 'libstdc++') -> tuple:
    """
    LIBSDNN's first (weights, thresholds)
    """
def log(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
def n_units_for(scheme: str, n_classes: typing.SupportsInt | typing.SupportsIndex) -> int:
    """
    Units that tell so many classes apart
    """
def normal_quantile(p: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
def paper_preset(n_inputs: typing.SupportsInt | typing.SupportsIndex) -> tuple[SDNNCConfig, QLearningConfig]:
    """
    Settings of approximator and learning, as in the paper
    """
def random_inverse_patterns(n_units: typing.SupportsInt | typing.SupportsIndex, n_bins: typing.SupportsInt | typing.SupportsIndex, n_flipped: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
    ...
def robust_preset(n_inputs: typing.SupportsInt | typing.SupportsIndex) -> tuple[SDNNCConfig, QLearningConfig]:
    """
    Settings of approximator and learning, as recommended
    """
def seed_of_dimension(seed: typing.SupportsInt | typing.SupportsIndex, d: typing.SupportsInt | typing.SupportsIndex) -> int:
    """
    The seed of the network of a dimension of the action
    """
def set_instruction_set(name: str) -> None:
    """
    Forces an instruction set, for the whole process
    """
def sin_cos(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
    """
    (sin x, cos x), item by item
    """
def small_preset(n_inputs: typing.SupportsInt | typing.SupportsIndex) -> tuple[SDNNCConfig, QLearningConfig]:
    """
    Settings of approximator and learning, for small processors
    """
def symbol_patterns(n_symbols: typing.SupportsInt | typing.SupportsIndex, n_units: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
    ...
@typing.overload
def time_agent_steps(agent: SDNNQLearning, n_repetitions: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
    """
    The agent learns and acts at random states; nanoseconds per step: (n_repetitions,)
    """
@typing.overload
def time_agent_steps(agent: FuzzyQLearning, n_repetitions: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
    """
    The agent learns and acts at random states; nanoseconds per step: (n_repetitions,)
    """
@typing.overload
def time_agent_steps(agent: RBFQLearning, n_repetitions: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
    """
    The agent learns and acts at random states; nanoseconds per step: (n_repetitions,)
    """
@typing.overload
def time_agent_steps(agent: PlainRBFQLearning, n_repetitions: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
    """
    The agent learns and acts at random states; nanoseconds per step: (n_repetitions,)
    """
def time_decisions(trial: AcrobotTrial, n_episodes: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
    """
    Advances a trial; nanoseconds of every decision in it
    """
CLASS_SCHEMES: tuple = ('one_vs_rest', 'one_vs_one')
TRAINING_FORMS: tuple = ('auto', 'dual', 'block', 'plain')
__version__: str
compiler: str = 'GCC 12.2.0'
