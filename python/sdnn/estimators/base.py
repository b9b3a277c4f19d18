"""The base class of the regressor and the classifier."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Callable, Sequence
from numbers import Real
from typing import Any, Self

import numpy as np
from joblib import effective_n_jobs
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_random_state
from sklearn.utils._param_validation import Interval

from sdnn import _core
from sdnn.coding import Coding
from sdnn.estimators.columns import Array, Floats, Ints, PairChoice, Pairs, Sample, input_pairs
from sdnn.estimators.fitted import Fitted
from sdnn.estimators.inputs import CodedInputs
from sdnn.estimators.network import (
    FEW_SAMPLES,
    Network,
    Rule,
    draw_input_code,
    require_memory,
    units_for_pairs,
)
from sdnn.estimators.network_settings import require_settings_of_network, settings_of
from sdnn.estimators.outliers import warn_caller
from sdnn.estimators.pair_selection import selected_pairs
from sdnn.estimators.parameters import SHARE, RandomState, parameter, wholes, words
from sdnn.estimators.training import (
    LARGE_SAMPLE,
    CodedSamples,
    History,
    Trainer,
    epochs_between_averages,
    held_out,
    most_epochs,
    run_epochs,
    sample_weights,
    samples_of_epoch,
    without_absent,
)


class OutOfRangeWarning(UserWarning):
    """Values to learn are outside the range; issued once per model."""


@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class BaseSDNN(Fitted, CodedInputs):
    """Base class of `SDNNRegressor` and `SDNNClassifier`, with the parameters of both.

    Parameters
    ----------
    coding : str, Coding, or list of (str or Coding, columns), default="random-inverse"
        How inputs become patterns: "random-inverse", "anchor", "circular", "symbolic", or an
        object of `sdnn.coding`; for all inputs, or for columns given as to scikit-learn's
        ColumnTransformer (other inputs have "random-inverse"). Columns of a data frame of type
        "category" are symbols, which may be missing, unless a list or an object codes them.
    ranges : {"auto", "all", "robust"}, default="auto"
        Whether learned ranges leave out outliers; "auto" those farthest away, with an
        `OutlierWarning`.
    n_pattern_units : int, optional
        Units per pattern, even. None divides about 16,000 columns among the pairs; from 5,001
        samples on with ``pairs="budget"`` 4,000, or more for 178 units per pattern.
    pairs : "budget", "all", "auto" or list of (modified, modifier), default="budget"
        Pairs of features, by number or name; a modifier of None leaves a pattern plain. "budget"
        takes all pairs up to 22 features, beyond that an even random share: 500 pairs, or one per
        feature. "auto" drops features that do not matter, half of them at a time, by the score of a
        held-out fifth, which takes up to five times as long. From 5,001 samples on "budget" does so
        too, with 5,000 of them and small networks.
    tables : {"shared", "separate"}, default="shared"
        One table of patterns per input, permuted for each pair, or two tables per pair.
    max_iter : int, optional
        Largest number of epochs of `fit`, which stops early once nothing is corrected. None: 30,
        but at most 80,000 samples in all, and at least 5. Exact targets need more, such as 300.
    n_averaged_epochs : int, default=4
        Number of networks whose mean is predicted: that after the last epoch of `fit`, and those
        after every third epoch before it (every epoch from 5,001 samples on). `partial_fit`
        resumes from the last alone.
    correction_share : float
        Share of the missing or superfluous units that a sample corrects, at least one; in (0, 1].
        Default: 1 in regression, of which `fit` takes half from 50,001 samples on; 1/4 in
        classification, where samples of classes overlap. Where inputs repeat, `fit` learns the mean
        target, and `partial_fit` follows the latest targets; there a share of 0.1 averages over
        more of them.
    shuffle : bool, default=True
        Whether each epoch has a new random order; from 5,001 samples without weights on, of blocks
        of 512 samples, which are drawn once: half of the time.
    early_stopping : bool, default=False
        Whether to hold out samples, stop when their score no longer improves, and keep the best
        weights.
    validation_fraction : float, default=0.1
        Fraction of the sample held out by early stopping.
    n_iter_no_change : int, default=10
        Epochs without improvement before early stopping.
    training : {"auto", "dual", "block", "plain"}, default="auto"
        Form of training; affects time and memory, never the result.
    memory_limit : int, default=2**30
        Bytes for weights and patterns of all networks kept, and again for training.
    warm_start : bool, default=False
        Whether `fit` resumes with the existing network, ranges and categories. Settings that these
        depend on must stay, as in `partial_fit` and `learn_one`.
    random_state : int, RandomState or None, default=None
        Determines patterns, initial weights, orders and the validation share.
    n_jobs : int, optional
        Threads; the result does not depend on it.
    verbose : int, default=0
        Whether to show a progress bar, with the time left.

    Attributes
    ----------
    codings_ : tuple of Coding
        The fitted coding of each input.
    pairs_ : tuple of (int, int)
        The pairs (modified, modifier) in use; equal numbers for a plain pattern.
    pair_names_ : list of (name, name or None)
        These pairs by feature names (numbers without names), as the parameter ``pairs`` has them.
    weights_ : ndarray of int32, shape (n_units, n_pairs * n_pattern_units)
    thresholds_ : ndarray of int32, shape (n_units,)
    n_inputs_out_of_range_ : int
        Values learned since the last `fit` that were outside their range.
    n_iter_ : int
        Epochs of the last `fit` and calls of `partial_fit` since.
    n_corrected_ : ndarray of int64, shape (n_epochs,)
        Samples corrected in each epoch of the last `fit`.
    training_form_, training_memory_ : str, int
        Form of training that the last `fit` chose, and its bytes beside the weights.
    n_features_in_, feature_names_in_ : int, ndarray of str
        As in scikit-learn.
    """

    n_pattern_units: int | None = parameter(None, wholes(2, 2**24), None)
    pairs: PairChoice = parameter("budget", words("budget", "all", "auto"), "array-like")
    tables: str = parameter("shared", words("shared", "separate"))
    out_of_range: str = parameter("clip", words("clip", "error"))
    max_iter: int | None = parameter(None, wholes(1, 10**9), None)
    n_averaged_epochs: int = parameter(4, wholes(1, 1000))
    correction_share: float = parameter(1.0, SHARE)
    shuffle: bool = parameter(True, "boolean")
    early_stopping: bool = parameter(False, "boolean")
    validation_fraction: float = parameter(0.1, Interval(Real, 0, 1, closed="neither"))
    n_iter_no_change: int = parameter(10, wholes(1, 10**9))
    training: str = parameter("auto", words(*_core.TRAINING_FORMS))
    memory_limit: int = parameter(2**30, wholes(0, 2**62))
    warm_start: bool = parameter(False, "boolean")
    random_state: RandomState = parameter(None, "random_state")
    n_jobs: int | None = parameter(None, wholes(-4096, 4096), None)
    verbose: int = parameter(0, "verbose")

    refit = False  # the regressor lets its users choose it
    _largest_full_sample = math.inf
    """Size from which on `fit` halves the share of corrections, to average more noise."""

    @abc.abstractmethod
    def _check_samples(
        self, X: object, y: object, codings: Sequence[Coding] | None, in_fit: bool = False
    ) -> tuple[Array, Array]:
        """Return samples and targets, checked as by `_validated`; `fit` needs two labels."""

    @abc.abstractmethod
    def _set_outputs(self, y: ArrayLike) -> int:
        """Set the range of outputs, or the classes, from targets; return the number of units."""

    @abc.abstractmethod
    def _check_outputs(self, y: Array, classes: ArrayLike | None) -> None:
        """Raise ValueError if the outputs are not those of the network."""

    @abc.abstractmethod
    def _targets(self, y: Array, at_once: bool = False) -> Array:
        """Return firing counts or class numbers for targets; may widen the output range.

        ``at_once``: by all targets before any is converted, instead of by one after the other.
        """

    @abc.abstractmethod
    def _rule_arguments(self, targets: Array) -> Rule:
        """Return (counts, share) of the p-delta rule, or (labels, n_classes, scheme)."""

    @abc.abstractmethod
    def _validation_score(self, bins: Ints, targets: Array, weights: Floats | None) -> float:
        """Return the network's score; larger is better."""

    def _targets_to_learn(self, bins: Ints, targets: Array, weights: Floats | None) -> Array:
        """Return the target that each sample learns: samples with the same code may share one."""
        return targets

    def _presentations(self, targets: Array, weights: Floats | None) -> Floats | None:
        """Return how often an epoch presents each sample on average; None: each sample once."""
        return weights

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        """Train the network: with a hold-out to stop early, then again on all samples to refit."""
        for name in ("refit", "calibrate"):
            if self.warm_start and getattr(self, name):
                raise ValueError(
                    f"{name}=True trains a second network: it cannot be with warm_start=True"
                )
        resumes = self.warm_start and hasattr(self, "network_")
        if resumes:
            require_settings_of_network(self)
        codings = self.codings_ if resumes else None
        table, observed = self._check_samples(X, y, codings, in_fit=True)
        weights = sample_weights(sample_weight, len(table))
        if resumes:
            random = self._resume(table, observed)
        else:
            takes_budget = isinstance(self.pairs, str) and self.pairs == "budget"
            is_large = takes_budget and len(table) > LARGE_SAMPLE
            pairs = selected_pairs(self, X, table, observed, weights, is_large)
            n_networks = self._n_networks(len(table))
            random = self._begin(X, table, observed, pairs, n_networks, is_large)
        targets = self._targets(observed, at_once=True)
        samples = CodedSamples(self.network_.input_code.bins(table), targets, weights)
        # Networks that learn a part of very many samples correct half the share as well.
        part_of_share = 0.5 if len(table) > self._largest_full_sample else 1.0
        share = self.validation_fraction if self.early_stopping else 0.0
        held_rows, learned_rows = held_out(share, random, len(table))
        held = samples.of(held_rows)

        def score() -> float:
            """Return the score of the present network on the samples that are held out."""
            return self._validation_score(*held)

        is_refitted = self.refit and self.early_stopping
        trainer, history = self._train(
            samples.of(learned_rows),
            most_epochs(self.max_iter, len(table)),
            1 if is_refitted else self.n_averaged_epochs,
            part_of_share,
            random,
            score if self.early_stopping else None,
        )
        self.n_iter_ = len(history.n_corrected)
        self.n_corrected_ = np.array(history.n_corrected, dtype=np.int64)
        self.validation_scores_ = np.array(history.scores)
        self.training_form_, self.training_memory_ = trainer.form, trainer.memory
        if is_refitted:  # on the whole sample, for the best number of epochs
            first = self.network_
            self.network_ = Network(first.input_code, first.n_units, seed=self._weight_seed)
            _, history = self._train(
                samples, history.n_epochs, self.n_averaged_epochs, part_of_share, random
            )
        self.network_ = history.network
        self._earlier = history.earlier

    def _train(
        self,
        samples: CodedSamples,
        max_iter: int,
        n_averaged: int,
        part_of_share: float,
        random: np.random.RandomState,
        score: Callable[[], float] | None = None,
    ) -> tuple[Trainer, History]:
        """Train the network for at most `max_iter` epochs; see `run_epochs` and `_trainer`."""
        times = self._presentations(samples.targets, samples.weights)
        n_samples = len(samples.bins)
        in_blocks = self.shuffle and times is None and n_samples > LARGE_SAMPLE
        if in_blocks:
            samples = samples.of(random.permutation(n_samples))
        # The trainer's block form reuses sums of blocks; it is chosen for few epochs only.
        n_epochs = min(max_iter, 2) if in_blocks else max_iter
        learned = self._targets_to_learn(*samples)
        trainer = self._trainer(samples.bins, learned, n_epochs, part_of_share)
        return trainer, run_epochs(
            self, trainer, n_samples, max_iter, random, score, times, n_averaged, in_blocks
        )

    def _validate_to_begin(self) -> None:
        """Raise ValueError for parameters with which samples cannot be learned one at a time."""
        self._validate_params()
        if self.calibrate:
            raise ValueError(f"calibrate works in fit only, got {self.calibrate}")

    def _partial_fit(
        self, X: ArrayLike, y: ArrayLike, classes: ArrayLike | None, sample_weight: ArrayLike | None
    ) -> Self:
        """Present samples in order, each once or as often as its weight says.

        A copy learns, and then replaces this model, so that an error changes nothing.
        """
        work = self._copy_to_train()
        first = not hasattr(self, "network_")
        if first:
            self._validate_to_begin()
        else:
            require_settings_of_network(self)
        X, y, sample_weight = without_absent(X, y, sample_weight)
        table, observed = work._check_samples(X, y, None if first else self.codings_)
        if first:
            work._begin(X, table, observed if classes is None else classes)
            work.n_iter_ = 0
        else:
            work._check_outputs(observed, classes)
            work._note_inputs(table)
        weights = sample_weights(sample_weight, len(table))
        if weights is not None:
            rows = samples_of_epoch(len(table), weights, epoch=0, n_before=work._n_weighted)
            work._n_weighted += len(table)
            table, observed = table[rows], observed[rows]
        if len(table):
            bins, targets = work.network_.input_code.bins(table), work._targets(observed)
            work._learn(bins, targets)
        self.__dict__ = work.__dict__
        return self

    def _learn_one(self, x: Sample, y: Array, classes: ArrayLike | None) -> Self:
        """Learn a sample; y has shape (1,) or (1, n_outputs)."""
        work = self._copy_to_train()
        if hasattr(self, "network_"):
            require_settings_of_network(self)
            work._check_outputs(y, classes)
            code = work.network_.input_code
            row = work._row(x, code)
            work._note_inputs(row[None])
            bins = code.bins(row[None])
        else:
            self._validate_to_begin()
            table = work._first_row(x)
            work._begin(x, table, y if classes is None else classes)
            work.n_iter_ = 0
            bins = work.network_.input_code.bins(table)
        work._learn(bins, work._targets(y))
        self.__dict__ = work.__dict__
        return self

    def _begin(
        self,
        X: object,
        table: Array,
        y: ArrayLike,
        pairs: Pairs | None = None,
        n_networks: int = 1,
        is_large: bool = False,
    ) -> np.random.RandomState:
        """Fit the codings, draw tables and weights; return the generator that shuffles samples.

        ``pairs`` are those that were selected, ``n_networks`` are to be kept. ``is_large`` takes
        fewer units per pattern.
        """
        n_units = self._set_outputs(y)
        codings = self._codings(X, table)
        random: np.random.RandomState = check_random_state(self.random_state)
        code_seed, weight_seed = (int(seed) for seed in random.randint(2**31 - 1, size=2))
        if pairs is None:
            pairs = input_pairs(self.pairs, self._feature_names(), table.shape[1], code_seed)
        n_pattern_units = self.n_pattern_units or units_for_pairs(len(pairs), is_large)
        if n_pattern_units % 2:
            raise ValueError(f"n_pattern_units must be even, got {n_pattern_units}")
        fitted = self._fit_codings(codings, table, n_pattern_units)
        require_memory(self.memory_limit, n_units, n_networks, n_pattern_units, fitted, pairs)
        code = draw_input_code(fitted, pairs, n_pattern_units, self.tables, code_seed)
        self.network_ = Network(code, n_units, seed=weight_seed)
        self._weight_seed = weight_seed
        self.n_inputs_out_of_range_ = self._n_weighted = 0
        self._earlier = ()
        self._begun_with = settings_of(self)
        self._note_inputs(table)
        return random

    def _resume(self, table: Array, y: Array) -> np.random.RandomState:
        """Prepare a copy of the network to train on; return the generator that shuffles samples."""
        self._check_outputs(y, None)
        network = self.network_
        n_networks, code = self._n_networks(len(table)), network.input_code
        if n_networks > 1:  # `_begin` has checked the memory of a single one
            limit, n_units = self.memory_limit, network.n_units
            require_memory(limit, n_units, n_networks, code.core.n_units, code.codings, code.pairs)
        self._note_inputs(table)
        self.network_ = network.copy()
        random: np.random.RandomState = check_random_state(self.random_state)
        return random

    def _n_networks(self, n_samples: int) -> int:
        """Return the most networks that `fit` keeps, averaged ones included."""
        n_kept = (most_epochs(self.max_iter, n_samples) - 1) // epochs_between_averages(n_samples)
        n_earlier = min(self.n_averaged_epochs - 1, n_kept)
        has_best = self.early_stopping and not self.refit
        return 1 + (2 if has_best else 1) * n_earlier  # early stopping keeps the best networks, too

    def _n_threads(self) -> int:
        return int(effective_n_jobs(self.n_jobs))

    def _trainer(
        self, bins: Ints, targets: Array, n_epochs: int, part_of_share: float = 1.0
    ) -> Trainer:
        """Make the compiled trainer of the learning rule: p-delta, or perceptrons."""
        rule = self._rule_arguments(targets)
        options: dict[str, Any] = {
            "form": self.training,
            "memory_limit": self.memory_limit,
            "n_threads": self._n_threads(),
            "n_epochs": n_epochs,
        }
        if len(rule) == 2:
            counts, share = rule
            share *= part_of_share
            return _core.PDeltaTrainer(self.network_.layer, bins, counts, share, **options)
        return _core.PerceptronTrainer(self.network_.layer, bins, *rule, **options)

    def _learn(self, bins: Ints, targets: Array) -> None:
        """Present every sample once, in order; an error changes nothing.

        A few samples are learned in place, so nothing that may raise can follow this call.
        """
        self.n_iter_ += 1
        self._earlier = ()
        if len(bins) <= FEW_SAMPLES and self.training == "auto":
            rule = self._rule_arguments(targets)
            try:
                if self.network_.learn_online(bins, rule, self.memory_limit):
                    return
            except OverflowError:
                pass  # the other forms of training have room for larger weights
        self.network_ = self.network_.copy()
        trainer = self._trainer(bins, targets, n_epochs=1)
        trainer.present(np.arange(len(bins), dtype=np.int32))
        trainer.synchronize()

    def _note_inputs(self, table: Array) -> None:
        """Count the values outside their input's range; warn of the first, or raise an error."""
        n_outside, first = self.network_.input_code.outside(table)
        if n_outside == 0:
            return
        if self.out_of_range == "error":
            raise ValueError(f"X has {first}, but out_of_range is 'error'")
        if self._warns and self.n_inputs_out_of_range_ == 0 and not self._has_outliers:
            warn_caller(f"X has {first}: values outside a range are clipped", OutOfRangeWarning)
        self.n_inputs_out_of_range_ += n_outside

    def _bins(self, X: object) -> Ints:
        """Check samples to predict and return their bins."""
        table = self._validated(X, codings=self.codings_)  # raises NotFittedError
        return self.network_.input_code.bins(table)

    def _bins_of_one(self, x: Sample) -> Ints:
        """Return the bins of a sample to predict, without the overhead of a table."""
        code = self._fitted_network.input_code
        return code.bins(self._row(x, code)[None])

    def transform_code(self, X: ArrayLike) -> NDArray[np.int8]:
        """Return the code of samples: +1, 0, -1, shape (n_samples, n_pairs * n_pattern_units)."""
        return self._fitted_network.input_code.core.transform(self._bins(X))
