"""The loop over epochs: order of samples, early stopping, progress."""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import _safe_indexing
from sklearn.utils.class_weight import compute_sample_weight
from sklearn.utils.validation import _num_samples

from sdnn import _core
from sdnn.estimators.columns import Array, Floats, Ints
from sdnn.estimators.fitted import Fitted
from sdnn.estimators.network import Network
from sdnn.support.arguments import require
from sdnn.support.progress import ProgressBars

LARGE_SAMPLE = 5000
"""Size from which on every epoch's network is averaged, and blocks of samples are shuffled."""
BLOCK = 512  # samples; the trainer reuses the sums of a block in later epochs
HELD_OUT_EVERY = 5  # every fifth sample is held out
FEWEST_SAMPLES = 10
LARGEST_WEIGHT = 10**6
MOST_PRESENTED = 2**28  # samples in an epoch: their indices take a GiB

ClassWeight = str | Mapping[Any, float] | None
Trainer = _core.PDeltaTrainer | _core.PerceptronTrainer
Rows = NDArray[np.int64]
MOST_EPOCHS, FEWEST_EPOCHS = 30, 5  # bounds of the default number of epochs
MOST_PRESENTATIONS = 80_000  # samples presented in all epochs by default
GOLDEN_RATIO = 0.6180339887498949
"""Multiples of it, without their whole parts, spread evenly over [0, 1)."""


class CodedSamples(NamedTuple):
    """Samples as a network learns them."""

    bins: Ints  # shape (n_samples, n_inputs)
    targets: Array  # firing counts, shape (n_samples, n_outputs), or the numbers of classes
    weights: Floats | None

    def of(self, rows: Rows) -> CodedSamples:
        """Return some of the samples, by their numbers."""
        weights = None if self.weights is None else self.weights[rows]
        return CodedSamples(self.bins[rows], self.targets[rows], weights)


@dataclasses.dataclass
class History:
    """The result of the epochs; ``network`` is the last one, or the best by validation."""

    network: Network
    n_corrected: list[int] = dataclasses.field(default_factory=list)
    scores: list[float] = dataclasses.field(default_factory=list)  # with early stopping
    n_epochs: int = 0  # with early stopping, up to the best
    earlier: tuple[Network, ...] = ()  # the networks to be averaged before the last one


@contextmanager
def progress_bar(verbose: int, n_epochs: int) -> Iterator[Callable[[int, int], None]]:
    """Show a bar on standard output if `verbose`.

    Yield a function to call after each epoch, with the number of epochs and of corrected samples.
    """
    if not verbose:
        yield lambda epochs, n_corrected: None
        return
    from rich.console import Console

    with ProgressBars(Console(), remain=True) as bars:
        bars.add("epochs", "training", n_epochs)
        yield lambda epochs, n_corrected: bars.update(
            "epochs", epochs, news=f"{epochs}/{n_epochs}, {n_corrected} corrected"
        )


def sample_weights(
    weights: ArrayLike | None, n_samples: int, *, name: str = "sample_weight"
) -> Floats | None:
    """Return checked weights of samples, shape (n_samples,), or None.

    They must be in [0, `LARGEST_WEIGHT`], not all 0, with a sum of at most `MOST_PRESENTED`.
    """
    if weights is None:
        return None
    try:
        numbers = np.array(weights, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)  # refused below, as no number in the range
    numbers = np.full(n_samples, numbers) if numbers.ndim == 0 else numbers
    fits = numbers.shape == (n_samples,) and np.all((numbers >= 0) & (numbers <= LARGEST_WEIGHT))
    expected = f"be a number in [0, {LARGEST_WEIGHT}] for each of {n_samples} samples"
    require(fits, name, expected, weights)
    if not numbers.any():
        raise ValueError(f"{name} must be above zero for some sample, got zero for all")
    if numbers.sum() > MOST_PRESENTED:
        raise ValueError(f"{name} must sum to at most {MOST_PRESENTED}, got {numbers.sum():.4g}")
    return numbers


def held_out_fifth(labels: Array, is_stratified: bool, seed: int) -> NDArray[np.bool_]:
    """Return which samples are held out: a random fifth, or that of each class (stratified).

    >>> held_out_fifth(np.arange(10), False, 0).sum()
    np.int64(2)
    """
    order = np.random.RandomState(seed).permutation(len(labels))
    if is_stratified:
        order = order[np.argsort(labels[order], kind="stable")]
    # From the middle of the first five on: of n samples, n / 5 rounded are held out.
    is_held = np.zeros(len(labels), dtype=bool)
    is_held[order[HELD_OUT_EVERY // 2 :: HELD_OUT_EVERY]] = True
    return is_held


def without_absent(
    X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None
) -> tuple[ArrayLike, ArrayLike, ArrayLike | None]:
    """Return samples, targets and weights without the samples of weight 0."""
    try:
        n_samples = _num_samples(X)
        fits = _num_samples(y) == n_samples
    except TypeError:  # validation raises a clearer error later
        fits = False
    if sample_weight is None or not fits:
        return X, y, sample_weight
    weights = sample_weights(sample_weight, n_samples)
    if weights is None or weights.all():
        return X, y, weights
    rows = np.flatnonzero(weights)
    return samples_in(X, rows), samples_in(y, rows), weights[rows]


def samples_in(X: ArrayLike, rows: Rows) -> ArrayLike:
    """Return some samples of a frame, a list, an array or anything that becomes one."""
    samples: ArrayLike = _safe_indexing(X if hasattr(X, "__getitem__") else np.asarray(X), rows)
    return samples


def class_weights(class_weight: ClassWeight, labels: Array) -> Floats | None:
    """Return the weight of each sample by its class, or None without class weights."""
    if class_weight is None:
        return None
    each: Floats = compute_sample_weight(class_weight, labels)
    are_weights = np.all((each >= 0) & (each <= LARGEST_WEIGHT))
    require(are_weights, "class_weight", f"be numbers in [0, {LARGEST_WEIGHT}]", class_weight)
    return sample_weights(each, len(labels), name="class_weight")


def without_classes(class_weight: ClassWeight, absent: Sequence[object]) -> ClassWeight:
    """Return class weights without those of absent classes, which scikit-learn may refuse.

    >>> without_classes({"rare": 9.0, "frequent": 1.0}, absent=["rare"])
    {'frequent': 1.0}
    """
    if not isinstance(class_weight, Mapping):
        return class_weight
    return {label: weight for label, weight in class_weight.items() if label not in absent}


def weighted_mean(values: Array, weights: Floats | None) -> float:
    """Return the weighted mean, or the plain mean without weights or if all of them are 0."""
    if weights is None or not weights.any():
        return float(np.mean(values))
    return float(np.average(values, axis=0, weights=weights).mean())


def samples_of_epoch(n_samples: int, weights: Floats | None, epoch: int, n_before: int = 0) -> Ints:
    """Return which samples an epoch presents: weight 2 twice, weight 1/2 in every other epoch.

    In a single epoch every other sample of weight 1/2 is presented. ``n_before`` is the number of
    samples of earlier calls.

    >>> [samples_of_epoch(3, np.array([2.0, 0.5, 0.0]), epoch).tolist() for epoch in range(3)]
    [[0, 0, 1], [0, 0], [0, 0, 1]]
    """
    in_order = np.arange(n_samples, dtype=np.int32)
    if weights is None:
        return in_order
    # A sample was due weight * epoch times before the epoch: it is presented once for each whole
    # number in between. Phases let samples of equal weight take turns.
    phases = (n_before + in_order) * GOLDEN_RATIO % 1
    times = np.floor(weights * (epoch + 1) + phases) - np.floor(weights * epoch + phases)
    return np.repeat(in_order, times.astype(np.int64))


def scaled_up(weights: Floats | None) -> Floats | None:
    """Scale weights to a mean of 1 if all are below 1, so that epochs present enough samples.

    >>> scaled_up(np.array([0.25, 0.75])).tolist()
    [0.5, 1.5]
    """
    if weights is None or not 0 < weights.max() < 1:
        return weights
    scaled: Floats = weights / weights.mean()
    return scaled


def epochs_to_present_all(weights: Floats | None) -> int:
    """Return the number of epochs after which every sample with a weight was presented once."""
    if weights is None:
        return 1
    smallest = float(np.min(weights, where=weights > 0, initial=1.0))
    return int(min(np.ceil(1 / smallest), 2**62))  # 2**62: 1 / smallest may be infinite


def most_epochs(max_iter: int | None, n_samples: int) -> int:
    """Return ``max_iter``, or by default the number of epochs for a sample of this size."""
    if max_iter is not None:
        return max_iter
    return min(MOST_EPOCHS, max(FEWEST_EPOCHS, MOST_PRESENTATIONS // n_samples))


class TooFewSamplesError(ValueError):
    """An error for samples of which none can be held out."""


def held_out(share: float, random: np.random.RandomState, n_samples: int) -> tuple[Rows, Rows]:
    """Draw a share of the samples to hold out; return its rows and the other rows.

    TooFewSamplesError if either would be empty.
    """
    if share == 0.0:
        return np.empty(0, dtype=np.int64), np.arange(n_samples)
    n_held = max(1, round(share * n_samples))
    if n_held >= n_samples:
        raise TooFewSamplesError(f"n_samples={n_samples} is too few for early stopping")
    order = random.permutation(n_samples)
    return np.sort(order[:n_held]), np.sort(order[n_held:])


def epochs_between_averages(n_samples: int) -> int:
    """Return the number of epochs between averaged networks; consecutive ones are too similar."""
    return 1 if n_samples > LARGE_SAMPLE else 3


def shuffled(order: Ints, random: np.random.RandomState, in_blocks: bool) -> Ints:
    """Return samples in random order, or blocks of them.

    >>> shuffled(np.arange(1026), np.random.RandomState(0), True)[[0, 1, 2, 3, 514]].tolist()
    [1024, 1025, 512, 513, 0]
    """
    if not in_blocks:
        return random.permutation(order)
    blocks = np.split(order, np.arange(BLOCK, len(order), BLOCK))
    return np.concatenate([blocks[index] for index in random.permutation(len(blocks))])


def run_epochs(
    model: Fitted,
    trainer: Trainer,
    n_samples: int,
    max_iter: int,
    random: np.random.RandomState,
    score: Callable[[], float] | None,
    weights: Floats | None,
    n_averaged_epochs: int,
    in_blocks: bool,
) -> History:
    """Train until nothing is corrected, nothing improves, or ``max_iter`` epochs are over.

    ``random`` draws the order of every epoch, ``score`` returns the validation score (larger is
    better), ``weights`` are mean presentations per epoch. ``n_averaged_epochs`` networks are kept,
    the last one and those of every third epoch before it, counted from the first, or of every one.
    ``in_blocks`` shuffles blocks of samples instead of samples.
    """
    network = model.network_
    history = History(network)
    weights = scaled_up(weights)
    # Training ends after so many epochs without a correction that each sample was presented.
    n_uncorrected, most_uncorrected = 0, epochs_to_present_all(weights)
    earlier: deque[Network] = deque(maxlen=n_averaged_epochs - 1)
    with progress_bar(model.verbose, max_iter) as show:
        for epoch in range(max_iter):
            order = samples_of_epoch(n_samples, weights, epoch)
            if model.shuffle:
                order = shuffled(order, random, in_blocks)
            n_corrected, _ = trainer.present(order)
            history.n_corrected.append(n_corrected)
            show(epoch + 1, n_corrected)
            if score is not None:
                trainer.synchronize()
                history.scores.append(score())
                is_best = epoch == 0 or history.scores[-1] > history.scores[history.n_epochs - 1]
                if is_best:
                    history.network, history.earlier = network.copy(), tuple(earlier)
                    history.n_epochs = epoch + 1
                elif epoch + 1 - history.n_epochs >= model.n_iter_no_change:
                    break
            n_uncorrected = n_uncorrected + 1 if n_corrected == 0 else 0
            if n_uncorrected == most_uncorrected:
                break
            is_kept = (epoch + 1) % epochs_between_averages(n_samples) == 0 and epoch + 1 < max_iter
            if n_averaged_epochs > 1 and is_kept:
                trainer.synchronize()
                earlier.append(network.copy())
    trainer.synchronize()
    if score is None:
        history.earlier = tuple(earlier)
    return history
