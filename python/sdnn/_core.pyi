"""
The compiled core of sdnn; use it through the packages above it.
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
class SDNNCConfig:
    """
    Everything that defines an SDNN-C; the defaults are the paper's values.
    
    Parameters
    ----------
    n_inputs : int
        l, number of inputs (section 3.1). Must be in [2, 1024].
    max_pairs : int
        Most pairs of inputs that are formed; 0: all l (l - 1), as in the paper, but 1,024 of more than 32 relevant inputs of an agent with a linear readout. Pairs are drawn at random so that each input is modified by as many others as it modifies, and by one at least. Must be in [0, 1048576].
    n_pattern_units : int
        m, units per pattern (section 4.2: 200). Must be in [2, 65536].
    n_anchor_patterns : int
        Random anchor patterns p_1, p_2, ... of a code book (section 3.1: 9). The last one is not assigned to a bin. Must be in [2, 10000].
    n_interpolated : int
        Patterns between neighbouring anchors (section 3.1: 44). There are (n_anchor_patterns - 1) (n_interpolated + 1) bins, 360 in the paper. Must be in [0, 10000].
    balanced_anchors : bool
        Whether anchors have as many +1 as -1. An assumption: the paper says "random".
    circular : tuple[bool, ...]
        Per input, whether the last anchor equals the first, as angles want it; empty: none. An assumption: the paper does not say.
    n_symbols : tuple[int, ...]
        Per input, how many symbols it may be, each with a random pattern of its own: symbol k of n is a value of (k + 0.5) / n. 0 for a number; empty: numbers only. Not in the paper. Must be in [0, 16777216].
    n_hidden_units : int
        n, hidden units (section 4.2: 900). Must be in [1, 1048576].
    n_active_units : int
        n', units in an action's window (section 4.2: 300), at most n_hidden_units. Must be in [1, 1048576].
    n_actions : int
        Number of actions; 0 stands for all n_hidden_units - n_active_units + 1 (601). Must be in [0, 1048576].
    q_low : float
        Lowest value of the output range (section 4.2: -20). Must be in [-1e+301, 1e+301].
    q_high : float
        Highest value of the output range (section 4.2: 20). Must be in [-1e+301, 1e+301].
    u_low : int | None
        Count of active units at which the output is q_low; by default n_active_units // 15 (section 4.2: 20). Must be in [0, 1048576].
    u_high : int | None
        Count of active units at which the output is q_high; by default n_active_units - u_low (section 4.2: 280). Must be in [0, 1048576].
    learning_coefficient : float
        c (section 4.2: 0.1). It scales weights and thresholds alike and changes no decision. Must be a finite number greater than 0.
    lattice : int
        Weights are integer multiples of learning_coefficient / lattice. Must be in [1, 64].
    initial_threshold : float
        The "large" initial threshold, in units of c: a multiple of 1 / lattice. An assumption. Must be finite and at least 0.
    initial_weights : {'ternary', 'uniform'}
        The "small random" initial weights: `ternary`: one lattice step down, none, or up with probabilities 1/4, 1/2, 1/4; `uniform`: within initial_weight_limit, rounded to the lattice. An assumption.
    initial_weight_limit : float
        Of `uniform` initial weights, in units of c. Must be finite and at least 0.
    rounding : {'half_up', 'random', 'away'}
        Of the number of units that are to fire. `half_up`: to the nearest; `random`: up or down at random in proportion, so that no small change is lost on average; `away`: in the direction of the change by at least one unit. An assumption.
    weight_limit : int
        Largest size, in steps of the lattice, of a stored number of a hidden unit, which is the sum or the difference of the weights of two units of the code that one unit modifies. A unit is not corrected where a number would exceed the limit. An agent that learns in C needs 127 or less. 0: 16383, beyond which is an error. Must be in [0, 16383].
    averaging_interval : int
        Above 0, the network keeps an average of its weights for greedy actions. A snapshot enters it after this number of corrections, or after a 64th of all corrections so far if that is more. The latest count most; weights take three times the memory. 0, as in the paper: no average. Must be in [0, 1000000000].
    max_table_bytes : int
        A larger network (weights, patterns, remembered potentials) is refused before memory is allocated; 1 GiB by default. For all action dimensions together, where an agent has several.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, n_inputs: int = ..., max_pairs: int = ..., n_pattern_units: int = ..., n_anchor_patterns: int = ..., n_interpolated: int = ..., balanced_anchors: bool = ..., circular: collections.abc.Sequence[bool] = ..., n_symbols: collections.abc.Sequence[int] = ..., n_hidden_units: int = ..., n_active_units: int = ..., n_actions: int = ..., q_low: float = ..., q_high: float = ..., u_low: int | None = ..., u_high: int | None = ..., learning_coefficient: float = ..., lattice: int = ..., initial_threshold: float = ..., initial_weights: typing.Literal['ternary', 'uniform'] = ..., initial_weight_limit: float = ..., rounding: typing.Literal['half_up', 'random', 'away'] = ..., weight_limit: int = ..., averaging_interval: int = ..., max_table_bytes: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> SDNNCConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> SDNNCConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def averaging_interval(self) -> int:
        """
        Above 0, the network keeps an average of its weights for greedy actions. A snapshot enters it after this number of corrections, or after a 64th of all corrections so far if that is more. The latest count most; weights take three times the memory. 0, as in the paper: no average.
        """
    @property
    def balanced_anchors(self) -> bool:
        """
        Whether anchors have as many +1 as -1. An assumption: the paper says "random".
        """
    @property
    def circular(self) -> tuple[bool, ...]:
        """
        Per input, whether the last anchor equals the first, as angles want it; empty: none. An assumption: the paper does not say.
        """
    @property
    def initial_threshold(self) -> float:
        """
        The "large" initial threshold, in units of c: a multiple of 1 / lattice. An assumption.
        """
    @property
    def initial_weight_limit(self) -> float:
        """
        Of `uniform` initial weights, in units of c.
        """
    @property
    def initial_weights(self) -> typing.Literal['ternary', 'uniform']:
        """
        The "small random" initial weights: `ternary`: one lattice step down, none, or up with probabilities 1/4, 1/2, 1/4; `uniform`: within initial_weight_limit, rounded to the lattice. An assumption.
        """
    @property
    def lattice(self) -> int:
        """
        Weights are integer multiples of learning_coefficient / lattice.
        """
    @property
    def learning_coefficient(self) -> float:
        """
        c (section 4.2: 0.1). It scales weights and thresholds alike and changes no decision.
        """
    @property
    def max_pairs(self) -> int:
        """
        Most pairs of inputs that are formed; 0: all l (l - 1), as in the paper, but 1,024 of more than 32 relevant inputs of an agent with a linear readout. Pairs are drawn at random so that each input is modified by as many others as it modifies, and by one at least.
        """
    @property
    def max_table_bytes(self) -> int:
        """
        A larger network (weights, patterns, remembered potentials) is refused before memory is allocated; 1 GiB by default. For all action dimensions together, where an agent has several.
        """
    @property
    def n_actions(self) -> int:
        """
        Number of actions; 0 stands for all n_hidden_units - n_active_units + 1 (601).
        """
    @property
    def n_active_units(self) -> int:
        """
        n', units in an action's window (section 4.2: 300), at most n_hidden_units.
        """
    @property
    def n_anchor_patterns(self) -> int:
        """
        Random anchor patterns p_1, p_2, ... of a code book (section 3.1: 9). The last one is not assigned to a bin.
        """
    @property
    def n_code_bytes(self) -> int:
        """
        Bytes of the patterns, by anchors and of symbols, plain and permuted.
        """
    @property
    def n_hidden_units(self) -> int:
        """
        n, hidden units (section 4.2: 900).
        """
    @property
    def n_inputs(self) -> int:
        """
        l, number of inputs (section 3.1).
        """
    @property
    def n_interpolated(self) -> int:
        """
        Patterns between neighbouring anchors (section 3.1: 44). There are (n_anchor_patterns - 1) (n_interpolated + 1) bins, 360 in the paper.
        """
    @property
    def n_pairs(self) -> int:
        """
        Pairs of inputs that are formed; the code has n_pattern_units for each.
        """
    @property
    def n_pattern_units(self) -> int:
        """
        m, units per pattern (section 4.2: 200).
        """
    @property
    def n_symbols(self) -> tuple[int, ...]:
        """
        Per input, how many symbols it may be, each with a random pattern of its own: symbol k of n is a value of (k + 0.5) / n. 0 for a number; empty: numbers only. Not in the paper.
        """
    @property
    def q_high(self) -> float:
        """
        Highest value of the output range (section 4.2: 20).
        """
    @property
    def q_low(self) -> float:
        """
        Lowest value of the output range (section 4.2: -20).
        """
    @property
    def rounding(self) -> typing.Literal['half_up', 'random', 'away']:
        """
        Of the number of units that are to fire. `half_up`: to the nearest; `random`: up or down at random in proportion, so that no small change is lost on average; `away`: in the direction of the change by at least one unit. An assumption.
        """
    @property
    def u_high(self) -> int | None:
        """
        Count of active units at which the output is q_high; by default n_active_units - u_low (section 4.2: 280).
        """
    @property
    def u_low(self) -> int | None:
        """
        Count of active units at which the output is q_low; by default n_active_units // 15 (section 4.2: 20).
        """
    @property
    def weight_limit(self) -> int:
        """
        Largest size, in steps of the lattice, of a stored number of a hidden unit, which is the sum or the difference of the weights of two units of the code that one unit modifies. A unit is not corrected where a number would exceed the limit. An agent that learns in C needs 127 or less. 0: 16383, beyond which is an error.
        """
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
    def mean_error(self) -> float:
        """
        How far targets, clipped to the range, were from values: of the last thousand or so
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
    @property
    def value_step(self) -> float:
        """
        What one active unit more is worth
        """
class FuzzyRulesConfig:
    """
    The sizes of a table of fuzzy rules; the defaults are the paper's.
    
    Parameters
    ----------
    n_inputs : int
        d, number of inputs. Must be in [1, 62].
    n_sets : int
        Triangular sets per input, evenly spaced over its range. There are n_sets to the power of n_inputs rules of 4 n_actions bytes: 45 MB with 6 inputs. Must be in [2, 1048576].
    n_actions : int
        Discrete actions that every rule has values of, evenly spaced over the action's range. Must be in [1, 1048576].
    max_table_bytes : int
        A larger table is refused before memory is allocated; 1 GiB by default. For all action dimensions together, where an agent has several.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, n_inputs: int = ..., n_sets: int = ..., n_actions: int = ..., max_table_bytes: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> FuzzyRulesConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> FuzzyRulesConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def max_table_bytes(self) -> int:
        """
        A larger table is refused before memory is allocated; 1 GiB by default. For all action dimensions together, where an agent has several.
        """
    @property
    def n_actions(self) -> int:
        """
        Discrete actions that every rule has values of, evenly spaced over the action's range.
        """
    @property
    def n_inputs(self) -> int:
        """
        d, number of inputs.
        """
    @property
    def n_sets(self) -> int:
        """
        Triangular sets per input, evenly spaced over its range. There are n_sets to the power of n_inputs rules of 4 n_actions bytes: 45 MB with 6 inputs.
        """
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
    The sizes of an RBF network: normalized Gaussians on an even grid, linear in the weights. The paper gives 4 bases per dimension and 601 actions; the rest are assumptions.
    
    Parameters
    ----------
    n_inputs : int
        d, number of inputs. Must be in [1, 62].
    n_bases : int
        Bases per dimension, of the inputs and of the action. There are n_bases to the power of n_inputs + 1 joint bases. Must be in [2, 1048576].
    n_actions : int
        Actions over which the maximum is taken, evenly spaced over the action's range. Must be in [1, 1048576].
    width : float
        Standard deviation of a Gaussian in units of the spacing of the centres. Must be in [0.1, 100].
    gradient_rate : float
        Rate of a gradient step. With Q-learning's learning_rate 0.5 the default is stable whatever the sizes and the width. Must be in (0, 1000000].
    max_table_bytes : int
        More weights are refused before memory is allocated; 1 GiB by default. For all action dimensions together, where an agent has several.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, n_inputs: int = ..., n_bases: int = ..., n_actions: int = ..., width: float = ..., gradient_rate: float = ..., max_table_bytes: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> RBFNetworkConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> RBFNetworkConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def gradient_rate(self) -> float:
        """
        Rate of a gradient step. With Q-learning's learning_rate 0.5 the default is stable whatever the sizes and the width.
        """
    @property
    def max_table_bytes(self) -> int:
        """
        More weights are refused before memory is allocated; 1 GiB by default. For all action dimensions together, where an agent has several.
        """
    @property
    def n_actions(self) -> int:
        """
        Actions over which the maximum is taken, evenly spaced over the action's range.
        """
    @property
    def n_bases(self) -> int:
        """
        Bases per dimension, of the inputs and of the action. There are n_bases to the power of n_inputs + 1 joint bases.
        """
    @property
    def n_inputs(self) -> int:
        """
        d, number of inputs.
        """
    @property
    def width(self) -> float:
        """
        Standard deviation of a Gaussian in units of the spacing of the centres.
        """
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
class LinearSDNNConfig:
    """
    Everything that defines a linear readout of the SDNN code; not in the paper.
    
    Parameters
    ----------
    n_inputs : int
        l, number of inputs (section 3.1). Must be in [2, 1024].
    max_pairs : int
        Most pairs of inputs that are formed; 0: all l (l - 1), as in the paper, but 1,024 of more than 32 relevant inputs of an agent with a linear readout. Pairs are drawn at random so that each input is modified by as many others as it modifies, and by one at least. Must be in [0, 1048576].
    n_pattern_units : int
        m, units per pattern. 0: as many as make about 3,072 columns, at most 768; at least 256 where these make no more than 14,336 columns, at least 64 anywhere. Must be in [0, 65536].
    n_anchor_patterns : int
        Random anchor patterns p_1, p_2, ... of a code book (section 3.1: 9). The last one is not assigned to a bin. Must be in [2, 10000].
    n_interpolated : int
        Patterns between neighbouring anchors (section 3.1: 44). There are (n_anchor_patterns - 1) (n_interpolated + 1) bins, 360 in the paper. Must be in [0, 10000].
    balanced_anchors : bool
        Whether anchors have as many +1 as -1. An assumption: the paper says "random".
    circular : tuple[bool, ...]
        Per input, whether the last anchor equals the first, as angles want it; empty: none. An assumption: the paper does not say.
    n_symbols : tuple[int, ...]
        Per input, how many symbols it may be, each with a random pattern of its own: symbol k of n is a value of (k + 0.5) / n. 0 for a number; empty: numbers only. Not in the paper. Must be in [0, 16777216].
    n_actions : int
        Number of actions, of each dimension of a box. Must be in [1, 65536].
    action_window : int
        Neighbouring readout units that an action of a box has. Actions less than so many apart share some, and so learn from each other; with 1 none do. Must be in [1, 65536].
    averaging_interval : int
        With more than 0 the readout keeps an average of its weights, by which greedy actions are chosen, and takes a snapshot for it after so many corrections. What was learned last counts most. Must be in [0, 1000000000].
    max_table_bytes : int
        A larger readout (weights, patterns, one trace) is refused before memory is allocated; 1 GiB by default.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, n_inputs: int = ..., max_pairs: int = ..., n_pattern_units: int = ..., n_anchor_patterns: int = ..., n_interpolated: int = ..., balanced_anchors: bool = ..., circular: collections.abc.Sequence[bool] = ..., n_symbols: collections.abc.Sequence[int] = ..., n_actions: int = ..., action_window: int = ..., averaging_interval: int = ..., max_table_bytes: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> LinearSDNNConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> LinearSDNNConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def action_window(self) -> int:
        """
        Neighbouring readout units that an action of a box has. Actions less than so many apart share some, and so learn from each other; with 1 none do.
        """
    @property
    def averaging_interval(self) -> int:
        """
        With more than 0 the readout keeps an average of its weights, by which greedy actions are chosen, and takes a snapshot for it after so many corrections. What was learned last counts most.
        """
    @property
    def balanced_anchors(self) -> bool:
        """
        Whether anchors have as many +1 as -1. An assumption: the paper says "random".
        """
    @property
    def circular(self) -> tuple[bool, ...]:
        """
        Per input, whether the last anchor equals the first, as angles want it; empty: none. An assumption: the paper does not say.
        """
    @property
    def max_pairs(self) -> int:
        """
        Most pairs of inputs that are formed; 0: all l (l - 1), as in the paper, but 1,024 of more than 32 relevant inputs of an agent with a linear readout. Pairs are drawn at random so that each input is modified by as many others as it modifies, and by one at least.
        """
    @property
    def max_table_bytes(self) -> int:
        """
        A larger readout (weights, patterns, one trace) is refused before memory is allocated; 1 GiB by default.
        """
    @property
    def n_actions(self) -> int:
        """
        Number of actions, of each dimension of a box.
        """
    @property
    def n_anchor_patterns(self) -> int:
        """
        Random anchor patterns p_1, p_2, ... of a code book (section 3.1: 9). The last one is not assigned to a bin.
        """
    @property
    def n_inputs(self) -> int:
        """
        l, number of inputs (section 3.1).
        """
    @property
    def n_interpolated(self) -> int:
        """
        Patterns between neighbouring anchors (section 3.1: 44). There are (n_anchor_patterns - 1) (n_interpolated + 1) bins, 360 in the paper.
        """
    @property
    def n_pattern_units(self) -> int:
        """
        m, units per pattern. 0: as many as make about 3,072 columns, at most 768; at least 256 where these make no more than 14,336 columns, at least 64 anywhere.
        """
    @property
    def n_symbols(self) -> tuple[int, ...]:
        """
        Per input, how many symbols it may be, each with a random pattern of its own: symbol k of n is a value of (k + 0.5) / n. 0 for a number; empty: numbers only. Not in the paper.
        """
class LinearSDNN:
    """
    Q(s, a) linear in the SDNN code, in integers
    """
    def __init__(self, config: LinearSDNNConfig, n_actions: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def code(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.int8]:
        """
        The paired code of a state, -1, 0 or +1: (n_inputs,) -> (n_slots,)
        """
    def permutation(self, mu: typing.SupportsInt | typing.SupportsIndex, nu: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.uint32]:
        """
        sigma_mu_nu: (m,)
        """
    def table(self, input: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
        """
        Patterns of an input: (n_bins, m) of -1, +1
        """
    def values(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dimension: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        A dimension's part of Q(state, a) for its actions, by averaged weights if there are any
        """
    def weights(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        A copy, in units: (n_rows, n_slots), the units of one dimension after the other
        """
    @property
    def config(self) -> LinearSDNNConfig:
        ...
    @property
    def exponent(self) -> int | None:
        """
        A unit of values is 2 to this power; None before any reward
        """
    @property
    def n_dimensions(self) -> int:
        ...
    @property
    def n_inputs(self) -> int:
        ...
    @property
    def pairs(self) -> list[tuple[int, int]]:
        """
        (mu, nu) of every group of x_SD, in its order
        """
class GoalScheduleConfig:
    """
    How the goal tolerance lambda(k) falls with the learning episode k (section 4.1).
    
    Parameters
    ----------
    kind : {'inverse_linear', 'inverse_sqrt', 'constant'}
        `inverse_linear`: 1 / (1 + k / scale); `inverse_sqrt`: 1 / sqrt(1 + k); or `constant`: constant_value. An assumption: the formula is garbled in print.
    scale : float
        Episodes; of `inverse_linear`. Must be a finite number greater than 0.
    last_episode : int
        The formula holds up to this episode; lambda is floor beyond. Must be at least 0.
    floor : float
        lambda beyond last_episode. Must be finite and at least 0.
    constant_value : float
        lambda of `constant`. Must be finite and at least 0.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, kind: typing.Literal['inverse_linear', 'inverse_sqrt', 'constant'] = ..., scale: float = ..., last_episode: int = ..., floor: float = ..., constant_value: float = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> GoalScheduleConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> GoalScheduleConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def constant_value(self) -> float:
        """
        lambda of `constant`.
        """
    @property
    def floor(self) -> float:
        """
        lambda beyond last_episode.
        """
    @property
    def kind(self) -> typing.Literal['inverse_linear', 'inverse_sqrt', 'constant']:
        """
        `inverse_linear`: 1 / (1 + k / scale); `inverse_sqrt`: 1 / sqrt(1 + k); or `constant`: constant_value. An assumption: the formula is garbled in print.
        """
    @property
    def last_episode(self) -> int:
        """
        The formula holds up to this episode; lambda is floor beyond.
        """
    @property
    def scale(self) -> float:
        """
        Episodes; of `inverse_linear`.
        """
class GoalSchedule:
    """
    lambda as a function of the learning episode
    """
    def __call__(self, episode: typing.SupportsInt | typing.SupportsIndex) -> float:
        ...
    def __init__(self, config: GoalScheduleConfig) -> None:
        ...
class AcrobotConfig:
    """
    The numbers of the acrobot's task; the defaults are the paper's (section 4.1).
    
    Parameters
    ----------
    link_mass_1 : float
        Mass of link 1, kg. Must be a finite number greater than 0.
    link_mass_2 : float
        Mass of link 2, kg. Must be a finite number greater than 0.
    link_length_1 : float
        Length of link 1, m. Must be a finite number greater than 0.
    link_length_2 : float
        Length of link 2, m. Must be a finite number greater than 0.
    center_of_mass_1 : float
        Centre of mass of link 1, m from the joint that it hangs on. Must be a finite number greater than 0.
    center_of_mass_2 : float
        Centre of mass of link 2, m from the joint that it hangs on. Must be a finite number greater than 0.
    inertia_1 : float
        Inertia of link 1 about its centre of mass, kg m^2. Must be a finite number greater than 0.
    inertia_2 : float
        Inertia of link 2 about its centre of mass, kg m^2. Must be a finite number greater than 0.
    gravity : float
        m/s^2.
    max_torque : float
        N m; the torque is in [-max_torque, max_torque]. Must be a finite number greater than 0.
    decision_interval : float
        s; the torque is held for it. Must be a finite number greater than 0.
    integration_step : float
        s, a whole fraction of decision_interval: Runge-Kutta of fourth order. An assumption. Must be a finite number greater than 0.
    max_decisions : int
        Decisions in an episode. Must be at least 1.
    goal_height : float
        m above joint 1, which the tip must reach.
    goal_velocity_1 : float
        rad/s. Limit of |theta1_dot|: times the goal tolerance in the goal, as it is in the penalty. Must be a finite number greater than 0.
    goal_velocity_2 : float
        rad/s. Limit of |theta2_dot|: times the goal tolerance in the goal, as it is in the penalty. Must be a finite number greater than 0.
    goal_test : {'every_step', 'decision_instant'}
        When the goal is tested: `every_step`: after every integration step, and the episode ends there; `decision_instant`: only when the next decision is due. An assumption.
    goal_reward : float
        Reward at the goal.
    penalty : float
        Reward for idling or too much speed at a decision instant; it ends nothing.
    idle_angle : float
        rad: |theta1| below it is idling; 0 turns the rule off. An assumption: 5 degrees; pi / 5 is the alternative. Must be in [0, 3.14159].
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, link_mass_1: float = ..., link_mass_2: float = ..., link_length_1: float = ..., link_length_2: float = ..., center_of_mass_1: float = ..., center_of_mass_2: float = ..., inertia_1: float = ..., inertia_2: float = ..., gravity: float = ..., max_torque: float = ..., decision_interval: float = ..., integration_step: float = ..., max_decisions: int = ..., goal_height: float = ..., goal_velocity_1: float = ..., goal_velocity_2: float = ..., goal_test: typing.Literal['every_step', 'decision_instant'] = ..., goal_reward: float = ..., penalty: float = ..., idle_angle: float = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> AcrobotConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> AcrobotConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def center_of_mass_1(self) -> float:
        """
        Centre of mass of link 1, m from the joint that it hangs on.
        """
    @property
    def center_of_mass_2(self) -> float:
        """
        Centre of mass of link 2, m from the joint that it hangs on.
        """
    @property
    def decision_interval(self) -> float:
        """
        s; the torque is held for it.
        """
    @property
    def goal_height(self) -> float:
        """
        m above joint 1, which the tip must reach.
        """
    @property
    def goal_reward(self) -> float:
        """
        Reward at the goal.
        """
    @property
    def goal_test(self) -> typing.Literal['every_step', 'decision_instant']:
        """
        When the goal is tested: `every_step`: after every integration step, and the episode ends there; `decision_instant`: only when the next decision is due. An assumption.
        """
    @property
    def goal_velocity_1(self) -> float:
        """
        rad/s. Limit of |theta1_dot|: times the goal tolerance in the goal, as it is in the penalty.
        """
    @property
    def goal_velocity_2(self) -> float:
        """
        rad/s. Limit of |theta2_dot|: times the goal tolerance in the goal, as it is in the penalty.
        """
    @property
    def gravity(self) -> float:
        """
        m/s^2.
        """
    @property
    def idle_angle(self) -> float:
        """
        rad: |theta1| below it is idling; 0 turns the rule off. An assumption: 5 degrees; pi / 5 is the alternative.
        """
    @property
    def inertia_1(self) -> float:
        """
        Inertia of link 1 about its centre of mass, kg m^2.
        """
    @property
    def inertia_2(self) -> float:
        """
        Inertia of link 2 about its centre of mass, kg m^2.
        """
    @property
    def integration_step(self) -> float:
        """
        s, a whole fraction of decision_interval: Runge-Kutta of fourth order. An assumption.
        """
    @property
    def link_length_1(self) -> float:
        """
        Length of link 1, m.
        """
    @property
    def link_length_2(self) -> float:
        """
        Length of link 2, m.
        """
    @property
    def link_mass_1(self) -> float:
        """
        Mass of link 1, kg.
        """
    @property
    def link_mass_2(self) -> float:
        """
        Mass of link 2, kg.
        """
    @property
    def max_decisions(self) -> int:
        """
        Decisions in an episode.
        """
    @property
    def max_torque(self) -> float:
        """
        N m; the torque is in [-max_torque, max_torque].
        """
    @property
    def penalty(self) -> float:
        """
        Reward for idling or too much speed at a decision instant; it ends nothing.
        """
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
class SensorNoise:
    """
    Gaussian noise on every channel
    """
    def __init__(self, sigma: typing.SupportsFloat | typing.SupportsIndex, edges: collections.abc.Sequence[str], seed: typing.SupportsInt | typing.SupportsIndex, stream: Stream) -> None:
        ...
    def apply(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        A noisy copy
        """
class SensorConfig:
    """
    What the agent observes (section 4.3).
    
    Parameters
    ----------
    n_sensors : int
        4: s1..s4; 5: s5, the energy, too; 6: s6, the height, too. Must be in [4, 6].
    noise : float
        Standard deviation of the noise on every sensor; 0.02 in the paper's noisy cases. Must be finite and at least 0.
    noise_entry : {'every_sensor', 'basic_sensors'}
        Where noise enters: `every_sensor`: s5 and s6 are computed from the true s1..s4 and get noise of their own; `basic_sensors`: they are computed from the noisy ones. An assumption.
    n_constant : int
        Useless inputs besides: always 1/2, with noise as on the sensors. Not in the paper. Must be in [0, 100].
    n_random : int
        Useless inputs besides: a new uniform number each time. Not in the paper. Must be in [0, 100].
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, n_sensors: int = ..., noise: float = ..., noise_entry: typing.Literal['every_sensor', 'basic_sensors'] = ..., n_constant: int = ..., n_random: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> SensorConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> SensorConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def n_constant(self) -> int:
        """
        Useless inputs besides: always 1/2, with noise as on the sensors. Not in the paper.
        """
    @property
    def n_inputs(self) -> int:
        """
        Numbers in an observation.
        """
    @property
    def n_random(self) -> int:
        """
        Useless inputs besides: a new uniform number each time. Not in the paper.
        """
    @property
    def n_sensors(self) -> int:
        """
        4: s1..s4; 5: s5, the energy, too; 6: s6, the height, too.
        """
    @property
    def noise(self) -> float:
        """
        Standard deviation of the noise on every sensor; 0.02 in the paper's noisy cases.
        """
    @property
    def noise_entry(self) -> typing.Literal['every_sensor', 'basic_sensors']:
        """
        Where noise enters: `every_sensor`: s5 and s6 are computed from the true s1..s4 and get noise of their own; `basic_sensors`: they are computed from the noisy ones. An assumption.
        """
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
    def learn_counts(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], share: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> tuple[int, int]:
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
    def __init__(self, layer: ParallelPerceptron, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], share: typing.SupportsFloat | typing.SupportsIndex = 1.0, form: str = 'auto', memory_limit: typing.SupportsInt | typing.SupportsIndex = 1073741824, n_threads: typing.SupportsInt | typing.SupportsIndex = 1, n_epochs: typing.SupportsInt | typing.SupportsIndex = 30) -> None:
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
    Trains units to separate classes
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
class RecursiveLeastSquares:
    """
    Linear regression that learns from one sample at a time
    """
    def __init__(self, low: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], high: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], n_outputs: typing.SupportsInt | typing.SupportsIndex, forgetting: typing.SupportsFloat | typing.SupportsIndex, error_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> None:
        ...
    def add_inputs(self, low: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], high: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        """
        Adds inputs after the others, which all samples so far missed
        """
    def add_outputs(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Adds outputs after the others, whose targets so far were 0
        """
    def learn(self, inputs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def predict(self, inputs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The outputs; NaN marks a missing input
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def n_outputs(self) -> int:
        ...
class KernelWindow:
    """
    Kernel ridge regression on the last samples of a stream
    """
    def __init__(self, low: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], high: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], n_outputs: typing.SupportsInt | typing.SupportsIndex, capacity: typing.SupportsInt | typing.SupportsIndex, length_scale: typing.SupportsFloat | typing.SupportsIndex, ridge: typing.SupportsFloat | typing.SupportsIndex, target_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> None:
        ...
    def add_inputs(self, low: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], high: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        """
        Adds inputs after the others, which all samples so far missed
        """
    def add_outputs(self, n: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Adds outputs after the others, whose targets so far were 0
        """
    def learn(self, inputs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def predict(self, inputs: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The outputs; NaN marks a missing input
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def n_outputs(self) -> int:
        ...
class KernelSums:
    """
    The kernel of all pairs of inputs, between fixed samples and queries, and its sums
    """
    def __init__(self, correlations: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64]], bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], n_terms: typing.SupportsInt | typing.SupportsIndex, degree: typing.SupportsInt | typing.SupportsIndex = 1) -> None:
        ...
    def matrix(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The kernel of queries and samples
        """
    def sums(self, bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], coefficients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Sums over samples of kernel times coefficient
        """
class PredictionMixture:
    """
    A weighted mean of predictions, whose weights follow their recent errors
    """
    def __init__(self, priors: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        ...
    def learn(self, predictions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], target: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def mix(self, predictions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> float:
        """
        The weighted mean
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def weights(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class ProbabilityMixture:
    """
    A weighted mean of probabilities, whose weights follow the likelihood of recent labels
    """
    def __init__(self, n_scorers: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def learn(self, shares: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], scores: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], label: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def mix(self, shares: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], scores: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The probabilities of classes
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    @property
    def weights(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
class QLearningConfig:
    """
    The parameters of Q-learning; the defaults are the paper's (section 4.2).
    
    Parameters
    ----------
    learning_rate : float
        alpha. Must be in (0, 1].
    discount : float
        gamma. Must be in [0, 1].
    epsilon : float
        Probability of a random action; in fuzzy Q-learning each fired rule picks one for itself. Must be in [0, 1].
    n_greedy_steps : int
        First steps of an episode in which epsilon is 0. Must be in [0, 1073741824].
    tie_rule : {'uniform', 'lowest', 'middle'}
        Which of several best actions is taken: `uniform`: any with the same probability; `lowest`: the one with the lowest index; `middle`: the middle of the widest run of neighbours. An assumption.
    tie_tolerance : float
        Values at most this far below the best tie with it. Not in the paper: with `middle` the agent acts from the middle of the widest high plateau. Must be finite and at least 0.
    n_steps : int
        Rewards in a target before it bootstraps. Not in the paper, which has 1: with more, a transition is learned, once, when so many steps are known or the episode ends. Must be in [1, 1000].
    value_range : {'fixed', 'adaptive'}
        Whether Q has the approximator's range, q_low to q_high (`fixed`), or one that follows the returns of late (`adaptive`): rare ones are clipped, and time limits end no return. An RBF network has no range. Not in the paper.
    max_action_repeat : int
        Steps that a random action may last. Not in the paper, which has 1: with more, it is kept for at least k steps with probability 1 / k. With a linear readout each episode that terminates halves it, down to 5. Must be in [1, 1000000].
    final_learning_rate : float | None
        What alpha becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper. Must be in (0, 1].
    final_epsilon : float | None
        What epsilon becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper. Must be in [0, 1].
    schedule : {'linear', 'exponential'}
        How alpha and epsilon approach their final values: `linear`, or `exponential`, first * (final / first) ** progress, with no final value of 0. For any other function of the progress: `sdnn.agents.Schedule`.
    exploration_fraction : float
        Part of the progress in which epsilon goes to final_epsilon, where it then stays. Not in the paper. Must be in (0, 1].
    start_steps : int
        First steps of the agent's life in which every action is random, whatever epsilon. Not in the paper, which has 0: a rare success is found before the greedy actions have learned to do nothing. Must be in [0, 1073741824].
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, learning_rate: float = ..., discount: float = ..., epsilon: float = ..., n_greedy_steps: int = ..., tie_rule: typing.Literal['uniform', 'lowest', 'middle'] = ..., tie_tolerance: float = ..., n_steps: int = ..., value_range: typing.Literal['fixed', 'adaptive'] = ..., max_action_repeat: int = ..., final_learning_rate: float | None = ..., final_epsilon: float | None = ..., schedule: typing.Literal['linear', 'exponential'] = ..., exploration_fraction: float = ..., start_steps: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> QLearningConfig:
        ...
    def __repr__(self) -> str:
        ...
    def epsilon_at(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    def learning_rate_at(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    def replace(self, **changes: typing.Any) -> QLearningConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def discount(self) -> float:
        """
        gamma.
        """
    @property
    def epsilon(self) -> float:
        """
        Probability of a random action; in fuzzy Q-learning each fired rule picks one for itself.
        """
    @property
    def exploration_fraction(self) -> float:
        """
        Part of the progress in which epsilon goes to final_epsilon, where it then stays. Not in the paper.
        """
    @property
    def final_epsilon(self) -> float | None:
        """
        What epsilon becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper.
        """
    @property
    def final_learning_rate(self) -> float | None:
        """
        What alpha becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper.
        """
    @property
    def learning_rate(self) -> float:
        """
        alpha.
        """
    @property
    def max_action_repeat(self) -> int:
        """
        Steps that a random action may last. Not in the paper, which has 1: with more, it is kept for at least k steps with probability 1 / k. With a linear readout each episode that terminates halves it, down to 5.
        """
    @property
    def n_greedy_steps(self) -> int:
        """
        First steps of an episode in which epsilon is 0.
        """
    @property
    def n_steps(self) -> int:
        """
        Rewards in a target before it bootstraps. Not in the paper, which has 1: with more, a transition is learned, once, when so many steps are known or the episode ends.
        """
    @property
    def schedule(self) -> typing.Literal['linear', 'exponential']:
        """
        How alpha and epsilon approach their final values: `linear`, or `exponential`, first * (final / first) ** progress, with no final value of 0. For any other function of the progress: `sdnn.agents.Schedule`.
        """
    @property
    def start_steps(self) -> int:
        """
        First steps of the agent's life in which every action is random, whatever epsilon. Not in the paper, which has 0: a rare success is found before the greedy actions have learned to do nothing.
        """
    @property
    def tie_rule(self) -> typing.Literal['uniform', 'lowest', 'middle']:
        """
        Which of several best actions is taken: `uniform`: any with the same probability; `lowest`: the one with the lowest index; `middle`: the middle of the widest run of neighbours. An assumption.
        """
    @property
    def tie_tolerance(self) -> float:
        """
        Values at most this far below the best tie with it. Not in the paper: with `middle` the agent acts from the middle of the widest high plateau.
        """
    @property
    def value_range(self) -> typing.Literal['fixed', 'adaptive']:
        """
        Whether Q has the approximator's range, q_low to q_high (`fixed`), or one that follows the returns of late (`adaptive`): rare ones are clipped, and time limits end no return. An RBF network has no range. Not in the paper.
        """
class QLambdaConfig:
    """
    The parameters of Q(lambda) and Sarsa(lambda) with a linear readout of the SDNN code.
    
    Parameters
    ----------
    learning_rate : float
        alpha. Must be in (0, 1].
    discount : float
        gamma. Must be in [0, 1].
    epsilon : float
        Probability of a random action; in fuzzy Q-learning each fired rule picks one for itself. Must be in [0, 1].
    n_greedy_steps : int
        First steps of an episode in which epsilon is 0. Must be in [0, 1073741824].
    tie_rule : {'uniform', 'lowest', 'middle'}
        Which of several best actions is taken: `uniform`: any with the same probability; `lowest`: the one with the lowest index; `middle`: the middle of the widest run of neighbours. An assumption.
    tie_tolerance : float
        Values at most this far below the best tie with it. Not in the paper: with `middle` the agent acts from the middle of the widest high plateau. Must be finite and at least 0.
    trace_decay : float
        lambda: what remains of a trace after a step, beside the discount. 0: one-step targets. Must be in [0, 1].
    bootstrap : {'sarsa', 'q_learning'}
        What targets bootstrap from: `sarsa`: the value of the next action; `q_learning`: the best value, and traces end where a worse action is taken (Watkins).
    traces : {'dutch', 'replacing'}
        What a trace becomes in a state that returns: `dutch`: such that learning equals the forward view at every step (true online), in one environment; `replacing`: as if it were the first time, always so in several.
    schedule_steps : int
        Steps after which alpha and epsilon have gone half of the way to their final values: after t steps they have gone t / (t + schedule_steps) of it, whatever the planned end; epsilon goes to 0 by default, but stays where observations are discrete alone. With 0 they follow the agent's progress. Must be in [0, 1073741824].
    max_action_repeat : int
        Steps that a random action may last. Not in the paper, which has 1: with more, it is kept for at least k steps with probability 1 / k. With a linear readout each episode that terminates halves it, down to 5. Must be in [1, 1000000].
    final_learning_rate : float | None
        What alpha becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper. Must be in (0, 1].
    final_epsilon : float | None
        What epsilon becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper. Must be in [0, 1].
    schedule : {'linear', 'exponential'}
        How alpha and epsilon approach their final values: `linear`, or `exponential`, first * (final / first) ** progress, with no final value of 0. For any other function of the progress: `sdnn.agents.Schedule`.
    exploration_fraction : float
        Part of the progress in which epsilon goes to final_epsilon, where it then stays. Not in the paper. Must be in (0, 1].
    start_steps : int
        First steps of the agent's life in which every action is random, whatever epsilon. Not in the paper, which has 0: a rare success is found before the greedy actions have learned to do nothing. Must be in [0, 1073741824].
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, learning_rate: float = ..., discount: float = ..., epsilon: float = ..., n_greedy_steps: int = ..., tie_rule: typing.Literal['uniform', 'lowest', 'middle'] = ..., tie_tolerance: float = ..., trace_decay: float = ..., bootstrap: typing.Literal['sarsa', 'q_learning'] = ..., traces: typing.Literal['dutch', 'replacing'] = ..., schedule_steps: int = ..., max_action_repeat: int = ..., final_learning_rate: float | None = ..., final_epsilon: float | None = ..., schedule: typing.Literal['linear', 'exponential'] = ..., exploration_fraction: float = ..., start_steps: int = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> QLambdaConfig:
        ...
    def __repr__(self) -> str:
        ...
    def epsilon_at(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    def learning_rate_at(self, progress: typing.SupportsFloat | typing.SupportsIndex) -> float:
        ...
    def replace(self, **changes: typing.Any) -> QLambdaConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def bootstrap(self) -> typing.Literal['sarsa', 'q_learning']:
        """
        What targets bootstrap from: `sarsa`: the value of the next action; `q_learning`: the best value, and traces end where a worse action is taken (Watkins).
        """
    @property
    def discount(self) -> float:
        """
        gamma.
        """
    @property
    def epsilon(self) -> float:
        """
        Probability of a random action; in fuzzy Q-learning each fired rule picks one for itself.
        """
    @property
    def exploration_fraction(self) -> float:
        """
        Part of the progress in which epsilon goes to final_epsilon, where it then stays. Not in the paper.
        """
    @property
    def final_epsilon(self) -> float | None:
        """
        What epsilon becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper.
        """
    @property
    def final_learning_rate(self) -> float | None:
        """
        What alpha becomes as the agent's progress goes from 0 to 1; by default it stays. Not in the paper.
        """
    @property
    def learning_rate(self) -> float:
        """
        alpha.
        """
    @property
    def max_action_repeat(self) -> int:
        """
        Steps that a random action may last. Not in the paper, which has 1: with more, it is kept for at least k steps with probability 1 / k. With a linear readout each episode that terminates halves it, down to 5.
        """
    @property
    def n_greedy_steps(self) -> int:
        """
        First steps of an episode in which epsilon is 0.
        """
    @property
    def schedule(self) -> typing.Literal['linear', 'exponential']:
        """
        How alpha and epsilon approach their final values: `linear`, or `exponential`, first * (final / first) ** progress, with no final value of 0. For any other function of the progress: `sdnn.agents.Schedule`.
        """
    @property
    def schedule_steps(self) -> int:
        """
        Steps after which alpha and epsilon have gone half of the way to their final values: after t steps they have gone t / (t + schedule_steps) of it, whatever the planned end; epsilon goes to 0 by default, but stays where observations are discrete alone. With 0 they follow the agent's progress.
        """
    @property
    def start_steps(self) -> int:
        """
        First steps of the agent's life in which every action is random, whatever epsilon. Not in the paper, which has 0: a rare success is found before the greedy actions have learned to do nothing.
        """
    @property
    def tie_rule(self) -> typing.Literal['uniform', 'lowest', 'middle']:
        """
        Which of several best actions is taken: `uniform`: any with the same probability; `lowest`: the one with the lowest index; `middle`: the middle of the widest run of neighbours. An assumption.
        """
    @property
    def tie_tolerance(self) -> float:
        """
        Values at most this far below the best tie with it. Not in the paper: with `middle` the agent acts from the middle of the widest high plateau.
        """
    @property
    def trace_decay(self) -> float:
        """
        lambda: what remains of a trace after a step, beside the discount. 0: one-step targets.
        """
    @property
    def traces(self) -> typing.Literal['dutch', 'replacing']:
        """
        What a trace becomes in a state that returns: `dutch`: such that learning equals the forward view at every step (true online), in one environment; `replacing`: as if it were the first time, always so in several.
        """
class ActorCriticConfig:
    """
    The parameters of the actor-critic, linear in the SDNN code.
    
    Parameters
    ----------
    learning_rate : float
        alpha of the critic: the share of an error that a step corrects. Must be in (0, 1].
    discount : float
        gamma. Must be in [0, 1].
    trace_decay : float
        lambda: what remains of a trace after a step, beside the discount. Must be in [0, 1].
    actor_learning_rate : float
        alpha of the actor, for TD errors in units of their root mean square. Must be in (0, 1].
    entropy : float
        The weight of the policy's entropy, in units of the same: with more, actions stay random for longer. Must be in [0, 1].
    schedule_steps : int
        Steps after which both rates have gone half of the way to their final values: after t steps they have gone t / (t + schedule_steps) of it. Must be in [1, 1073741824].
    final_learning_rate : float | None
        What the critic's alpha approaches; None: it stays. Must be in (0, 1].
    final_actor_learning_rate : float | None
        What the actor's alpha approaches; None: it stays. Must be in (0, 1].
    thermometers : bool
        Whether the code has thermometers of single inputs, too, by which trends over whole ranges are learned at once.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, learning_rate: float = ..., discount: float = ..., trace_decay: float = ..., actor_learning_rate: float = ..., entropy: float = ..., schedule_steps: int = ..., final_learning_rate: float | None = ..., final_actor_learning_rate: float | None = ..., thermometers: bool = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> ActorCriticConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> ActorCriticConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def actor_learning_rate(self) -> float:
        """
        alpha of the actor, for TD errors in units of their root mean square.
        """
    @property
    def discount(self) -> float:
        """
        gamma.
        """
    @property
    def entropy(self) -> float:
        """
        The weight of the policy's entropy, in units of the same: with more, actions stay random for longer.
        """
    @property
    def final_actor_learning_rate(self) -> float | None:
        """
        What the actor's alpha approaches; None: it stays.
        """
    @property
    def final_learning_rate(self) -> float | None:
        """
        What the critic's alpha approaches; None: it stays.
        """
    @property
    def learning_rate(self) -> float:
        """
        alpha of the critic: the share of an error that a step corrects.
        """
    @property
    def schedule_steps(self) -> int:
        """
        Steps after which both rates have gone half of the way to their final values: after t steps they have gone t / (t + schedule_steps) of it.
        """
    @property
    def thermometers(self) -> bool:
        """
        Whether the code has thermometers of single inputs, too, by which trends over whole ranges are learned at once.
        """
    @property
    def trace_decay(self) -> float:
        """
        lambda: what remains of a trace after a step, beside the discount.
        """
class FuzzyQLearningConfig:
    """
    The parameters of fuzzy Q-learning; the defaults are the paper's (section 4.3).
    
    Parameters
    ----------
    learning_coefficient : float
        c_fql. An assumption: the paper does not give it; 0.1 and 1.0 are alternatives. Must be in (0, 1].
    discount : float
        gamma. Must be in [0, 1].
    trace_decay : float
        lambda of accumulating eligibility traces; 0: none, as in the paper. At most 0.99 / discount. Must be in [0, 1].
    epsilon : float
        Probability of a random action; in fuzzy Q-learning each fired rule picks one for itself. Must be in [0, 1].
    n_greedy_steps : int
        First steps of an episode in which epsilon is 0. Must be in [0, 1073741824].
    tie_rule : {'uniform', 'lowest', 'middle'}
        Which of several best actions is taken: `uniform`: any with the same probability; `lowest`: the one with the lowest index; `middle`: the middle of the widest run of neighbours. An assumption.
    tie_tolerance : float
        Values at most this far below the best tie with it. Not in the paper: with `middle` the agent acts from the middle of the widest high plateau. Must be finite and at least 0.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, learning_coefficient: float = ..., discount: float = ..., trace_decay: float = ..., epsilon: float = ..., n_greedy_steps: int = ..., tie_rule: typing.Literal['uniform', 'lowest', 'middle'] = ..., tie_tolerance: float = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> FuzzyQLearningConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> FuzzyQLearningConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def discount(self) -> float:
        """
        gamma.
        """
    @property
    def epsilon(self) -> float:
        """
        Probability of a random action; in fuzzy Q-learning each fired rule picks one for itself.
        """
    @property
    def learning_coefficient(self) -> float:
        """
        c_fql. An assumption: the paper does not give it; 0.1 and 1.0 are alternatives.
        """
    @property
    def n_greedy_steps(self) -> int:
        """
        First steps of an episode in which epsilon is 0.
        """
    @property
    def tie_rule(self) -> typing.Literal['uniform', 'lowest', 'middle']:
        """
        Which of several best actions is taken: `uniform`: any with the same probability; `lowest`: the one with the lowest index; `middle`: the middle of the widest run of neighbours. An assumption.
        """
    @property
    def tie_tolerance(self) -> float:
        """
        Values at most this far below the best tie with it. Not in the paper: with `middle` the agent acts from the middle of the widest high plateau.
        """
    @property
    def trace_decay(self) -> float:
        """
        lambda of accumulating eligibility traces; 0: none, as in the paper. At most 0.99 / discount.
        """
class ObservationConfig:
    """
    The observed variables of a task.
    
    Parameters
    ----------
    low : tuple[float | None, ...]
        Lowest value of each variable; none: not known.
    high : tuple[float | None, ...]
        Highest value of each variable; none: not known.
    adaptive : bool
        Whether ranges of numbers are fitted, within low and high.
    narrowed : bool
        Whether ranges of few inputs that are far wider than what is observed are fitted.
    running : bool
        Whether ranges of numbers follow what is observed, whatever low and high.
    angles : tuple[int, ...]
        Variables that wrap around in their ranges.
    angle_pairs : tuple[tuple[int, ...], ...]
        Variables that are the cosine and the sine of an angle.
    find_angle_pairs : bool
        Whether angle_pairs are those that observations have.
    symbols : tuple[tuple[int, ...], ...]
        First variables, and how many there are, of which one is 1.
    relevant_only : bool
        Whether inputs that have nothing to do with rewards or actions, as the warm-up finds, are left out.
    inputs : tuple[int, ...]
        Variables that are never left out.
    missing : {'error', 'hold', 'code'}
        Whether readings that are NaN or infinite are refused, the last reading is used instead, or each input has a pattern for them.
    history : {'none', 'differences', 'averages', 'observer', 'auto'}
        Whether states have nothing of earlier observations, differences from the last one, running averages, estimates of an observer in place of the inputs, or what the warm-up finds.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, low: collections.abc.Sequence[float | None] = ..., high: collections.abc.Sequence[float | None] = ..., adaptive: bool = ..., narrowed: bool = ..., running: bool = ..., angles: collections.abc.Sequence[int] = ..., angle_pairs: collections.abc.Sequence[collections.abc.Sequence[int]] = ..., find_angle_pairs: bool = ..., symbols: collections.abc.Sequence[collections.abc.Sequence[int]] = ..., relevant_only: bool = ..., inputs: collections.abc.Sequence[int] = ..., missing: typing.Literal['error', 'hold', 'code'] = ..., history: typing.Literal['none', 'differences', 'averages', 'observer', 'auto'] = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> ObservationConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> ObservationConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def adaptive(self) -> bool:
        """
        Whether ranges of numbers are fitted, within low and high.
        """
    @property
    def angle_pairs(self) -> tuple[tuple[int, ...], ...]:
        """
        Variables that are the cosine and the sine of an angle.
        """
    @property
    def angles(self) -> tuple[int, ...]:
        """
        Variables that wrap around in their ranges.
        """
    @property
    def find_angle_pairs(self) -> bool:
        """
        Whether angle_pairs are those that observations have.
        """
    @property
    def high(self) -> tuple[float | None, ...]:
        """
        Highest value of each variable; none: not known.
        """
    @property
    def history(self) -> typing.Literal['none', 'differences', 'averages', 'observer', 'auto']:
        """
        Whether states have nothing of earlier observations, differences from the last one, running averages, estimates of an observer in place of the inputs, or what the warm-up finds.
        """
    @property
    def inputs(self) -> tuple[int, ...]:
        """
        Variables that are never left out.
        """
    @property
    def low(self) -> tuple[float | None, ...]:
        """
        Lowest value of each variable; none: not known.
        """
    @property
    def missing(self) -> typing.Literal['error', 'hold', 'code']:
        """
        Whether readings that are NaN or infinite are refused, the last reading is used instead, or each input has a pattern for them.
        """
    @property
    def narrowed(self) -> bool:
        """
        Whether ranges of few inputs that are far wider than what is observed are fitted.
        """
    @property
    def relevant_only(self) -> bool:
        """
        Whether inputs that have nothing to do with rewards or actions, as the warm-up finds, are left out.
        """
    @property
    def running(self) -> bool:
        """
        Whether ranges of numbers follow what is observed, whatever low and high.
        """
    @property
    def symbols(self) -> tuple[tuple[int, ...], ...]:
        """
        First variables, and how many there are, of which one is 1.
        """
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
class ActionConfig:
    """
    The actions of a task.
    
    Parameters
    ----------
    low : tuple[float, ...]
        Lowest action of each dimension.
    high : tuple[float, ...]
        Highest action of each dimension.
    discrete : bool
        Every whole number from low to high is an action of its own.
    number : {'float64', 'float32', 'float16', 'whole'}
        To what numbers actions are rounded.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, low: collections.abc.Sequence[float] = ..., high: collections.abc.Sequence[float] = ..., discrete: bool = ..., number: typing.Literal['float64', 'float32', 'float16', 'whole'] = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> ActionConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> ActionConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def discrete(self) -> bool:
        """
        Every whole number from low to high is an action of its own.
        """
    @property
    def high(self) -> tuple[float, ...]:
        """
        Highest action of each dimension.
        """
    @property
    def low(self) -> tuple[float, ...]:
        """
        Lowest action of each dimension.
        """
    @property
    def number(self) -> typing.Literal['float64', 'float32', 'float16', 'whole']:
        """
        To what numbers actions are rounded.
        """
class Controller:
    """
    An agent in the units of its task
    """
    fields: typing.ClassVar[tuple] = (('warm_up_steps', 'int', 1000, 'Random steps before learning, where ranges are not known.', 2.0, 10000000.0, False))
    def __init__(self, *, approximator: SDNNCConfig | RBFNetworkConfig | FuzzyRulesConfig | LinearSDNNConfig, learning: QLearningConfig | FuzzyQLearningConfig | QLambdaConfig | ActorCriticConfig, seed: typing.SupportsInt | typing.SupportsIndex, observation: ObservationConfig, action: ActionConfig, warm_up_steps: typing.SupportsInt | typing.SupportsIndex = 1000, tables: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.int8]] = [], state: dict | None = None) -> None:
        """
        New, or as it was when `state` was taken
        """
    def act(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True, environment: typing.SupportsInt | typing.SupportsIndex = 0, mask: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8] | None = None) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def act_each(self, observations: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], environments: list, actions: typing.Any, masks: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8] | None = None) -> None:
        """
        Writes exploring actions in some environments, in order, to their rows of `actions`
        """
    def action_of(self, index: typing.SupportsInt | typing.SupportsIndex, dimension: typing.SupportsInt | typing.SupportsIndex) -> float:
        ...
    def begin_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def begin_greedy_episode(self, environment: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        The next acts without `explore` hold no earlier readings
        """
    def check(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], reward: typing.SupportsFloat | typing.SupportsIndex, next_observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0, next_mask: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8] | None = None, dt: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        """
        Raises what learn would; changes nothing
        """
    def end_warm_up_of_teacher(self) -> None:
        """
        Ends a warm-up in which a teacher acted; ranges reach beyond its path
        """
    def follow_teacher(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> None:
        """
        Continues an episode with a teacher's action, and learns nothing
        """
    def imitate(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], value: typing.SupportsFloat | typing.SupportsIndex, margin: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        Learns that a teacher chose an action whose return is `value`; values of others become lower by `margin` at least
        """
    def learn(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], reward: typing.SupportsFloat | typing.SupportsIndex, next_observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, environment: typing.SupportsInt | typing.SupportsIndex = 0, next_mask: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8] | None = None, dt: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    def learn_each(self, observations: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], actions: typing.Any, rewards: list, next_observations: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: list, truncated: list, environments: list, most: typing.SupportsInt | typing.SupportsIndex, n_steps: typing.SupportsInt | typing.SupportsIndex, goal: typing.SupportsFloat | typing.SupportsIndex | None, next_masks: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8] | None = None, dts: list | None = None) -> int:
        """
        Learns in environments in order: at most `most`, up to the end of an episode. After each but that last one, the progress becomes that of `goal` steps, if given, of which `n_steps` were learned before. Returns how many were learned: all before the first that cannot be, whose error is raised where it comes first
        """
    def range_use(self) -> list[tuple[float, float] | None]:
        """
        Of each variable: the share of its range that it used, and how often it was beyond
        """
    def restore(self, state: dict) -> None:
        """
        Take what `state` of one with the same settings gave; on an error nothing changes
        """
    def state(self) -> dict:
        """
        What it remembers: arrays by name
        """
    def state_of(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        The agent's state, shape (n_inputs,)
        """
    def state_value(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> float:
        """
        V(observation) of an actor-critic
        """
    def values(self, observation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], dimension: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
        """
        Q of all actions of a dimension, as greedy actions follow it; of fuzzy rules the value of the observation alone, of an actor-critic the probabilities of the actions
        """
    @property
    def approximator(self) -> SDNNCConfig | RBFNetworkConfig | FuzzyRulesConfig | LinearSDNNConfig:
        ...
    @property
    def epsilon(self) -> float:
        ...
    @epsilon.setter
    def epsilon(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def final_epsilon(self) -> float | None:
        """
        Where epsilon goes with schedule_steps; None without Q(lambda)
        """
    @property
    def has_warm_up(self) -> bool:
        """
        Whether there is, or was, a warm-up
        """
    @property
    def history(self) -> str:
        """
        The part of earlier observations in states; 'none' during the warm-up
        """
    @property
    def inputs(self) -> list[tuple[str, list[int]]]:
        """
        Of a state: kinds, and the variables that they are made of
        """
    @property
    def is_warming_up(self) -> bool:
        ...
    @property
    def learning_rate(self) -> float:
        ...
    @learning_rate.setter
    def learning_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def n_actions(self) -> list[int]:
        ...
    @property
    def n_environments(self) -> int:
        ...
    @n_environments.setter
    def n_environments(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def n_learned(self) -> int:
        ...
    @property
    def n_variables(self) -> int:
        ...
    @property
    def networks(self) -> list:
        """
        Networks or rules of each dimension, or the readout of all; states are in [0, 1]
        """
    @property
    def progress(self) -> float:
        ...
    @progress.setter
    def progress(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def ranges(self) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Lowest and highest values, (n_variables,) each
        """
    @property
    def refused_reward(self) -> tuple[float, int] | None:
        """
        The first reward that was too large to be learned, and its number from 1; or None
        """
    @property
    def reward_size(self) -> int | None:
        """
        The largest recent reward is 2 to this power, or up to twice that; or None
        """
class ProtocolConfig:
    """
    Learning protocol of a trial; the defaults are the paper's (section 4.2).
    
    Parameters
    ----------
    episodes : int
        Learning episodes in a trial. Must be in [1, 1073741824].
    evaluate_every_episodes : int
        Learning episodes between evaluations of one episode. Must be in [1, 1073741824].
    limit_bootstraps : bool
        Whether the last transition before a time limit bootstraps, as if the episode continued; else it counts as terminated.
    noisy_evaluations : bool
        Whether the sensors are as noisy in evaluations as in learning.
    
    Raises
    ------
    TypeError, ValueError
        For a value of another type or out of its bounds; ``argument`` is its name.
    """
    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]
    fields: typing.ClassVar[tuple[typing.Any, ...]]
    def __eq__(self, arg0: typing.Any) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __init__(self, *, episodes: int = ..., evaluate_every_episodes: int = ..., limit_bootstraps: bool = ..., noisy_evaluations: bool = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, tuple]:
        ...
    def __replace__(self, **changes: typing.Any) -> ProtocolConfig:
        ...
    def __repr__(self) -> str:
        ...
    def replace(self, **changes: typing.Any) -> ProtocolConfig:
        """
        Return a copy with other values of some fields.
        """
    @property
    def episodes(self) -> int:
        """
        Learning episodes in a trial.
        """
    @property
    def evaluate_every_episodes(self) -> int:
        """
        Learning episodes between evaluations of one episode.
        """
    @property
    def limit_bootstraps(self) -> bool:
        """
        Whether the last transition before a time limit bootstraps, as if the episode continued; else it counts as terminated.
        """
    @property
    def noisy_evaluations(self) -> bool:
        """
        Whether the sensors are as noisy in evaluations as in learning.
        """
class BareAgent:
    """
    An agent of any kind without a task: states in [0, 1], actions as indices or, of fuzzy rules, numbers in [-1, 1]
    """
    def __init__(self, *, approximator: SDNNCConfig | RBFNetworkConfig | FuzzyRulesConfig | LinearSDNNConfig, learning: QLearningConfig | FuzzyQLearningConfig | QLambdaConfig | ActorCriticConfig, seed: typing.SupportsInt | typing.SupportsIndex, n_actions: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = []) -> None:
        ...
    def act(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], explore: bool = True) -> list[float]:
        ...
    def begin_episode(self) -> None:
        ...
    def learn(self, state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], action: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], reward: typing.SupportsFloat | typing.SupportsIndex, next_state: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], terminated: bool, dt: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    @property
    def networks(self) -> list:
        """
        Networks or rules of each dimension, or the readout of all
        """
class AcrobotTrial:
    """
    An agent learns the acrobot swing-up
    """
    @staticmethod
    def advance_together(trials: tuple[AcrobotTrial, ...], n_decisions: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Lets each of several trials make n more decisions, or come to its end
        """
    def __init__(self, *, approximator: SDNNCConfig | RBFNetworkConfig | FuzzyRulesConfig | LinearSDNNConfig, learning: QLearningConfig | FuzzyQLearningConfig | QLambdaConfig | ActorCriticConfig, acrobot: AcrobotConfig, goal: GoalScheduleConfig, sensors: SensorConfig, protocol: ProtocolConfig, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def advance(self, n_episodes: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Runs up to n more learning episodes
        """
    def cache_counts(self) -> dict[str, int]:
        """
        Potentials so far, by their origin: full passes, from neighbours, columns added
        """
    def test_rows(self) -> dict[str, numpy.ndarray]:
        """
        Columns of the test episodes so far
        """
    @property
    def agent(self) -> BareAgent:
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
    def network(self) -> RBFNetwork:
        """
        A copy of the network behind it
        """
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
    def __init__(self, network: SDNNC, seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Times a copy of the network
        """
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
def actor_critic_presets() -> dict[str, tuple[str, LinearSDNNConfig, ActorCriticConfig, ObservationConfig]]:
    """
    The presets of the actor-critic, by name
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
def counts_of_all(layers: collections.abc.Sequence[ParallelPerceptron], bins: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], n_groups: typing.SupportsInt | typing.SupportsIndex = 1, n_threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.int32]:
    """
    How many units of each group fire, in each of some layers of one code
    """
def energy_sensor(s3: typing.SupportsFloat | typing.SupportsIndex, s4: typing.SupportsFloat | typing.SupportsIndex) -> float:
    ...
def exp(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
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
    Units that separate so many classes
    """
def normal_quantile(p: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
def observation_rows(observations: typing.Any, shape: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> numpy.typing.NDArray[numpy.float64] | None:
    """
    Observations of several environments, of a shape each, in an array or a list of arrays, as rows of float64; None where they are no such arrays of numbers
    """
def power(base: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], exponent: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> typing.Any:
    ...
def presets() -> dict[str, tuple[str, SDNNCConfig, QLearningConfig, ObservationConfig]]:
    """
    Named settings of Q-learning with SDNN-C: titles, settings of approximator, learning and observations
    """
def q_lambda_presets() -> dict[str, tuple[str, LinearSDNNConfig, QLambdaConfig, ObservationConfig]]:
    """
    The presets of Q(lambda), by name
    """
def random_inverse_patterns(n_units: typing.SupportsInt | typing.SupportsIndex, n_bins: typing.SupportsInt | typing.SupportsIndex, n_flipped: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
    ...
def set_instruction_set(name: str) -> None:
    """
    Forces an instruction set, for the whole process
    """
def sin_cos(x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
    """
    (sin x, cos x), item by item
    """
def symbol_patterns(n_symbols: typing.SupportsInt | typing.SupportsIndex, n_units: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int8]:
    ...
@typing.overload
def time_agent_steps(agent: BareAgent, n_repetitions: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.int64]:
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
