"""The code of samples and the units over it."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.coding import Coding, WithMissing
from sdnn.coding.symbols import missing_as_nan, present
from sdnn.estimators.bins import InputBins
from sdnn.estimators.columns import PAIR_BUDGET, Array, Floats, Ints, Pairs

Rule = tuple[Array, float] | tuple[Ints, int, str]
"""Arguments of learning: (counts, share) of the p-delta rule, or (labels, n_classes, scheme)."""
# Chosen constants, on which bits depend; `FEW_SAMPLES` and those below it only change the time.
COLUMN_BUDGET = 16000  # columns divided among the pairs by default
LARGE_COLUMN_BUDGET = 4000  # of many samples
ENOUGH_UNITS = 178  # units per pattern, of all pairs of 10 inputs with either budget
FEW_SAMPLES = 32  # largest number of samples that weights in bytes learn faster
FEW_TO_PREDICT = 12  # largest number of samples that weights in bytes predict faster
WORTH_BYTES = 2  # number of single predictions after which weights are copied into bytes


def units_for_pairs(n_pairs: int, is_large: bool = False) -> int:
    """Return the units per pattern with which the whole code is about `COLUMN_BUDGET` wide.

    ``is_large`` takes fewer columns for many samples, as far as patterns keep `ENOUGH_UNITS`.

    >>> [units_for_pairs(n) for n in (2, 90, 500, 870, 4032)]
    [2000, 178, 32, 18, 8]
    >>> [units_for_pairs(n, is_large=True) for n in (2, 20, 90)]
    [2000, 200, 178]
    """
    least = 32 if n_pairs <= PAIR_BUDGET else 8
    n_units = min(2000, max(least, 2 * round(COLUMN_BUDGET / n_pairs / 2)))
    if is_large:
        n_units = min(n_units, max(ENOUGH_UNITS, 2 * round(LARGE_COLUMN_BUDGET / n_pairs / 2)))
    return n_units


def code_bytes(codings: Sequence[Coding], pairs: Sequence[tuple[int, int]], n_units: int) -> int:
    """Estimate the bytes that drawing and keeping the patterns takes."""
    n_patterns = sum(codings[mu].size + codings[nu].size for mu, nu in pairs)
    return int(n_patterns * n_units * 9 / 8)  # each unit is a byte here and a bit in the core


class InputCode(InputBins):
    """Turns samples into bins, and bins into the code that the network reads.

    Each input has a fitted coding, each pair (modified, modifier) the patterns of both, shape
    (n_bins, n_units); equal inputs in a pair stand for the plain pattern.
    """

    def __init__(
        self,
        codings: Sequence[Coding],
        pairs: Sequence[tuple[int, int]],
        modified: list[NDArray[np.int8]],
        modifiers: list[NDArray[np.int8]],
    ) -> None:
        self.pairs = tuple(pairs)
        self.modified = modified
        self.modifiers = modifiers
        # Inputs that no pair mentions are validated and then ignored.
        super().__init__(codings, sorted({index for pair in self.pairs for index in pair}))
        number_of = {index: number for number, index in enumerate(self.used)}
        pairs_of_used = [(number_of[mu], number_of[nu]) for mu, nu in self.pairs]
        self.core_pairs = np.array(pairs_of_used, np.int32)
        self.may_lack = np.array([isinstance(coding, WithMissing) for coding in self.codings])
        self.is_numeric = all(present(coding).is_numeric for coding in self.codings)
        self.core = _core.SelectiveDesensitization(modified, modifiers, self.core_pairs)

    def __reduce__(self) -> tuple[object, ...]:
        return InputCode, (self.codings, self.pairs, self.modified, self.modifiers)

    @functools.cached_property
    def _ranges(self) -> tuple[list[int], Floats, Floats]:
        """The inputs that have a range, and their lowest and highest values."""
        indices = [index for index in self.used if self.codings[index].ends() is not None]
        ranges = [self.codings[index].ends() for index in indices]
        low, high = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
        return indices, low, high

    def outside(self, table: Array) -> tuple[int, str]:
        """Count the values that are outside their input's range, and describe the first of them."""
        indices, low, high = self._ranges
        values = table if len(indices) == table.shape[1] else table[:, indices]
        if values.dtype != np.float64:
            values = missing_as_nan(values)
        beyond = (values < low) | (values > high)
        n_beyond = int(np.count_nonzero(beyond))
        if n_beyond == 0:
            return 0, ""
        row, column = np.argwhere(beyond)[0]
        return n_beyond, (
            f"{values[row, column]} in column {indices[column]}, whose range is "
            f"[{low[column]}, {high[column]}]"
        )


def draw_input_code(
    codings: Sequence[Coding], pairs: Pairs, n_units: int, tables: str, seed: int
) -> InputCode:
    """Draw the patterns of fitted codings.

    ``tables="shared"`` draws one table per input, permuted as modifier in each pair; "separate"
    draws two tables per pair. A pair of equal inputs has the input's pattern alone as code: its
    modifier is all ones.
    """
    # Enough for "separate", two a pair, and "shared", one an input and a pair. Files of fitted
    # estimators depend on the drawn seeds, so their number stays.
    n_seeds = 2 * (len(codings) + len(pairs))
    seeds = iter(np.random.SeedSequence(seed).generate_state(n_seeds, np.uint64).tolist())
    used = sorted({index for pair in pairs for index in pair})
    ones = {mu: np.ones((codings[mu].size, n_units), np.int8) for mu, nu in pairs if mu == nu}
    if tables == "separate":
        modified = [codings[mu].patterns(n_units, next(seeds)) for mu, _ in pairs]
        modifiers = [
            ones[nu] if mu == nu else codings[nu].patterns(n_units, next(seeds)) for mu, nu in pairs
        ]
        return InputCode(codings, pairs, modified, modifiers)
    shared = {index: codings[index].patterns(n_units, next(seeds)) for index in used}
    # RandomState takes seeds of 32 bits only.
    orders = [np.random.RandomState(next(seeds) % 2**32).permutation(n_units) for _ in pairs]
    modifiers = [
        ones[nu] if mu == nu else np.ascontiguousarray(shared[nu][:, order])
        for (mu, nu), order in zip(pairs, orders, strict=True)
    ]
    return InputCode(codings, pairs, [shared[mu] for mu, _ in pairs], modifiers)


class Network:
    """Units over the code of the inputs; weights and thresholds are exact integers.

    Any number of threads may read it while none trains it. Initial weights follow from the seed
    unless weights (n_units, n_columns) and thresholds (n_units,), or a core's layer, are given.
    """

    def __init__(
        self,
        input_code: InputCode,
        n_units: int,
        seed: int = 0,
        weights: Ints | None = None,
        thresholds: Ints | None = None,
        layer: _core.ParallelPerceptron | None = None,
    ) -> None:
        self.input_code = input_code
        self.n_units = n_units
        self._online: _core.OnlineLayer | None = None
        self._n_predicted = 0  # samples predicted in calls with few samples
        self._learned: object = None  # a new object after each change of the online layer
        self._synchronized: object = None  # `_learned` when the other layer was synchronized
        self._lock = threading.RLock()
        try:
            self._layer = layer or _core.ParallelPerceptron(
                input_code.core, n_units, seed=seed, weights=weights, thresholds=thresholds
            )
        except MemoryError:
            n_bytes = 4 * n_units * input_code.core.n_columns
            raise MemoryError(
                f"{n_units} units of {input_code.core.n_columns} columns need {n_bytes} bytes for "
                "their weights"
            ) from None

    def __reduce__(self) -> tuple[object, ...]:
        layer = self.layer
        return Network, (self.input_code, self.n_units, 0, layer.weights, layer.thresholds)

    @property
    def layer(self) -> _core.ParallelPerceptron:
        """The core's layer, synchronized; train a `copy` of the network instead."""
        if self._synchronized is not self._learned:
            # Only one thread may synchronize: the core refuses while others read the layer.
            with self._lock:
                learned = self._learned
                if self._online is not None and self._synchronized is not learned:
                    self._online.synchronize()
                    self._synchronized = learned
        return self._layer

    def copy(self) -> Network:
        """Return a network with the same code and its own weights."""
        return Network(self.input_code, self.n_units, layer=self.layer.copy())

    def online(self, memory_limit: int) -> _core.OnlineLayer | None:
        """Return the layer for single samples, kept until the weights are replaced.

        None if the weights do not fit into bytes, or exceed ``memory_limit`` at two bytes each.
        """
        n_bytes = 2 * self.n_units * self.input_code.core.n_columns
        # Another thread may have made the layer since the check: `or` looks again under the lock.
        if self._online is None and n_bytes <= memory_limit:
            with self._lock, contextlib.suppress(ValueError, MemoryError):
                self._online = self._online or _core.OnlineLayer(self._layer)
        return self._online

    def expect_few(self, n_samples: int, memory_limit: int) -> None:
        """Count samples predicted in small calls; make the online layer once that saves time."""
        if self._online is None and n_samples <= FEW_TO_PREDICT:
            if self._n_predicted >= WORTH_BYTES:
                self.online(memory_limit)
            self._n_predicted += n_samples

    def predicts_in_bytes(self, n_samples: int) -> bool:
        """Return whether the online layer predicts this number of samples faster.

        The other layer is faster for many samples, but may have to copy new weights first.
        """
        must_copy = self._synchronized is not self._learned
        most_samples = FEW_SAMPLES if must_copy else FEW_TO_PREDICT
        return self._online is not None and n_samples <= most_samples

    def learn_online(self, bins: Ints, rule: Rule, memory_limit: int) -> bool:
        """Learn samples in place, in order; return False without a layer for single samples.

        ``rule`` is (counts, share) for the p-delta rule, or (labels, n_classes, scheme). The
        caller must do nothing afterwards that may fail.
        """
        online = self.online(memory_limit)
        if online is None:
            return False
        ended = object()
        self._learned = object()  # an interrupt during learning leaves the layer marked as changed
        if len(rule) == 2:
            online.learn_counts(bins, *rule)
        else:
            online.learn_labels(bins, *rule)
        self._learned = ended
        return True

    def potentials(self, bins: Ints, n_threads: int) -> Ints:
        """Return the potentials, shape (n_samples, n_units)."""
        if self._online is not None and self.predicts_in_bytes(len(bins)):
            return self._online.potentials(bins)
        return self.layer.potentials(bins, n_threads=n_threads)

    def counts(self, bins: Ints, n_groups: int, n_threads: int) -> Ints:
        """Return the numbers of units that fire, shape (n_samples, n_groups)."""
        if self.predicts_in_bytes(len(bins)):
            firing = self.potentials(bins, n_threads) > 0
            counts: Ints = firing.reshape(len(bins), n_groups, -1).sum(axis=2, dtype=np.int32)
            return counts
        return self.layer.counts(bins, n_groups=n_groups, n_threads=n_threads)


def require_memory(
    memory_limit: int,
    n_units: int,
    n_networks: int,
    n_pattern_units: int,
    codings: Sequence[Coding],
    pairs: Sequence[tuple[int, int]],
) -> None:
    """Raise ValueError if weights and patterns of networks exceed the limit, in bytes."""
    n_bytes = 4 * n_networks * n_units * len(pairs) * n_pattern_units
    n_bytes += code_bytes(codings, pairs, n_pattern_units)
    if n_bytes > memory_limit:
        averaged = f" in {n_networks} networks, as n_averaged_epochs has it" * (n_networks > 1)
        raise ValueError(
            f"n_pattern_units={n_pattern_units} of {len(pairs)} pairs, read by {n_units} "
            f"units{averaged}, need {n_bytes} bytes for weights and patterns, more than "
            f"memory_limit={memory_limit}"
        )
