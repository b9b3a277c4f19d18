"""The ridge problem, solved for every penalty by one eigendecomposition.

The penalty is chosen by closed-form leave-one-out. In features in which the penalized problem is
diagonal, with rows r and eigenvalues d, leaving a sample out divides its residual by 1 - h, where h
is the sum of r^2 / (d + alpha). So one eigendecomposition gives the error of every alpha.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np
from scipy.linalg import eigh

from sdnn.estimators.columns import Floats
from sdnn.estimators.training import Rows

ALPHAS = np.logspace(-6, 0, 19)  # penalties to try, relative to the sum of eigenvalues
NEGLIGIBLE = 1e-12  # share of the largest eigenvalue up to which others count as 0
ROWS_AT_ONCE = 4096
MOST_LEFT_OUT = 8192  # samples used for leave-one-out with low rank


@dataclasses.dataclass
class Samples:
    """Targets and weights of samples, and their counts for leave-one-out.

    A sample of count 2 stands for two samples, so that leaving one out leaves half of its weight.
    """

    targets: Floats  # shape (n_samples, n_outputs)
    weights: Floats
    shares: Floats  # 1 over the counts

    def __getitem__(self, rows: Rows) -> Samples:
        return Samples(self.targets[rows], self.weights[rows], self.shares[rows])

    @property
    def mean(self) -> Floats:
        """Weighted mean targets, shape (n_outputs,)."""
        mean: Floats = self.weights @ self.targets / self.weights.sum()
        return mean

    @property
    def variances(self) -> Floats:
        """Weighted variances of targets, 1 for constant ones, shape (n_outputs,)."""
        shares = self.weights / self.weights.sum()
        variances: Floats = shares @ np.square(self.targets - self.mean)
        return np.where(variances > 0, variances, 1.0)


@dataclasses.dataclass
class Diagonal:
    """The ridge problem in centered features whose normal equations are diagonal."""

    values: Floats  # eigenvalues, shape (n_features,)
    moments: Floats  # weighted sums of features times targets, shape (n_features, n_outputs)
    to_dual: Floats  # shape (n_components, n_features)
    kernel_mean: Floats  # weighted mean over the samples, shape (n_components,)
    features: Floats  # features of samples to leave out, times the roots of weights
    rows: Rows  # the numbers of these samples


@dataclasses.dataclass(eq=False)
class Solution:
    """A solution of the ridge problem: outputs are ``kernel @ dual + intercept``."""

    alpha: float
    error: float  # mean square by leave-one-out, in variances of the targets
    dual: Floats  # shape (n_components, n_outputs)
    intercept: Floats  # shape (n_outputs,)
    left_out: Floats  # outputs of samples by models without them
    rows: Rows  # the numbers of these samples


def apply_degree(kernel: Floats, degree: int) -> Floats:
    """Turn a kernel, in place, into the kernel of functions of up to ``2 * degree`` inputs."""
    if degree == 2:
        kernel *= 0.5 + 0.5 * kernel
    elif degree == 3:
        kernel *= kernel * kernel
    return kernel


def row_blocks(n_samples: int) -> Iterator[Rows]:
    """Yield the numbers of samples, `ROWS_AT_ONCE` at a time."""
    for begin in range(0, n_samples, ROWS_AT_ONCE):
        yield np.arange(begin, min(begin + ROWS_AT_ONCE, n_samples))


def eigenvectors(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the eigenvalues that are not negligible and their vectors; overwrite the matrix."""
    values, vectors = eigh(matrix, overwrite_a=True, check_finite=False, driver="evd")
    kept = values > NEGLIGIBLE * values[-1]
    return values[kept], vectors[:, kept]


def diagonal(kernel: Floats, samples: Samples) -> Diagonal:
    """Diagonalize the exact problem, in which every sample is a component; overwrites `kernel`."""
    weights, roots = samples.weights, np.sqrt(samples.weights)[:, None]
    mean = weights @ kernel / weights.sum()
    kernel -= mean
    kernel -= (mean - mean @ weights / weights.sum())[:, None]
    kernel *= roots
    kernel *= roots.T
    values, vectors = eigenvectors(kernel)
    scales = np.sqrt(values)
    moments = scales[:, None] * (vectors.T @ (roots * (samples.targets - samples.mean)))
    rows = np.arange(len(weights))
    return Diagonal(values, moments, roots * (vectors / scales), mean, vectors * scales, rows)


def low_rank_diagonal(
    kernel_of: Callable[[Rows], Floats], components: Rows, samples: Samples
) -> Diagonal:
    """Diagonalize the low-rank problem in Nystroem's features, a block of samples at a time.

    ``kernel_of`` returns the kernel of samples, given by number, and components.
    """
    values, vectors = eigenvectors(kernel_of(components))
    to_features = vectors / np.sqrt(values)
    n_samples, total = len(samples.weights), samples.weights.sum()
    gram, sums = np.zeros((len(values), len(values))), np.zeros(len(values))
    kernel_sums = np.zeros(len(components))
    moments = np.zeros((len(values), samples.targets.shape[1]))
    for rows in row_blocks(n_samples):  # sums over samples, whose features are not all stored
        kernel, weights = kernel_of(rows), samples.weights[rows]
        features = kernel @ to_features
        kernel_sums += weights @ kernel
        sums += weights @ features
        features *= np.sqrt(weights)[:, None]
        gram += features.T @ features
        centered = samples.targets[rows] - samples.mean
        # Features need no centering here: the weighted sum of the centered targets is 0.
        moments += features.T @ (np.sqrt(weights)[:, None] * centered)
    gram -= np.outer(sums, sums) / total
    values, rotation = eigenvectors(gram)
    to_dual = to_features @ rotation
    # Features of evenly spaced samples suffice for the leave-one-out error.
    rows = np.unique(np.linspace(0, n_samples - 1, MOST_LEFT_OUT).astype(np.int64))
    features = np.concatenate([kernel_of(rows[part]) @ to_dual for part in row_blocks(len(rows))])
    features -= sums @ rotation / total
    features *= np.sqrt(samples.weights[rows])[:, None]
    return Diagonal(values, rotation.T @ moments, to_dual, kernel_sums / total, features, rows)


def solve(problem: Diagonal, samples: Samples, alpha: float | None) -> Solution:
    """Solve the problem for an alpha, by default the one with the least leave-one-out error."""
    judged = samples[problem.rows]  # those whose leave-one-out errors decide
    total, roots = samples.weights.sum(), np.sqrt(judged.weights)[:, None]
    targets = roots * (judged.targets - samples.mean)
    variances = np.square(targets).sum(axis=0) / judged.weights.sum()
    variances[variances == 0] = 1.0
    squares = np.square(problem.features)
    best = np.inf, 0.0, problem.moments, targets
    for penalty in problem.values.sum() * ALPHAS if alpha is None else [alpha]:
        shrinkage = 1 / (problem.values + penalty)
        coefficients = shrinkage[:, None] * problem.moments
        leverages = squares @ shrinkage + judged.weights / total
        # A residual over 1 - leverage is the residual of a fit without the sample.
        divisors = np.maximum(1 - judged.shares * leverages, NEGLIGIBLE)
        residuals = (targets - problem.features @ coefficients) / divisors[:, None]
        error = float((np.square(residuals).sum(axis=0) / variances).mean() / judged.weights.sum())
        if error < best[0]:
            best = error, float(penalty), coefficients, residuals
    error, penalty, coefficients, residuals = best
    dual = problem.to_dual @ coefficients
    intercept = samples.mean - problem.kernel_mean @ dual
    left_out = judged.targets - residuals / np.where(roots > 0, roots, 1)
    return Solution(penalty, error, dual, intercept, left_out, problem.rows)


def solve_for(problem: Diagonal, samples: Samples, targets: Floats) -> Solution:
    """Solve the exact problem of other targets of its samples."""
    changed = dataclasses.replace(samples, targets=targets)
    centered = np.sqrt(samples.weights)[:, None] * (targets - changed.mean)
    moments = problem.features.T @ centered
    return solve(dataclasses.replace(problem, moments=moments), changed, None)
