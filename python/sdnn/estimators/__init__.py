"""The network as scikit-learn estimators; needs scikit-learn.

Names are loaded when they are first used, so that ``import sdnn`` needs no scikit-learn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sdnn.lazy import attach

if TYPE_CHECKING:
    from sdnn.estimators.base import OutOfRangeWarning as OutOfRangeWarning
    from sdnn.estimators.classifier import SDNNClassifier as SDNNClassifier
    from sdnn.estimators.kernel_ridge import (
        SDNNKernelClassifier as SDNNKernelClassifier,
        SDNNKernelRidge as SDNNKernelRidge,
    )
    from sdnn.estimators.libsdnn import (
        read_model_file as read_model_file,
        read_parameter_file as read_parameter_file,
    )
    from sdnn.estimators.outliers import OutlierWarning as OutlierWarning
    from sdnn.estimators.regressor import SDNNRegressor as SDNNRegressor

_load, __dir__, __all__ = attach(globals())


def __getattr__(name: str) -> Any:
    try:
        return _load(name)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] == "sdnn":
            raise
        raise ModuleNotFoundError(
            f"{name} needs scikit-learn: pip install scikit-learn", name=error.name
        ) from error
