"""What the regressor and the classifier share."""

from __future__ import annotations

import abc
import contextlib
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from joblib import effective_n_jobs
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted

from sdnn import _core
from sdnn.arguments import flag, one_of, real, whole
from sdnn.coding import Coding, WithMissing
from sdnn.estimators import files
from sdnn.estimators.coded_inputs import CodedInputs
from sdnn.estimators.columns import input_pairs, share_of_pairs
from sdnn.estimators.input_code import (
    PAIR_BUDGET,
    code_bytes,
    draw_input_code,
    pattern_units_for,
)
from sdnn.estimators.network import FEW_SAMPLES, Network
from sdnn.estimators.pair_selection import select_pairs, with_categories
from sdnn.estimators.training import History, Trainer, run_epochs

__all__ = ["BaseSDNN", "OutOfRangeWarning"]

Self = TypeVar("Self", bound="BaseSDNN")
MOST_EPOCHS = 10**9


class OutOfRangeWarning(UserWarning):
    """Values to learn lie beyond a range that was given or learned; warned of once a model."""


class BaseSDNN(CodedInputs):
    """The code of the inputs, the loop over epochs, files."""

    n_pattern_units: int | None
    pairs: Any
    tables: str
    out_of_range: str
    max_iter: int
    shuffle: bool
    early_stopping: bool
    validation_fraction: float
    n_iter_no_change: int
    training: str
    memory_limit: int
    warm_start: bool
    random_state: Any
    n_jobs: int | None
    verbose: int

    network_: Network
    n_features_in_: int
    n_inputs_out_of_range_: int

    # Pairs that `fit` has selected, for the time of fitting.
    _selected: list[tuple[int, int]] | None = None

    OUT_OF_RANGE: ClassVar[tuple[str, ...]] = ("clip", "error")

    def _check_parameters(self) -> None:
        """ValueError for an impossible parameter; codings and pairs are checked with the data."""
        whole("max_iter", self.max_iter, 1, MOST_EPOCHS)
        whole("n_iter_no_change", self.n_iter_no_change, 1, MOST_EPOCHS)
        whole("memory_limit", self.memory_limit, 0, 2**62)
        one_of("training", self.training, _core.TRAINING_FORMS)
        flag("shuffle", self.shuffle)
        flag("early_stopping", self.early_stopping)
        flag("warm_start", self.warm_start)
        if not isinstance(self.verbose, bool | np.bool_):
            whole("verbose", self.verbose, 0, 2**62)
        if self.n_jobs is not None:
            whole("n_jobs", self.n_jobs, -4096, 4096)
        if isinstance(self.coding, list | tuple) and not self.coding:
            raise ValueError(f"coding must name a coding for some columns, got {self.coding!r}")
        one_of("out_of_range", self.out_of_range, self.OUT_OF_RANGE)
        if not 0 < real("validation_fraction", self.validation_fraction) < 1:
            raise ValueError(
                f"validation_fraction must be between 0 and 1, got {self.validation_fraction!r}"
            )
        if self.n_pattern_units is not None:
            whole("n_pattern_units", self.n_pattern_units, 2, 2**24)
            if self.n_pattern_units % 2:
                raise ValueError(f"n_pattern_units must be even, got {self.n_pattern_units}")

    def _start(
        self, X: Any, table: NDArray[Any], n_units: int, n_networks: int = 1
    ) -> np.random.RandomState:
        """Fit the codings, draw tables and first weights; returns the generator of orders."""
        self._check_parameters()
        listed = self._listed_names()
        n_inputs = table.shape[1]
        codings = self._codings(X, table)
        random: np.random.RandomState = check_random_state(self.random_state)
        code_seed, weight_seed = (int(seed) for seed in random.randint(2**31 - 1, size=2))
        shared = isinstance(self.pairs, str) and self.pairs in ("budget", "auto")
        if self._selected is not None:
            pairs = self._selected
        elif shared and n_inputs > 1:
            pairs = share_of_pairs(n_inputs, PAIR_BUDGET, code_seed)
        else:
            pairs = input_pairs("all" if shared else self.pairs, listed, n_inputs)
        n_pattern_units = self.n_pattern_units or pattern_units_for(len(pairs))
        fitted = [
            coding.fit(table[:, index], n_pattern_units) for index, coding in enumerate(codings)
        ]
        self._require_memory(n_units, n_networks, n_pattern_units, fitted, pairs)
        code = draw_input_code(fitted, pairs, n_pattern_units, self.tables, code_seed)
        self.network_ = Network(code, n_units, seed=weight_seed)
        self._weight_seed = weight_seed
        self.n_inputs_out_of_range_ = 0
        self._note_inputs(table)
        return random

    def _goes_on(self) -> bool:
        """Whether `fit` is to go on with the network that is there."""
        return bool(self.warm_start) and hasattr(self, "network_")

    def _go_on(self, table: NDArray[Any], n_networks: int = 1) -> np.random.RandomState:
        """Train a copy of the network from now on; returns the generator of orders."""
        self._check_parameters()
        if n_networks > 1:
            code = self.network_.input_code
            n_units = self.network_.n_units
            self._require_memory(n_units, n_networks, code.n_units, code.codings, code.pairs)
        self._finite(table, self.codings_)
        self._note_inputs(table)
        self.network_ = self.network_.copy()
        random: np.random.RandomState = check_random_state(self.random_state)
        return random

    def _select_pairs(
        self, X: Any, table: NDArray[Any], y: Any, weights: NDArray[np.float64] | None
    ) -> None:
        """Let cross-validation select the pairs, if it is to."""
        if not (isinstance(self.pairs, str) and self.pairs == "auto") or table.shape[1] < 2:
            return
        self._check_parameters()
        seed = int(check_random_state(self.random_state).randint(2**31 - 1))
        every = share_of_pairs(table.shape[1], PAIR_BUDGET, seed)
        model = clone(self).set_params(random_state=seed, early_stopping=False, verbose=0)
        codings = self._codings(X, table)
        known = [with_categories(coding, table[:, i]) for i, coding in enumerate(codings)]
        if known != codings:
            model.set_params(coding=[(coding, [index]) for index, coding in enumerate(known)])
        self._selected = select_pairs(model, X, y, weights, every, seed)

    def _require_memory(
        self,
        n_units: int,
        n_networks: int,
        n_pattern_units: int,
        codings: Sequence[Coding],
        pairs: Sequence[tuple[int, int]],
    ) -> None:
        """ValueError if weights and patterns take more than the limit, before they are there."""
        n_bytes = 4 * n_networks * n_units * len(pairs) * n_pattern_units
        n_bytes += code_bytes(codings, pairs, n_pattern_units)
        if n_bytes > self.memory_limit:
            averaged = f" in {n_networks} networks to be averaged" if n_networks > 1 else ""
            raise ValueError(
                f"n_pattern_units={n_pattern_units} of {len(pairs)} pairs, read by {n_units} "
                f"units{averaged}, need {n_bytes} bytes for weights and patterns, more than "
                f"memory_limit={self.memory_limit}"
            )

    def _table(self, X: Any) -> NDArray[Any]:
        """Check samples for prediction."""
        codings = self.codings_
        table: NDArray[Any] = self._validated(X, reset=False)
        return self._finite(table, codings)

    def _n_threads(self) -> int:
        return int(effective_n_jobs(self.n_jobs))

    def _trainer_options(self, n_epochs: int) -> dict[str, Any]:
        return {
            "n_epochs": n_epochs,
            "form": self.training,
            "memory_limit": self.memory_limit,
            "n_threads": self._n_threads(),
        }

    def _split(
        self, random: np.random.RandomState, n_samples: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Numbers of the held out samples and of the others; none held out by default."""
        if not self.early_stopping:
            return np.empty(0, dtype=np.int64), np.arange(n_samples)
        n_held = max(1, round(self.validation_fraction * n_samples))
        if n_held >= n_samples:
            raise ValueError(f"n_samples={n_samples} is too few for early stopping")
        order = random.permutation(n_samples)
        return np.sort(order[:n_held]), np.sort(order[n_held:])

    @abc.abstractmethod
    def _trainer(
        self, network: Network, bins: NDArray[np.int32], targets: NDArray[Any], n_epochs: int
    ) -> Trainer:
        """Return a trainer of the network; targets as `_present_online` has them."""

    @abc.abstractmethod
    def _present_online(
        self, online: _core.OnlineLayer, bins: NDArray[np.int32], targets: NDArray[Any]
    ) -> None:
        """Present samples once, or raise and change nothing."""

    def _learn_once(self, bins: NDArray[np.int32], targets: NDArray[Any]) -> None:
        """Present every sample in its order; all or nothing.

        Single samples are learned in place: nothing that may fail may follow.
        """
        if len(bins) <= FEW_SAMPLES and self.training == "auto":
            try:
                if self.network_.learn_online(
                    lambda online: self._present_online(online, bins, targets), self.memory_limit
                ):
                    return
            except OverflowError:
                pass  # the other forms of training have room for larger weights
        network = self.network_.copy()
        trainer = self._trainer(network, bins, targets, n_epochs=1)
        trainer.present(np.arange(len(bins), dtype=np.int32))
        trainer.synchronize()
        self.network_ = network

    def _note_inputs(self, table: NDArray[Any]) -> None:
        """Count values to learn that lie beyond their input's range."""
        n_outside, first = self.network_.input_code.outside(table)
        if n_outside == 0:
            return
        if self.out_of_range == "error":
            raise ValueError(f"X has {first}, but out_of_range is 'error'")
        if self.n_inputs_out_of_range_ == 0:
            self._warn(f"X has {first}: values beyond a range count as its ends")
        self.n_inputs_out_of_range_ += n_outside

    @staticmethod
    def _warn(message: str) -> None:
        warnings.warn(message, OutOfRangeWarning, stacklevel=5)

    def _row(self, x: Any) -> NDArray[Any]:
        """Return one sample, shape (n_features,), checked; see `learn_one`."""
        if isinstance(x, Mapping):
            values: Any = self._values_of(x)
        else:
            values = x
        if self._fitted_network.input_code.is_numeric:
            try:
                row = np.asarray(values, dtype=np.float64)
            except (TypeError, ValueError):
                raise ValueError(f"x must be numbers, got {x!r}") from None
            if not np.isfinite(row).all():
                raise ValueError(f"x must be finite numbers, got {x!r}")
        else:
            row = np.array(values, dtype=object)
        if row.shape != (self.n_features_in_,):
            raise ValueError(f"x must have {self.n_features_in_} features, got {x!r}")
        return row if row.dtype == np.float64 else self._finite(row[None], self.codings_)[0]

    def _values_of(self, x: Mapping[Any, Any]) -> list[Any]:
        """Return a sample's values in the order of the features, None for one that is missing."""
        names = getattr(self, "feature_names_in_", None)
        if names is None:
            raise ValueError("x must be a 1-D array: the features were learned without names")
        if len(x) == len(names):
            with contextlib.suppress(KeyError):
                return [x[name] for name in names]
        coded = zip(names, self.codings_, strict=True)
        optional = {name for name, coding in coded if isinstance(coding, WithMissing)}
        if not set(names) - optional <= set(x) <= set(names):
            but = f", of which {sorted(optional)} may be missing" if optional else ""
            raise ValueError(f"x must have the features {names.tolist()}{but}, got {list(x)}")
        return [x.get(name) for name in names]

    def _table_of_one(self, x: Any) -> NDArray[Any]:
        """Return the first sample of all as a table; a mapping gives names to the features."""
        names = list(x) if isinstance(x, Mapping) else None
        values = list(x.values()) if isinstance(x, Mapping) else x
        row = np.array(values, dtype=object)
        if row.ndim != 1 or (names is not None and not all(isinstance(n, str) for n in names)):
            raise ValueError(f"x must be a 1-D array, or a mapping with words as keys, got {x!r}")
        table: NDArray[Any] = self._validated(row[None], reset=True)
        if names is not None:
            self.feature_names_in_ = np.array(names, dtype=object)
        return table

    def _run(
        self,
        trainer: Trainer,
        n_samples: int,
        random: np.random.RandomState,
        score: Callable[[], float],
        weights: NDArray[np.float64] | None = None,
        n_averaged_epochs: int = 1,
    ) -> History:
        """Train, and set the attributes that tell how it went."""
        history = run_epochs(
            self.network_,
            trainer,
            n_samples,
            max_iter=self.max_iter,
            random=random if self.shuffle else None,
            score=score if self.early_stopping else None,
            n_iter_no_change=self.n_iter_no_change,
            weights=weights,
            n_averaged_epochs=n_averaged_epochs,
            verbose=self.verbose,
        )
        self.n_iter_ = len(history.n_corrected)
        self.n_corrected_ = np.array(history.n_corrected, dtype=np.int64)
        self.validation_scores_ = np.array(history.scores)
        self.training_form_ = trainer.form
        self.training_memory_ = trainer.memory
        return history

    @property
    def _fitted_network(self) -> Network:
        if "network_" not in self.__dict__:  # scikit-learn's check takes as long as small networks
            check_is_fitted(self, "network_")
        return self.network_

    @property
    def codings_(self) -> tuple[Coding, ...]:
        """The fitted coding of each input."""
        return self._fitted_network.input_code.codings

    @property
    def pairs_(self) -> tuple[tuple[int, int], ...]:
        """The pairs (modified, modifier) of inputs; equal numbers stand for the plain pattern."""
        return self._fitted_network.input_code.pairs

    @property
    def weights_(self) -> NDArray[np.int32]:
        """The integer weights, shape (n_units, n_pairs * n_pattern_units)."""
        return self._fitted_network.weights

    @property
    def pair_importances_(self) -> NDArray[np.float64]:
        """How much training has changed the weights of each of ``pairs_``: squares, of a sum of 1.

        Shape (n_pairs,). Zeros if nothing was learned.
        """
        network = self._fitted_network
        code = network.input_code
        seed = vars(self).get("_weight_seed")
        if seed is None:
            raise AttributeError("the file that was loaded does not say what the weights began as")
        begun = _core.ParallelPerceptron(code.core, network.n_units, seed=seed).weights
        change = (network.weights - begun).reshape(network.n_units, len(code.pairs), code.n_units)
        squares: NDArray[np.float64] = np.square(change, dtype=np.float64).sum(axis=(0, 2))
        shares: NDArray[np.float64] = squares / max(squares.sum(), 1.0)
        return shares

    @property
    def thresholds_(self) -> NDArray[np.int32]:
        """The integer thresholds, shape (n_units,)."""
        return self._fitted_network.thresholds

    def transform_code(self, X: ArrayLike) -> NDArray[np.int8]:
        """Return the code of samples, entries +1, 0 and -1.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)

        Returns
        -------
        ndarray, shape (n_samples, n_pairs * n_pattern_units)

        Raises
        ------
        NotFittedError, ValueError
            As of `predict`.
        """
        table = self._table(X)
        code = self.network_.input_code
        return code.core.transform(code.bins(table))

    def save(self, path: str | Path) -> None:
        """Write the fitted estimator to a safetensors file with JSON metadata, without pickle.

        Raises
        ------
        NotFittedError
            If there is nothing to write yet.
        TypeError
            If a parameter cannot be written as JSON, such as a coding of one's own.
        OSError
            If the file cannot be written; one that was there before stays as it was.
        """
        check_is_fitted(self, "network_")
        files.save(self, path)

    @classmethod
    def load(cls: type[Self], path: str | Path) -> Self:
        """Read an estimator that `save` has written.

        Raises
        ------
        ValueError
            If the file holds something else.
        OSError
            If the file cannot be read.
        """
        return files.load(path, cls)
