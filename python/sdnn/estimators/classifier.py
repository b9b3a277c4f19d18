"""SDNNClassifier: selective desensitization and perceptrons with error correction."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import ClassifierMixin
from sklearn.utils.class_weight import compute_class_weight
from sklearn.utils.metaestimators import available_if
from sklearn.utils.multiclass import check_classification_targets, unique_labels

from sdnn import _core
from sdnn.arguments import flag, one_of, whole
from sdnn.estimators.base import BaseSDNN
from sdnn.estimators.columns import kept_pairs
from sdnn.estimators.network import Network
from sdnn.estimators.training import LARGEST_WEIGHT, Trainer, sample_weights, weighted_mean

__all__ = ["SDNNClassifier"]

UNITS_EACH = 60
MOST_UNITS = 1200
OWN_SHARE = 5 / 6
"""The share of a class's units that are to fire for its own samples; for others the rest."""
STEEPNESS = 6.0
"""Of the softmax that makes probabilities of scores."""

Self = TypeVar("Self", bound="SDNNClassifier")


def numbers_of(y: NDArray[Any], classes: NDArray[Any]) -> NDArray[np.int32]:
    """Return the indices of labels among the classes; ValueError for one that is not there."""
    unseen = np.setdiff1d(y, classes)
    if len(unseen):
        raise ValueError(
            f"y has labels {unseen.tolist()} that are not in classes, {classes.tolist()}"
        )
    return np.searchsorted(classes, y).astype(np.int32)


class SDNNClassifier(ClassifierMixin, BaseSDNN):
    """Classification by a selective desensitization neural network, exact and online.

    Each input becomes a binary pattern, the patterns of each two inputs are combined by selective
    desensitization, and over this code units with integer weights are trained: some for each
    class, whose number that fires is its score, or one per class or pair of classes. Sources:
    Nonaka, Tanaka and Morita 2011 (the code); Auer, Burgsteiner and Maass 2008 (groups of units,
    the p-delta rule); the manual of LIBSDNN (both schemes of single units).

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
    out_of_range : {"clip", "error"}, default="clip"
        Inputs to learn beyond their range count as its ends, and an `OutOfRangeWarning` says so
        once; or they are errors.
    scheme : {"one_vs_rest", "one_vs_one"}, default="one_vs_rest"
        Units for each class, the largest score wins; or one per pair of classes, which vote.
    n_units_per_class : int, optional
        Units for each class. Of those of a sample's class five sixths are to fire and of those of
        others one sixth, so that units may specialize: several can tell apart what one cannot.
        With 1 the unit's potential is the score. None: 60, or fewer from 20 classes on, 1,200 in
        all; 1 with "one_vs_one".
    class_weight : "balanced" or dict, optional
        How often the samples of a class are presented per epoch of `fit`, on average; "balanced"
        presents all classes as often. `partial_fit` knows no weights.
    max_iter : int, default=100
        Largest number of epochs of `fit`, which ends earlier once nothing is corrected.
    shuffle : bool, default=True
        Whether each epoch has a new random order; otherwise it is the order of the sample.
    early_stopping : bool, default=False
        Whether to hold a fraction of the sample out, stop when its accuracy no longer rises, and
        keep the best weights.
    validation_fraction : float, default=0.1
        The fraction that early stopping holds out.
    n_iter_no_change : int, default=10
        Epochs without improvement before early stopping.
    training : {"auto", "dual", "block", "plain"}, default="auto"
        Form of training; the result is the same to the last bit, time and memory differ.
    memory_limit : int, default=2**30
        Bytes that weights and patterns may use, and that training may use beside them.
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
    classes_ : ndarray, shape (n_classes,)
        The labels, sorted.
    codings_ : tuple of Coding
        The fitted coding of each input.
    pairs_ : tuple of (int, int)
        The pairs in use.
    pair_importances_ : ndarray, shape (n_pairs,)
        How much training has changed the weights of each pair; they sum to 1.
    weights_ : ndarray of int32, shape (n_units, n_columns)
    thresholds_ : ndarray of int32, shape (n_units,)
    n_inputs_out_of_range_ : int
        Values learned since the last `fit` that lay beyond their range.
    n_iter_ : int
        Epochs of the last `fit` and calls of `partial_fit` since.
    n_corrected_ : ndarray of int64, shape (n_epochs,)
        Samples corrected in each epoch of the last `fit`.
    validation_scores_ : ndarray, shape (n_epochs,) or (0,)
        With early stopping, the accuracy on what is held out.
    training_form_, training_memory_ : str, int
        The form of training that the last `fit` chose, and the most bytes it takes beside the
        weights.
    n_features_in_, feature_names_in_ : int, ndarray of str
        As everywhere in scikit-learn.

    Examples
    --------
    >>> from sklearn.datasets import load_iris
    >>> from sdnn import SDNNClassifier
    >>> X, y = load_iris(return_X_y=True)
    >>> model = SDNNClassifier(random_state=0).fit(X[::2], y[::2])
    >>> bool(model.score(X[1::2], y[1::2]) > 0.9)
    True
    """

    def __init__(
        self,
        coding: Any = "random-inverse",
        *,
        n_pattern_units: int | None = None,
        pairs: Any = "budget",
        tables: str = "shared",
        out_of_range: str = "clip",
        scheme: str = "one_vs_rest",
        n_units_per_class: int | None = None,
        class_weight: Any = None,
        max_iter: int = 100,
        shuffle: bool = True,
        early_stopping: bool = False,
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
        self.out_of_range = out_of_range
        self.scheme = scheme
        self.n_units_per_class = n_units_per_class
        self.class_weight = class_weight
        self.max_iter = max_iter
        self.shuffle = shuffle
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.training = training
        self.memory_limit = memory_limit
        self.warm_start = warm_start
        self.random_state = random_state
        self.n_jobs = n_jobs
        self.verbose = verbose

    def fit(self: Self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> Self:
        """Learn ranges and classes, draw the network and train it.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)
        y : array_like, shape (n_samples,)
        sample_weight : array_like, shape (n_samples,), optional
            How often each sample is presented per epoch, on average; 1 by default. What early
            stopping holds out and "auto" compares is weighted too. Ranges and categories are
            learned from all samples.

        Returns
        -------
        SDNNClassifier
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
        flag("warm_start", self.warm_start)
        table, y = self._checked(X, y, reset=not self._goes_on(), ensure_min_samples=2)
        weights = sample_weights(sample_weight, len(table))
        if self._goes_on():
            random = self._go_on(table)
        else:
            self._select_pairs(X, table, y, weights)
            random = self._begin(X, table, unique_labels(y))
            self.__dict__.pop("_selected", None)
        labels = numbers_of(y, self.classes_)
        held, kept = self._split(random, len(table))
        bins = self.network_.input_code.bins(table)
        trainer = self._trainer(self.network_, bins[kept], labels[kept], self.max_iter)
        held_table, held_labels = table[held], labels[held]
        held_weights = None if weights is None else weights[held]
        kept_weights = self._weights(labels[kept], None if weights is None else weights[kept])

        def score() -> float:
            winners = self._winners(self._decide(held_table))
            return weighted_mean(winners == held_labels, held_weights)

        self._run(trainer, len(kept), random, score, kept_weights)

    def _weights(
        self, labels: NDArray[np.int32], weights: NDArray[np.float64] | None
    ) -> NDArray[np.float64] | None:
        """Return how often each sample is presented per epoch, on average, by both weights."""
        if self.class_weight is None:
            return weights
        present = np.unique(labels)
        of_class = np.ones(len(self.classes_))
        of_class[present] = compute_class_weight(
            self.class_weight, classes=self.classes_[present], y=self.classes_[labels]
        )
        if not np.all((of_class >= 0) & (of_class <= LARGEST_WEIGHT)):
            raise ValueError(
                f"class_weight must be numbers in [0, {LARGEST_WEIGHT}], got {self.class_weight!r}"
            )
        each = of_class[labels] if weights is None else of_class[labels] * weights
        return sample_weights(each, len(labels), name="class_weight times sample_weight")

    def partial_fit(
        self: Self, X: ArrayLike, y: ArrayLike, classes: ArrayLike | None = None
    ) -> Self:
        """Go once through the samples, in their order.

        Samples given one at a time, in any portions, or all at once give the same weights, which
        are also those of `fit` with ``max_iter=1, shuffle=False``, provided that ranges and
        categories are given. What is not given is learned from the samples of the first call.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)
        y : array_like, shape (n_samples,)
        classes : array_like, shape (n_classes,), optional
            All labels that can occur; needed in the first call.

        Returns
        -------
        SDNNClassifier
            Itself.

        Raises
        ------
        ValueError, OverflowError, MemoryError
            As of `fit`; ValueError too for other labels than ``classes``.
        """
        first = not hasattr(self, "network_")
        if first and classes is None:
            raise ValueError("classes must be given in the first call of partial_fit")
        work = self._scratch()
        table, y = work._checked(X, y, reset=first)
        listed = self.classes_ if classes is None else unique_labels(classes)
        labels = numbers_of(y, listed)
        if first:
            work._begin(X, table, listed)
            work.n_iter_ = 0
        elif not np.array_equal(listed, self.classes_):
            raise ValueError(
                f"classes={listed!r} are not those of the first call, {self.classes_!r}"
            )
        else:
            work._finite(table, work.codings_)
            work._note_inputs(table)
        work.n_iter_ += 1
        work._learn_once(work.network_.input_code.bins(table), labels)
        self.__dict__ = work.__dict__
        return self

    def learn_one(self: Self, x: Any, y: Any, classes: ArrayLike | None = None) -> Self:
        """Learn one sample: `partial_fit` of one row, to the same bits, without its overhead.

        Parameters
        ----------
        x : array_like of shape (n_features,), or mapping from feature names to values
            The names of a mapping that comes first of all are those of the features. Later ones
            may lack features whose coding is `WithMissing`: their values are missing.
        y : label
        classes : array_like, shape (n_classes,), optional
            All labels that can occur; needed in the first call.

        Returns
        -------
        SDNNClassifier
            Itself.

        Raises
        ------
        ValueError, OverflowError, MemoryError
            As of `partial_fit`; nothing is changed then.
        """
        self._refuse_class_weight()
        work = self._scratch()
        if hasattr(self, "network_"):
            if classes is not None and not np.array_equal(unique_labels(classes), self.classes_):
                raise ValueError(
                    f"classes={classes!r} are not those of the first call, {self.classes_!r}"
                )
            labels = work._number_of_one(y)
            row = self._row(x)
            work._note_inputs(row[None])
            bins = work.network_.input_code.bins_of_row(row)
        else:
            if classes is None:
                raise ValueError("classes must be given in the first call of learn_one")
            table = work._table_of_one(x)
            work._begin(x, table, unique_labels(classes))
            labels = work._number_of_one(y)
            work.n_iter_ = 0
            bins = work.network_.input_code.bins(table)
        work.n_iter_ += 1
        work._learn_once(bins, labels)
        self.__dict__ = work.__dict__
        return self

    def _number_of_one(self, y: Any) -> NDArray[np.int32]:
        """Return the index of a label among the classes, shape (1,)."""
        return numbers_of(np.array([y]), self.classes_)

    def predict_one(self, x: Any) -> Any:
        """Predict the label of one sample: `predict` of one row, without its overhead.

        Parameters
        ----------
        x : array_like of shape (n_features,), or mapping from feature names to values
            As of `learn_one`.

        Raises
        ------
        NotFittedError, ValueError
            As of `predict`.
        """
        decision = self._decision_of_bins(self._bins_of_one(x), n_threads=1)
        return self.classes_[self._winners(decision)[0]]

    def decision_function(self, X: ArrayLike) -> NDArray[np.float64]:
        """Return how much speaks for each class.

        The share of its units that fire, or the potential of a single one. One-versus-one: votes,
        and less than half a vote more by the potentials, which decides between classes of equal
        votes.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)

        Returns
        -------
        ndarray, shape (n_samples, n_classes), or (n_samples,) for two classes
            For two classes, positive values speak for ``classes_[1]``.

        Raises
        ------
        NotFittedError
            Before `fit` or `partial_fit`.
        ValueError
            For samples that cannot be used: another number of features, NaN, unknown categories.
        """
        return self._decide(self._table(X))

    def predict(self, X: ArrayLike) -> NDArray[Any]:
        """Predict the labels of samples.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)

        Returns
        -------
        ndarray, shape (n_samples,)

        Raises
        ------
        NotFittedError
            Before `fit` or `partial_fit`.
        ValueError
            For samples that cannot be used: another number of features, NaN, unknown categories.
        """
        winners = self._winners(self.decision_function(X))
        labels: NDArray[Any] = self.classes_[winners]
        return labels

    def _has_several_units(self) -> bool:
        return self.scheme == "one_vs_rest" and self.n_units_per_class != 1

    @available_if(_has_several_units)  # type: ignore[untyped-decorator]
    def predict_proba(self, X: ArrayLike) -> NDArray[np.float64]:
        """Return estimated probabilities of the classes, a softmax of their scores.

        Its steepness is a constant that suits many problems, not one learned from the sample:
        `docs/regression.md` says how well it is calibrated. Where that matters, use scikit-learn's
        `CalibratedClassifierCV`. There are none with one unit per class or pair of classes.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)

        Returns
        -------
        ndarray, shape (n_samples, n_classes)
            Columns in the order of ``classes_``.

        Raises
        ------
        NotFittedError, ValueError
            As of `predict`.
        """
        table = self._table(X)
        return self._probabilities(self.network_.input_code.bins(table), self._n_threads())

    @available_if(_has_several_units)  # type: ignore[untyped-decorator]
    def predict_proba_one(self, x: Any) -> NDArray[np.float64]:
        """Estimate the probabilities of one sample: `predict_proba` of a row, without its overhead.

        Parameters
        ----------
        x : array_like of shape (n_features,), or mapping from feature names to values
            As of `learn_one`.

        Returns
        -------
        ndarray, shape (n_classes,)
            In the order of ``classes_``.

        Raises
        ------
        NotFittedError, ValueError
            As of `predict`.
        """
        of_one: NDArray[np.float64] = self._probabilities(self._bins_of_one(x), n_threads=1)[0]
        return of_one

    def _bins_of_one(self, x: Any) -> NDArray[np.int32]:
        """Return the bins of one sample, whose answer is wanted without overhead."""
        network = self._fitted_network
        network.online(self.memory_limit)
        return network.input_code.bins_of_row(self._row(x))

    def _probabilities(self, bins: NDArray[np.int32], n_threads: int) -> NDArray[np.float64]:
        scores = self._scores(bins, n_threads)
        raised = np.exp(STEEPNESS * (scores - scores.max(axis=1, keepdims=True)))
        probabilities: NDArray[np.float64] = raised / raised.sum(axis=1, keepdims=True)
        return probabilities

    def _refuse_class_weight(self) -> None:
        """Refuse it where samples come piece by piece."""
        if self.class_weight is not None:
            raise ValueError(f"class_weight works in fit only, got {self.class_weight!r}")

    def _checked(self, X: Any, y: Any, **options: Any) -> tuple[NDArray[Any], NDArray[Any]]:
        if not options.get("ensure_min_samples"):
            self._refuse_class_weight()
        table, y = self._validated(X, y, **options)
        check_classification_targets(y)
        return table, y

    def _begin(self, X: Any, table: NDArray[Any], classes: Any) -> np.random.RandomState:
        one_of("scheme", self.scheme, _core.CLASS_SCHEMES)
        self.classes_ = classes
        n_classes = len(self.classes_)
        if n_classes < 2:
            raise ValueError(f"at least two classes are needed, got one class: {classes!r}")
        self._scheme = self.scheme
        self._n_units_each = self._units_each(n_classes)
        n_units = _core.n_units_for(self.scheme, n_classes) * self._n_units_each
        return self._start(X, table, n_units)

    def _units_each(self, n_classes: int) -> int:
        if self.n_units_per_class is None:
            single = self.scheme == "one_vs_one"
            return 1 if single else min(UNITS_EACH, max(2, MOST_UNITS // n_classes))
        n_each = whole("n_units_per_class", self.n_units_per_class, 1, 1024)
        if n_each > 1 and self.scheme == "one_vs_one":
            raise ValueError(
                f"n_units_per_class must be 1 or None with scheme='one_vs_one', got {n_each}"
            )
        return n_each

    def _counts_to_learn(self, labels: NDArray[np.int32]) -> NDArray[np.float64]:
        """How many units of each class are to fire, shape (n_samples, n_classes)."""
        own = labels[:, None] == np.arange(len(self.classes_))
        return self._n_units_each * np.where(own, OWN_SHARE, 1 - OWN_SHARE)

    def _trainer(
        self, network: Network, bins: NDArray[np.int32], targets: NDArray[np.int32], n_epochs: int
    ) -> Trainer:
        options = self._trainer_options(n_epochs)
        if self._n_units_each > 1:
            counts = self._counts_to_learn(targets)
            return _core.PDeltaTrainer(network.layer, bins, counts, **options)
        return _core.PerceptronTrainer(
            network.layer,
            bins,
            targets,
            len(self.classes_),
            self._scheme,
            **options,
        )

    def _present_online(
        self, online: _core.OnlineLayer, bins: NDArray[np.int32], targets: NDArray[np.int32]
    ) -> None:
        if self._n_units_each > 1:
            online.learn_counts(bins, self._counts_to_learn(targets))
        else:
            online.learn_labels(bins, targets, len(self.classes_), self._scheme)

    def _decide(self, table: NDArray[Any]) -> NDArray[np.float64]:
        bins = self.network_.input_code.bins(table)
        return self._decision_of_bins(bins, self._n_threads())

    def _scores(self, bins: NDArray[np.int32], n_threads: int) -> NDArray[np.float64]:
        """Return the share of each class's units that fire, shape (n_samples, n_classes)."""
        counts = self.network_.counts_of_bins(bins, len(self.classes_), n_threads)
        return counts / self._n_units_each

    def _decision_of_bins(self, bins: NDArray[np.int32], n_threads: int) -> NDArray[np.float64]:
        n_classes = len(self.classes_)
        if self._n_units_each > 1:
            scores = self._scores(bins, n_threads)
            return scores[:, 1] - scores[:, 0] if n_classes == 2 else scores
        potentials = self.network_.potentials_of_bins(bins, n_threads).astype(np.float64)
        if self._scheme == "one_vs_rest":
            return potentials[:, 1] - potentials[:, 0] if n_classes == 2 else potentials
        # A unit that fires speaks for the first of its pair; a potential of 0 is silence.
        leaning = potentials - 0.5
        if n_classes == 2:
            return -leaning[:, 0]
        votes = np.zeros((len(potentials), n_classes))
        sums = np.zeros((len(potentials), n_classes))
        for unit, (i, j) in enumerate(zip(*np.triu_indices(n_classes, 1), strict=True)):
            votes[np.arange(len(votes)), np.where(leaning[:, unit] > 0, i, j)] += 1
            sums[:, i] += leaning[:, unit]
            sums[:, j] -= leaning[:, unit]
        decision: NDArray[np.float64] = votes + sums / (3 * (np.abs(sums) + 1))
        return decision

    def _winners(self, decision: NDArray[np.float64]) -> NDArray[np.int64]:
        if decision.ndim == 1:
            return (decision > 0).astype(np.int64)
        winners: NDArray[np.int64] = np.argmax(decision, axis=1)
        return winners
