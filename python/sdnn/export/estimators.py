"""Regressors and classifiers as C headers, for small processors."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from sdnn.export.estimator_writer import EstimatorHeader, EstimatorWriter
from sdnn.support.arguments import argument_error, flag, path_of, shown, whole
from sdnn.support.files import write_whole

if TYPE_CHECKING:
    from sdnn.export.estimator_writer import Model

CODE_BYTES = 7000  # of a header's functions compiled for size, at most
_LONGEST_NAME = 40
_REMEDY = (
    "train with the settings of sdnn.export.small_settings(), or with n_averaged_epochs=1, and"
    " smaller n_output_units, n_units_per_class, n_pattern_units or fewer pairs"
)


def export_estimator_header(
    model: Model,
    path: str | Path,
    *,
    name: str | None = None,
    learning: bool = False,
    flash_bytes: int | None = None,
) -> EstimatorHeader:
    """Write a fitted estimator as a C header and return it.

    The file is written as a whole or not at all. The name is by default the file's, without its
    ending; everything else is as for `estimator_header`.
    """
    place = path_of("path", path)
    header = estimator_header(
        model,
        place.stem if name is None else name,
        learning=learning,
        flash_bytes=flash_bytes,
    )
    write_whole(place, header.text.encode())
    return header


def estimator_header(
    model: Model, name: str, *, learning: bool = False, flash_bytes: int | None = None
) -> EstimatorHeader:
    """Return a fitted `SDNNRegressor` or `SDNNClassifier` as a C header.

    The header is C99 and C++, and needs ``<stdint.h>`` only, no heap and no floating point: it
    calculates with doubles in integers. Its predictions are those of ``model.predict``, to the
    bit. With ``learning`` it also learns samples as ``model.learn_one`` does, to the same weights.
    See docs/how-to/estimators-on-a-chip.md.

    Parameters
    ----------
    model : SDNNRegressor or SDNNClassifier
    name : str
        Prefix of all names in the header.
    learning : bool, optional
        Write an estimator that learns, with its weights in a struct. It begins with the last of the
        averaged networks, as ``model.partial_fit`` does.
    flash_bytes : int, optional
        Bytes that constants and code may take; by default any number.

    Raises
    ------
    TypeError
        For other estimators.
    ValueError
        If ``name`` is not a C identifier, the header takes more than ``flash_bytes``, the model has
        more than 2^26 weights or a weight of more than 16 bits, a coding has no form in C, or a
        parameter does not allow ``learning``.
    sklearn.exceptions.NotFittedError
        If the model is not fitted.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn import SDNNRegressor
    >>> from sdnn.export import estimator_header
    >>> X = np.random.RandomState(0).uniform(size=(200, 2))
    >>> settings = {"n_output_units": 40, "n_pattern_units": 64, "random_state": 0}
    >>> model = SDNNRegressor(**settings).fit(X, X.prod(axis=1))
    >>> header = estimator_header(model, "product")
    >>> header.flash_bytes < 2**15
    True
    >>> "product_predict(x, y)" in header.text
    True
    """
    is_name = isinstance(name, str) and re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name)
    if not is_name or len(name) > _LONGEST_NAME:
        raise argument_error(
            "name",
            "must be a C identifier of letters, digits and single underscores between them,"
            f" at most {_LONGEST_NAME} long, got {shown(name)}",
        )
    limit = None if flash_bytes is None else whole("flash_bytes", flash_bytes, 1, 2**40)
    writer = EstimatorWriter
    fitted = checked_model(model)
    if flag("learning", learning):
        from sdnn.export.estimator_learner import EstimatorLearner  # imports scikit-learn

        writer = EstimatorLearner
    header = writer(fitted, name).header()
    require_flash(header, limit)
    return header


def checked_model(model: Model) -> Model:
    """Return a fitted estimator; TypeError if it has no form in C."""
    from sdnn.estimators import SDNNClassifier, SDNNRegressor  # scikit-learn is slow to import

    if not isinstance(model, SDNNRegressor | SDNNClassifier):
        raise argument_error(
            "model", f"must be an SDNNRegressor or SDNNClassifier, got {shown(model)}", TypeError
        )
    model._fitted_network  # noqa: B018  # raises NotFittedError
    return model


def require_flash(header: EstimatorHeader, limit: int | None) -> None:
    """Raise ValueError if a header takes more flash than a limit."""
    needed = header.flash_bytes + CODE_BYTES
    if limit is not None and needed > limit:
        raise argument_error(
            "flash_bytes",
            f"must be at least {needed}, for constants of {header.flash_bytes} bytes (weights:"
            f" {header.weight_bytes}) and code of up to {CODE_BYTES}, got {limit}: {_REMEDY}",
        )
