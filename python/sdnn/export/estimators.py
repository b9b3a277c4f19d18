"""Regressors and classifiers as C headers, for small processors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sdnn.export.estimator_text import EstimatorHeader, HeaderText
from sdnn.export.estimator_writer import EstimatorWriter
from sdnn.export.text import header_file, require_c_name
from sdnn.support.arguments import argument_error, flag, require, shown, whole
from sdnn.support.files import write_whole

if TYPE_CHECKING:
    from sdnn.export.estimator_text import AnyModel

CODE_BYTES = 7000  # of a header's functions compiled for size, at most


def export_estimator_header(
    model: AnyModel,
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
    file, prefix = header_file(path, name)
    header = estimator_header(model, prefix, learning=learning, flash_bytes=flash_bytes)
    write_whole(file, header.text.encode())
    return header


def estimator_header(
    model: AnyModel, name: str, *, learning: bool = False, flash_bytes: int | None = None
) -> EstimatorHeader:
    """Return a fitted estimator as a C header.

    The header is C99 and C++, and needs ``<stdint.h>`` only, no heap and no floating point: it
    calculates with doubles in integers. Its predictions are those of ``model.predict``, to the
    bit. With ``learning`` it also learns samples as ``model.learn_one`` does, to the same weights.
    Kernel estimators add terms in another order than NumPy, so that their last bits may differ. See
    docs/how-to/estimators-on-a-chip.md.

    Parameters
    ----------
    model : SDNNRegressor, SDNNClassifier, SDNNKernelRidge or SDNNKernelClassifier
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
    require_c_name(name)
    limit = None if flash_bytes is None else whole("flash_bytes", flash_bytes, 1, 2**40)
    writer = writer_of(model, name, learns=flag("learning", learning))
    header = writer.header()
    needed = header.flash_bytes + CODE_BYTES
    if limit is not None and needed > limit:
        raise argument_error(
            "flash_bytes",
            f"must be at least {needed}, for constants of {header.flash_bytes} bytes"
            f" ({writer.about()}; weights: {header.weight_bytes}) and code of up to {CODE_BYTES},"
            f" got {limit}: {writer.remedy}",
        )
    return header


def writer_of(model: AnyModel, name: str, *, learns: bool) -> HeaderText:
    """Return the writer of a fitted estimator's header; TypeError if it has no form in C."""
    from sklearn.utils.validation import check_is_fitted  # scikit-learn is slow to import

    from sdnn.estimators import (
        SDNNClassifier,
        SDNNKernelClassifier,
        SDNNKernelRidge,
        SDNNRegressor,
    )
    from sdnn.export.estimator_learner import EstimatorLearner
    from sdnn.export.kernel_writer import KernelWriter

    if isinstance(model, SDNNRegressor | SDNNClassifier):
        check_is_fitted(model, "network_")
        return (EstimatorLearner if learns else EstimatorWriter)(model, name)
    if isinstance(model, SDNNKernelRidge | SDNNKernelClassifier):
        expected = "be False for kernel estimators, which do not learn online"
        require(not learns, "learning", expected, learns)
        check_is_fitted(model, "dual_coef_")
        return KernelWriter(model, name)
    expected = "must be an estimator of sdnn, such as an SDNNRegressor"
    raise argument_error("model", f"{expected}, got {shown(model)}", TypeError)
