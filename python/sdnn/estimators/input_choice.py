"""Choice of inputs, and of directions that mix inputs, by closed leave-one-out.

Useless inputs weaken a kernel of pairs, and a function of a mixture of many inputs is no sum over
pairs. The solution itself shows both. An input matters as much as outputs change where it is
averaged away. Directions in which outputs change most are eigenvectors of the mean product of
gradients (the "active subspace" of Constantine 2015). A choice is taken only if it makes errors
clearly smaller when each sample is left out. Directions follow the left-out samples, too, so their
errors are raised as those of as many fitted parameters (the final prediction error, Akaike 1969).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from sdnn.coding import Coding, RandomInverse
from sdnn.coding.kernel import N_UNITS, kernel_of_sums, pattern_key
from sdnn.estimators.columns import Array, Floats, Ints
from sdnn.estimators.ridge import Samples, Solution, apply_degree, diagonal, solve
from sdnn.estimators.training import Rows

# Chosen constants, except where a reason is given.
MOST_SAMPLES = 400  # samples that decide; solving for more would take longer than the fit itself
MOST_OUTPUTS = 200  # samples whose outputs are compared, for importances and gradients
LARGEST_ERROR = 0.97  # largest error of a better choice, as a share of the error before
LEAST_SIGNIFICANCE = 2.0  # standard errors by which the error of a better choice is smaller
N_DIRECTIONS = 2
MOST_ROUNDS = 5  # rounds in which directions are sought
STEP = 0.15  # distance of the points whose outputs give a gradient, in standard deviations

Losses = Callable[[Samples, Floats], Floats]
"""Returns the loss of each sample from its output by the solution without it."""


@dataclasses.dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs of a kernel: some of the features, then directions that mix features.

    ``directions`` has weights of positions within the features' ranges, from 0 to 1; shape
    (n_directions, n_features).
    """

    features: Rows
    directions: Floats

    def of(self, table: Array, codings: Sequence[Coding]) -> Array:
        """Return the inputs of samples, shape (n_samples, n_inputs), from all features."""
        kept = table if len(self.features) == table.shape[1] else table[:, self.features]
        if not len(self.directions):
            return kept
        mixed = positions(table, codings) @ self.directions.T
        return np.concatenate([kept, mixed.astype(table.dtype)], axis=1)

    def weights(self, codings: Sequence[Coding]) -> Floats:
        """Return the directions' weights of the features themselves, in their units."""
        limits = [coding.even_range() or (0.0, 1.0) for coding in codings]
        halves = np.array([high / 2 - low / 2 for low, high in limits])
        weights = np.zeros_like(self.directions)
        with np.errstate(over="ignore"):  # by ranges below the smallest normal number
            np.divide(self.directions / 2, halves, out=weights, where=self.directions != 0)
        return weights


def all_inputs(n_features: int) -> Inputs:
    """Return all features, without directions."""
    return Inputs(np.arange(n_features), np.empty((0, n_features)))


def is_mixable(coding: Coding) -> bool:
    """Return whether a feature can be a part of directions: a number of a range, never missing."""
    limits = coding.even_range()
    return limits is not None and limits[0] / 2 < limits[1] / 2


def positions(table: Array, codings: Sequence[Coding]) -> Floats:
    """Return positions within ranges, from 0 to 1, of features that can be mixed; others are 0."""
    limits = [coding.even_range() if is_mixable(coding) else None for coding in codings]
    is_mixed = np.array([pair is not None for pair in limits])
    low, high = np.array([pair or (0.0, 1.0) for pair in limits]).T
    result = np.zeros(table.shape)
    values = np.clip(table[:, is_mixed].astype(np.float64), low[is_mixed], high[is_mixed])
    # The width of the widest range would overflow, that of its halves does not.
    result[:, is_mixed] = (values / 2 - low[is_mixed] / 2) / (high / 2 - low / 2)[is_mixed]
    return result


def few_samples(table: Array, codings: Sequence[Coding], samples: Samples) -> tuple[Array, Samples]:
    """Draw at most `MOST_SAMPLES`, in an order that does not depend on that of all samples.

    Equal samples become one with the sum of their weights: a sample of weight 2 and two equal ones
    of weight 1 lead to the same choice.
    """
    columns = [
        table[:, i].astype(np.float64) if coding.even_range() else coding.bins(table[:, i])
        for i, coding in enumerate(codings)
    ]
    keys = np.column_stack([*columns, samples.targets])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.reshape(-1)
    weights = np.bincount(group, samples.weights).astype(np.float64)
    shares = 1 / np.bincount(group, 1 / samples.shares)  # 1 / the number of equal samples
    drawn = np.random.RandomState(0).permutation(len(first))[:MOST_SAMPLES]
    rows = first[drawn]
    return table[rows], Samples(samples.targets[rows], weights[drawn], shares[drawn])


def squared_losses(samples: Samples, left_out: Floats) -> Floats:
    """Return squared errors of outputs, in variances of the targets, shape (n_samples,)."""
    losses: Floats = (np.square(samples.targets - left_out) / samples.variances).mean(axis=1)
    return losses


def inputs_to_compare(
    codings: Sequence[Coding],
    table: Array,
    samples: Samples,
    degrees: Sequence[int],
    losses: Losses = squared_losses,
) -> list[Inputs]:
    """Return the inputs with which all samples are to be solved.

    Where less than half of the samples have decided, all features are compared, too: an input that
    is too weak to be kept with few samples may help with all of them.
    """
    every = all_inputs(len(codings))
    best = InputChoice(codings, table, samples, degrees, losses).best()
    is_every = len(best.features) == len(codings) and not len(best.directions)
    if is_every or len(table) <= 2 * MOST_SAMPLES:
        return [best]
    return [every, best]


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """A solution with some inputs, and its losses when each sample is left out."""

    inputs: Inputs
    solution: Solution
    losses: Floats  # times the penalty of directions, shape (n_samples,)
    total: Floats  # sum of the inputs' correlations, shape (n_samples, n_samples)
    kernel: Floats  # of degree 1, shape (n_samples, n_samples)


class InputChoice:
    """Solves the ridge problem of some samples with different inputs, and compares the errors.

    ``codings`` of the features are fitted; ``table`` has the features of all samples, ``samples``
    their targets and weights. ``degrees`` of the kernel are chosen from once, with all inputs.
    ``losses`` gives each sample's loss, shape (n_samples,), from the output without it.
    """

    def __init__(
        self,
        codings: Sequence[Coding],
        table: Array,
        samples: Samples,
        degrees: Sequence[int],
        losses: Losses = squared_losses,
    ) -> None:
        self._table, self._samples = few_samples(table, codings, samples)
        self._codings, self._degrees, self._losses = list(codings), degrees, losses
        self._degree: int | None = None  # that of the first candidate, then of all
        self._bins = [coding.bins(self._table[:, i]) for i, coding in enumerate(codings)]
        self._matrices: dict[object, Floats] = {}
        self._positions = positions(self._table, codings)
        self._few = slice(MOST_OUTPUTS)  # the samples whose outputs are compared
        weights = self._samples.weights
        self._shares = weights / weights.sum()
        self._n_samples = (1 / self._samples.shares).sum()  # before equal samples became one
        means = self._shares @ self._positions
        self._deviations = np.sqrt(self._shares @ np.square(self._positions - means))
        self._variances = self._samples.variances

    def best(self) -> Inputs:
        """Return the inputs with which errors are clearly smallest, by default all of them.

        Directions are sought among all features, and also among the selected ones if the selection
        is clearly better.
        """
        every = self._solve(all_inputs(len(self._codings)))
        selected = min(self._halvings(every), key=self._error, default=every)
        unmixed = [every]
        if self._is_better(selected, every):
            unmixed.append(selected)
        mixed = map(self._with_directions, unmixed)
        candidates = [candidate for candidate in mixed if len(candidate.inputs.directions)]
        return min([*candidates, unmixed[-1]], key=self._error).inputs

    def _matrix(self, coding: Coding) -> Floats:
        """Return the correlations of a coding's patterns, computed once for equal codings."""
        key = pattern_key(coding)
        if key not in self._matrices:
            self._matrices[key] = coding.correlations(N_UNITS)
        return self._matrices[key]

    def _correlations(self, feature: int, bins: Ints | None = None) -> Floats:
        """Return the correlations of values of a feature, by default the samples', with these."""
        ours = self._bins[feature]
        return self._matrix(self._codings[feature])[np.ix_(ours if bins is None else bins, ours)]

    def _direction(self, weights: Floats) -> tuple[Floats, RandomInverse]:
        """Return a direction's values in the samples, and its coding."""
        values: Floats = self._positions @ weights
        return values, RandomInverse().fit(values, N_UNITS)

    def _correlations_of_each(self, inputs: Inputs) -> Iterator[Floats]:
        """Yield the correlations of each of the inputs."""
        yield from map(self._correlations, inputs.features)
        for weights in inputs.directions:
            values, coding = self._direction(weights)
            bins = coding.bins(values)
            yield self._matrix(coding)[np.ix_(bins, bins)]

    def _solve(self, inputs: Inputs) -> Candidate:
        """Fit kernel ridge regression with the inputs; return its errors without each sample."""
        shape = (len(self._table), len(self._table))
        total, squares = np.zeros(shape), np.zeros(shape)
        for correlations in self._correlations_of_each(inputs):
            total += correlations
            squares += np.square(correlations)
        n_inputs = len(inputs.features) + len(inputs.directions)
        kernel = kernel_of_sums(total, squares, n_inputs)
        solutions = {}
        for degree in self._degrees if self._degree is None else [self._degree]:
            problem = diagonal(apply_degree(kernel.copy(), degree), self._samples)
            solutions[degree] = solve(problem, self._samples, None)
        self._degree = min(solutions, key=lambda degree: solutions[degree].error)
        solution = solutions[self._degree]
        losses = self._losses(self._samples, solution.left_out) * self._penalty(inputs)
        return Candidate(inputs, solution, losses, total, kernel)

    def _penalty(self, inputs: Inputs) -> float:
        """Return the factor by which directions make the leave-one-out error too small.

        It is (n + p) / (n - p) for n samples and p fitted parameters (Akaike's final prediction
        error): the weights of each direction, of which the scale is free.
        """
        n_parameters = np.maximum(np.count_nonzero(inputs.directions, axis=1) - 1, 0).sum()
        if n_parameters >= self._n_samples:
            return math.inf
        return float((self._n_samples + n_parameters) / (self._n_samples - n_parameters))

    def _error(self, candidate: Candidate) -> float:
        return float(self._shares @ candidate.losses)

    def _is_better(self, candidate: Candidate, other: Candidate) -> bool:
        """Return whether a candidate's error is clearly smaller, by size and by significance.

        The second is a paired test: the mean gain of a sample in units of its standard error.
        """
        if self._error(candidate) > LARGEST_ERROR * self._error(other):
            return False
        gains = other.losses - candidate.losses
        mean = self._shares @ gains
        standard_error = np.sqrt(self._shares @ np.square(gains - mean) / self._n_samples)
        return bool(mean > LEAST_SIGNIFICANCE * standard_error)

    def _halvings(self, candidate: Candidate) -> list[Candidate]:
        """Return candidates with the more important half of features, half of these, and so on."""
        halvings = []
        while len(features := candidate.inputs.features) > 2:
            order = np.argsort(-self._importances(candidate), kind="stable")
            half = np.sort(features[order[: (len(features) + 1) // 2]])
            candidate = self._solve(dataclasses.replace(candidate.inputs, features=half))
            halvings.append(candidate)
        return halvings

    def _slopes(self, candidate: Candidate, correlations: Floats) -> Floats:
        """Return derivatives of the kernel of a few samples by the correlations of an input.

        Shapes are (n_few, n_samples). With n inputs, the sum S of their correlations and Q of their
        squares, the kernel is ((n - 1) S + S^2 - Q) / (2 n (n - 1)), as in `kernel_of_sums`. Its
        derivative by one correlation r is (n - 1 + 2 S - 2 r) / (2 n (n - 1)).
        """
        n = len(candidate.inputs.features) + len(candidate.inputs.directions)
        slopes: Floats = np.ones_like(correlations)
        if n > 1:
            slopes = (n - 1 + 2 * (candidate.total[self._few] - correlations)) / (2 * n * (n - 1))
        if self._degree == 2:  # times the derivative of the polynomial in `apply_degree`
            slopes *= 0.5 + candidate.kernel[self._few]
        elif self._degree == 3:
            slopes *= 3 * np.square(candidate.kernel[self._few])
        return slopes

    def _importances(self, candidate: Candidate) -> Floats:
        """Return mean squared changes of outputs where one of the features is averaged away."""
        importances = []
        for feature in candidate.inputs.features:
            bins, matrix = self._bins[feature], self._matrix(self._codings[feature])
            correlations = self._correlations(feature, bins[self._few])
            mean = np.bincount(bins, self._shares, len(matrix)) @ matrix
            slopes = self._slopes(candidate, correlations)
            changes = ((correlations - mean[bins]) * slopes) @ candidate.solution.dual
            squares = self._shares[self._few] @ np.square(changes)
            importances.append((squares / self._variances).sum())
        return np.array(importances)

    def _with_directions(self, candidate: Candidate) -> Candidate:
        """Add directions, then seek them again with the better solution, if errors get smaller."""
        for _ in range(MOST_ROUNDS):
            directions = self._steepest_directions(candidate)
            if not len(directions):
                break
            mixed = self._solve(dataclasses.replace(candidate.inputs, directions=directions))
            if not self._is_better(mixed, candidate):
                break
            candidate = mixed
        return candidate

    def _steepest_directions(self, candidate: Candidate) -> Floats:
        """Return the directions along which outputs change most, shape (n, n_features)."""
        features = [
            feature
            for feature in candidate.inputs.features
            if is_mixable(self._codings[feature]) and self._deviations[feature] > 0
        ]
        directions = np.zeros((min(N_DIRECTIONS, len(features)), len(self._codings)))
        if len(features) < 2:
            return directions[:0]
        gradients = np.stack([self._gradient(candidate, feature) for feature in features])
        gradients *= np.sqrt(self._shares[self._few])[:, None] / np.sqrt(self._variances)
        rows = gradients.reshape(len(features), -1)
        _, vectors = np.linalg.eigh(rows @ rows.T)
        steepest = vectors[:, ::-1][:, : len(directions)].T
        directions[:, features] = steepest / self._deviations[features]
        return directions

    def _gradient(self, candidate: Candidate, feature: int) -> Floats:
        """Return slopes of a few samples' outputs along a feature, by its standard deviation.

        Shape (n_samples, n_outputs). They are differences over a step, within the feature's range.
        """
        coding, bins = self._codings[feature], self._bins[feature][self._few]
        step = max(1, round(STEP * self._deviations[feature] * coding.size))  # in bins
        above, below = np.minimum(bins + step, coding.size - 1), np.maximum(bins - step, 0)
        change = self._correlations(feature, above) - self._correlations(feature, below)
        change *= self._slopes(candidate, self._correlations(feature, bins))
        for weights in candidate.inputs.directions:  # a feature moves the directions it is part of
            values, of_direction = self._direction(weights)
            of_samples, matrix = of_direction.bins(values), self._matrix(of_direction)
            shifts = [(moved - bins) / coding.size * weights[feature] for moved in (above, below)]
            present, up, down = (
                matrix[np.ix_(of_direction.bins(values[self._few] + shift), of_samples)]
                for shift in (0.0, *shifts)
            )
            change += (up - down) * self._slopes(candidate, present)
        steps = (above - below) / coding.size / self._deviations[feature]
        # Where the step is 0, the change is 0, too: the least divisor gives a slope of 0.
        slopes: Floats = change @ candidate.solution.dual / np.maximum(steps, 1e-9)[:, None]
        return slopes
