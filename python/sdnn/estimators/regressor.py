"""SDNNRegressor: selective desensitization and a parallel perceptron with the p-delta rule."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import RegressorMixin

from sdnn import _core
from sdnn.arguments import flag, whole
from sdnn.estimators.base import MOST_EPOCHS, BaseSDNN
from sdnn.estimators.columns import kept_pairs
from sdnn.estimators.network import Network
from sdnn.estimators.training import Trainer, run_epochs, sample_weights, weighted_mean

__all__ = ["SDNNRegressor"]

MARGIN = 0.2
"""Fraction of the targets' range that a learned output range adds on either side."""

FURTHEST = 1e300
"""The largest end of an output range: what lies between two ends stays finite."""

Self = TypeVar("Self", bound="SDNNRegressor")


class SDNNRegressor(RegressorMixin, BaseSDNN):
    """Regression by a selective desensitization neural network, exact and online.

    Each input becomes a binary pattern, the patterns of each two inputs are combined by selective
    desensitization, and the number of units that fire over this code, all of them with integer
    weights, is the output. The p-delta rule corrects just the units nearest to their threshold.
    Sources: Nonaka, Tanaka and Morita 2011 (the network); Auer, Burgsteiner and Maass 2008 (the
    rule).

    Parameters
    ----------
    coding : str, Coding, or list of (str or Coding, columns), default="random-inverse"
        How inputs become patterns: "random-inverse", "anchor", "circular", "symbolic", or an
        object of `sdnn.coding`; for all inputs, or for columns given as to scikit-learn's
        ColumnTransformer (inputs left out have "random-inverse").
    n_pattern_units : int, optional
        Units per pattern, even. None shares about 16,000 columns out among the pairs.
    pairs : "budget", "all", "auto" or iterable of (modified, modifier), default="budget"
        Pairs of features, by number or name. A modifier of None leaves a pattern plain, which is
        also what a single feature gets. "budget" means all pairs up to 22 features, and beyond an
        even share of them drawn at random: 500 pairs, or one per feature. "auto" lets `fit` leave
        out those that do not matter, as far as cross-validation is clearly better without them;
        it takes some forty times as long.
    tables : {"shared", "separate"}, default="shared"
        One table of patterns per input, permuted anew for each pair, or two tables per pair.
    n_output_units : int, default=280
        Units per output; the output's resolution is the output range divided by it.
    output_range : (float, float) or array_like of shape (n_outputs, 2), optional
        Smallest and largest output. None takes the range of the first sample's targets and a
        fifth of it more on either side.
    out_of_range : {"clip", "widen", "error"}, default="clip"
        Targets to learn beyond the output range count as its ends, widen it (which stretches
        what was learned until it is learned anew), or are errors. Inputs beyond their range
        count as its ends, unless they are errors. An `OutOfRangeWarning` says so once.
    max_iter : int, default=30
        Largest number of epochs of `fit`, which ends earlier once nothing is corrected. Targets
        with much noise want fewer, say 5; exact ones more, say 300.
    shuffle : bool, default=True
        Whether each epoch has a new random order; otherwise it is the order of the sample.
    n_averaged_epochs : int, default=1
        Predict the mean of the answers after this many last epochs of `fit`; each is a network in
        memory. On noisy targets 10 are much better than one. `partial_fit` goes on from the last
        alone.
    early_stopping : bool, default=False
        Whether to hold a fraction of the sample out, stop when its error no longer falls, and keep
        the best weights.
    refit : bool, default=False
        Whether to train anew on the whole sample after early stopping, for the best number of
        epochs; without early stopping nothing is.
    validation_fraction : float, default=0.1
        The fraction that early stopping holds out.
    n_iter_no_change : int, default=10
        Epochs without improvement before early stopping.
    training : {"auto", "dual", "block", "plain"}, default="auto"
        Form of training; the result is the same to the last bit, time and memory differ.
    memory_limit : int, default=2**30
        Bytes that weights and patterns may use, and that training may use beside them. The
        networks that are averaged count, and with early stopping those of the best epochs too.
    warm_start : bool, default=False
        Whether `fit` goes on with the network that is there, its ranges, categories and sizes as
        they were, instead of drawing a new one.
    random_state : int, RandomState or None, default=None
        Decides patterns, first weights, orders and the validation share.
    n_jobs : int, optional
        Threads; the result does not depend on it.
    verbose : int, default=0
        Whether to show a progress bar.

    Attributes
    ----------
    codings_ : tuple of Coding
        The fitted coding of each input.
    pairs_ : tuple of (int, int)
        The pairs in use.
    pair_importances_ : ndarray, shape (n_pairs,)
        How much training has changed the weights of each pair; they sum to 1.
    weights_ : ndarray of int32, shape (n_outputs * n_output_units, n_columns)
    thresholds_ : ndarray of int32, shape (n_outputs * n_output_units,)
    output_range_ : ndarray, shape (n_outputs, 2)
    n_inputs_out_of_range_, n_outputs_out_of_range_ : int
        Values learned since the last `fit` that lay beyond their range.
    n_outputs_ : int
    n_iter_ : int
        Epochs of the last `fit` and calls of `partial_fit` since.
    n_corrected_ : ndarray of int64, shape (n_epochs,)
        Samples corrected in each epoch of the last `fit`.
    validation_scores_ : ndarray, shape (n_epochs,) or (0,)
        With early stopping, minus the mean squared error in units of the firing count.
    training_form_, training_memory_ : str, int
        The form of training that the last `fit` chose, and the most bytes it takes beside the
        weights.
    n_features_in_, feature_names_in_ : int, ndarray of str
        As everywhere in scikit-learn.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn import SDNNRegressor
    >>> X = np.random.RandomState(0).uniform(size=(400, 2))
    >>> y = np.sin(6 * X[:, 0]) * X[:, 1]
    >>> model = SDNNRegressor(n_pattern_units=400, max_iter=100, random_state=0).fit(X, y)
    >>> bool(model.score(X, y) > 0.99)
    True
    >>> model.predict(X[:3]).shape
    (3,)
    """

    OUT_OF_RANGE = ("clip", "widen", "error")

    _earlier: tuple[Network, ...]

    def __init__(
        self,
        coding: Any = "random-inverse",
        *,
        n_pattern_units: int | None = None,
        pairs: Any = "budget",
        tables: str = "shared",
        n_output_units: int = 280,
        output_range: Any = None,
        out_of_range: str = "clip",
        max_iter: int = 30,
        shuffle: bool = True,
        n_averaged_epochs: int = 1,
        early_stopping: bool = False,
        refit: bool = False,
        validation_fraction: float = 0.1,
        n_iter_no_change: int = 10,
        training: str = "auto",
        memory_limit: int = 2**30,
        warm_start: bool = False,
        random_state: Any = None,
        n_jobs: int | None = None,
        verbose: int = 0,
    ) -> None:
        self.coding = coding
        self.n_pattern_units = n_pattern_units
        self.pairs = kept_pairs(pairs)
        self.tables = tables
        self.n_output_units = n_output_units
        self.output_range = output_range
        self.out_of_range = out_of_range
        self.max_iter = max_iter
        self.shuffle = shuffle
        self.n_averaged_epochs = n_averaged_epochs
        self.early_stopping = early_stopping
        self.refit = refit
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.training = training
        self.memory_limit = memory_limit
        self.warm_start = warm_start
        self.random_state = random_state
        self.n_jobs = n_jobs
        self.verbose = verbose

    def __sklearn_tags__(self) -> Any:
        """Say that several outputs can be learned at once."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def fit(self: Self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> Self:
        """Learn ranges, draw the network and train it.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)
        y : array_like, shape (n_samples,) or (n_samples, n_outputs)
        sample_weight : array_like, shape (n_samples,), optional
            How often each sample is presented per epoch, on average; 1 by default. What early
            stopping holds out and "auto" compares is weighted too. Ranges and categories are
            learned from all samples.

        Returns
        -------
        SDNNRegressor
            Itself.

        Raises
        ------
        ValueError
            For an impossible parameter, data that cannot be used, or a form of training that needs
            more than ``memory_limit``.
        OverflowError
            Before a weight could leave its range.
        MemoryError
            If there is no room for the weights.
        """
        work = self._scratch()
        work._fit(X, y, sample_weight)
        self.__dict__ = work.__dict__
        return self

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        flag("refit", self.refit)
        whole("n_averaged_epochs", self.n_averaged_epochs, 1, 1000)
        if flag("warm_start", self.warm_start) and self.refit:
            raise ValueError("refit=True trains a new network: it cannot be with warm_start=True")
        table, targets = self._checked(X, y, reset=not self._goes_on())
        weights = sample_weights(sample_weight, len(table))
        if self._goes_on():
            self._check_outputs(targets.shape[1])
            random = self._go_on(table, self._n_networks())
        else:
            self._select_pairs(X, table, y, weights)
            random = self._begin(X, table, targets, self._n_networks())
            self.__dict__.pop("_selected", None)
        counts_to_learn = self._counts_to_learn(targets, at_once=True)
        bins = self.network_.input_code.bins(table)
        held, kept = self._split(random, len(table))
        trainer = self._trainer(self.network_, bins[kept], counts_to_learn[kept], self.max_iter)
        held_bins = bins[held]
        held_counts = self._in_counts(targets[held])
        held_weights = None if weights is None else weights[held]

        def score() -> float:
            counts = self.network_.layer.counts(
                held_bins, n_groups=self.n_outputs_, n_threads=self._n_threads()
            )
            return -weighted_mean((held_counts - counts) ** 2, held_weights)

        is_first = self.refit and self.early_stopping
        history = self._run(
            trainer,
            len(kept),
            random,
            score,
            None if weights is None else weights[kept],
            n_averaged_epochs=1 if is_first else self.n_averaged_epochs,
        )
        self._earlier = history.earlier
        if is_first:
            self._refit(bins, counts_to_learn, weights, random, history.n_epochs)

    def _n_networks(self) -> int:
        """Return the most networks that `fit` has in memory, those that are averaged among them."""
        n_epochs = whole("max_iter", self.max_iter, 1, MOST_EPOCHS)
        n_earlier = min(self.n_averaged_epochs, n_epochs) - 1
        has_best = flag("early_stopping", self.early_stopping) and not self.refit
        return 1 + (2 if has_best else 1) * n_earlier  # the best ones beside the last ones

    def _refit(
        self,
        bins: NDArray[np.int32],
        counts: NDArray[np.float64],
        weights: NDArray[np.float64] | None,
        random: np.random.RandomState,
        n_epochs: int,
    ) -> None:
        """Train anew on the whole sample, for as many epochs as were best on a part of it."""
        network = self.network_
        self.network_ = Network(network.input_code, network.n_units, seed=self._weight_seed)
        trainer = self._trainer(self.network_, bins, counts, n_epochs)
        history = run_epochs(
            self.network_,
            trainer,
            len(bins),
            max_iter=n_epochs,
            random=random if self.shuffle else None,
            weights=weights,
            n_averaged_epochs=self.n_averaged_epochs,
            verbose=self.verbose,
        )
        self._earlier = history.earlier

    def partial_fit(self: Self, X: ArrayLike, y: ArrayLike) -> Self:
        """Go once through the samples, in their order.

        Samples given one at a time, in any portions, or all at once give the same weights, which
        are also those of `fit` with ``max_iter=1, shuffle=False``, provided that ranges and
        categories are given. What is not given is learned from the samples of the first call. With
        ``out_of_range="widen"`` `fit` differs if a target is beyond the range: there all of them
        widen it first, here each as it comes.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)
        y : array_like, shape (n_samples,) or (n_samples, n_outputs)

        Returns
        -------
        SDNNRegressor
            Itself.

        Raises
        ------
        ValueError, OverflowError, MemoryError
            As of `fit`; ValueError too for another number of outputs.
        """
        work = self._scratch()
        first = not hasattr(self, "network_")
        table, targets = work._checked(X, y, reset=first)
        if first:
            work._begin(X, table, targets)
            work.n_iter_ = 0
        else:
            work._check_outputs(targets.shape[1])
            work._finite(table, work.codings_)
            work._note_inputs(table)
        counts = work._counts_to_learn(targets)
        work.n_iter_ += 1
        work._earlier = ()
        work._learn_once(work.network_.input_code.bins(table), counts)
        self.__dict__ = work.__dict__
        return self

    def learn_one(self: Self, x: Any, y: Any) -> Self:
        """Learn one sample: `partial_fit` of one row, to the same bits, without its overhead.

        Parameters
        ----------
        x : array_like of shape (n_features,), or mapping from feature names to values
            The names of a mapping that comes first of all are those of the features. Later ones
            may lack features whose coding is `WithMissing`: their values are missing.
        y : float or array_like of shape (n_outputs,)

        Returns
        -------
        SDNNRegressor
            Itself.

        Raises
        ------
        ValueError, OverflowError, MemoryError
            As of `partial_fit`; nothing is changed then.

        Examples
        --------
        >>> from sdnn.coding import RandomInverse
        >>> unit = RandomInverse(low=0.0, high=1.0)
        >>> model = SDNNRegressor(unit, output_range=(0, 1), n_pattern_units=64, random_state=0)
        >>> for _ in range(20):
        ...     model = model.learn_one({"a": 0.2, "b": 0.9}, 0.75)
        >>> model.predict_one({"a": 0.2, "b": 0.9})
        0.75
        """
        try:
            targets = np.array(y, dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(f"y must be a number or one per output, got {y!r}") from None
        if targets.ndim > 1 or not np.isfinite(targets).all():
            raise ValueError(f"y must be a finite number or one per output, got {y!r}")
        work = self._scratch()
        if not hasattr(self, "network_"):
            table = work._table_of_one(x)
            work._flat = targets.ndim == 0
            work._begin(x, table, targets.reshape(1, -1))
            work.n_iter_ = 0
            bins = work.network_.input_code.bins(table)
        else:
            row = self._row(x)
            work._check_outputs(targets.size)
            work._note_inputs(row[None])
            bins = work.network_.input_code.bins_of_row(row)
        counts = work._counts_to_learn(targets.reshape(1, -1))
        work.n_iter_ += 1
        work._earlier = ()
        work._learn_once(bins, counts)
        self.__dict__ = work.__dict__
        return self

    def predict_one(self, x: Any) -> Any:
        """Predict the outputs of one sample: `predict` of one row, without its overhead.

        Parameters
        ----------
        x : array_like of shape (n_features,), or mapping from feature names to values
            As of `learn_one`.

        Returns
        -------
        float, or ndarray of shape (n_outputs,) where targets had several

        Raises
        ------
        NotFittedError, ValueError
            As of `predict`.
        """
        network = self._fitted_network
        network.online(self.memory_limit)
        bins = network.input_code.bins_of_row(self._row(x))
        counts = [
            each.counts_of_bins(bins, self.n_outputs_, n_threads=1)
            for each in (*self._earlier, network)
        ]
        values = self._of_counts(np.mean(counts, axis=0) if self._earlier else counts[0])[0]
        return float(values[0]) if self._flat else values

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Predict the outputs of samples.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)
        return_std : bool, default=False
            Whether to return the standard deviation of the averaged epochs' answers too: how
            unsettled a prediction is, which is not the noise of the targets. Zero where nothing
            is averaged.

        Returns
        -------
        ndarray, shape (n_samples,) or (n_samples, n_outputs)
            As the targets' shape was in training.
        ndarray, the same shape
            With ``return_std``.

        Raises
        ------
        NotFittedError
            Before `fit` or `partial_fit`.
        ValueError
            For samples that cannot be used: another number of features, NaN, unknown categories.
        """
        table = self._table(X)
        bins = self.network_.input_code.bins(table)
        counts = [
            network.counts_of_bins(bins, self.n_outputs_, self._n_threads())
            for network in (*self._earlier, self.network_)
        ]
        values = self._of_counts(np.mean(counts, axis=0) if self._earlier else counts[0])
        if not return_std:
            return values[:, 0] if self._flat else values
        spread = self._step() * np.std(counts, axis=0)
        return (values[:, 0], spread[:, 0]) if self._flat else (values, spread)

    def _check_outputs(self, n_outputs: int) -> None:
        if n_outputs != self.n_outputs_:
            raise ValueError(
                f"y must have as many outputs as before, {self.n_outputs_}, got {n_outputs}"
            )

    def _checked(self, X: Any, y: Any, reset: bool) -> tuple[NDArray[Any], NDArray[np.float64]]:
        if y is None:
            # Said here because scikit-learn, told of several outputs, says it less clearly.
            raise ValueError("SDNNRegressor requires y to be passed, but the target y is None")
        table, targets = self._validated(X, y, multi_output=True, y_numeric=True, reset=reset)
        try:
            targets = np.asarray(targets, dtype=np.float64)
        except ValueError as error:
            raise ValueError(f"y must be numbers: {error}") from None
        if reset:
            self._flat = targets.ndim == 1
        return table, targets.reshape(len(targets), -1)

    def _begin(
        self, X: Any, table: NDArray[Any], targets: NDArray[np.float64], n_networks: int = 1
    ) -> np.random.RandomState:
        self.n_outputs_ = targets.shape[1]
        self.output_range_ = self._range_of(targets)
        self.n_outputs_out_of_range_ = 0
        self._earlier = ()
        n_units = whole("n_output_units", self.n_output_units, 1, 2**20)
        self._counts_of_range = n_units
        return self._start(X, table, self.n_outputs_ * n_units, n_networks)

    def _range_of(self, targets: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.output_range is not None:
            try:
                given = np.asarray(self.output_range)
            except ValueError:  # rows of different lengths
                given = np.empty(0)
            is_real = given.dtype.kind in "iuf"  # numbers beyond all floats are objects
            given = given.astype(np.float64) if is_real else np.empty(0)
            given = np.tile(given, (self.n_outputs_, 1)) if given.ndim == 1 else given
            if (
                given.shape != (self.n_outputs_, 2)
                or not np.all(np.isfinite(given))
                or not np.all(given[:, 0] < given[:, 1])
                or np.any(np.abs(given) > FURTHEST)
            ):
                raise ValueError(
                    "output_range must be (low, high) or one row (low, high) per output, "
                    f"within {FURTHEST}, low < high, got {self.output_range!r}"
                )
            return given
        self._need_two(targets, "the output_range that is not given")
        low, high = targets.min(axis=0), targets.max(axis=0)
        if np.any(np.maximum(-low, high) > FURTHEST):
            raise ValueError(f"y must be within {FURTHEST}, got [{low.min()}, {high.max()}]")
        margin = np.where(high > low, MARGIN * (high - low), np.maximum(1.0, np.abs(low)))
        return np.stack([low - margin, high + margin], axis=1)

    def _step(self) -> NDArray[np.float64]:
        """Return the change of an output by one unit, shape (n_outputs,)."""
        width: NDArray[np.float64] = self.output_range_[:, 1] - self.output_range_[:, 0]
        return width / self._counts_of_range

    def _in_counts(self, targets: NDArray[np.float64]) -> NDArray[np.float64]:
        """Targets in units of the firing count, not rounded."""
        counts: NDArray[np.float64] = (targets - self.output_range_[:, 0]) / self._step()
        return counts

    def _of_counts(self, counts: NDArray[Any]) -> NDArray[np.float64]:
        """Return the outputs of firing counts, shape (n_samples, n_outputs)."""
        values: NDArray[np.float64] = self._step() * counts + self.output_range_[:, 0]
        return values

    def _counts_to_learn(
        self, targets: NDArray[np.float64], at_once: bool = False
    ) -> NDArray[np.float64]:
        """Targets in counts; those beyond the range are counted, refused, or widen it.

        They widen it one after the other, as if they came so, or all at once.
        """
        counts = self._in_counts(targets)
        if counts.min() >= 0 and counts.max() <= self._counts_of_range:
            return counts
        low, high = self.output_range_.T
        outside = (targets < low) | (targets > high)
        if not outside.any():  # a count that was rounded
            return counts
        row, output = np.argwhere(outside)[0].tolist()
        ends = f"{targets[row, output]}, beyond output_range_ [{low[output]}, {high[output]}]"
        if self.out_of_range == "error":
            raise ValueError(f"y has {ends}, but out_of_range is 'error'")
        if self.n_outputs_out_of_range_ == 0:
            then = "count as its ends" if self.out_of_range == "clip" else "widen it"
            self._warn(f"y has {ends}: values beyond the range {then}")
        if self.out_of_range == "clip":
            self.n_outputs_out_of_range_ += int(np.count_nonzero(outside))
            return counts
        if at_once:
            self.n_outputs_out_of_range_ += int(np.count_nonzero(outside))
            self._widen(targets.min(axis=0))
            self._widen(targets.max(axis=0))
            return self._in_counts(targets)
        begin = 0
        for row in np.flatnonzero(outside.any(axis=1)).tolist():
            counts[begin:row] = self._in_counts(targets[begin:row])
            begin = row
            self.n_outputs_out_of_range_ += self._widen(targets[row])
        counts[begin:] = self._in_counts(targets[begin:])
        return counts

    def _widen(self, targets: NDArray[np.float64]) -> int:
        """Widen the ranges of outputs whose target lies beyond; returns how many did.

        Predictions so far are stretched with the range, as counts keep their meaning within it.
        """
        low, high = self.output_range_.T
        new_low = np.where(targets < low, targets - MARGIN * (high - targets), low)
        new_high = np.where(targets > high, targets + MARGIN * (targets - low), high)
        if not np.all(np.isfinite(new_high - new_low)):
            raise ValueError(f"y has {targets}: no range can be so wide")
        n_widened = int(np.count_nonzero((new_low < low) | (new_high > high)))
        self.output_range_ = np.stack([new_low, new_high], axis=1)
        return n_widened

    def _trainer(
        self,
        network: Network,
        bins: NDArray[np.int32],
        targets: NDArray[np.float64],
        n_epochs: int,
    ) -> Trainer:
        options = self._trainer_options(n_epochs)
        return _core.PDeltaTrainer(network.layer, bins, targets, **options)

    def _present_online(
        self, online: _core.OnlineLayer, bins: NDArray[np.int32], targets: NDArray[np.float64]
    ) -> None:
        online.learn_counts(bins, targets)
