"""The network as scikit-learn estimators; needs scikit-learn.

Names are loaded when they are first used, so that ``import sdnn`` needs no scikit-learn.
"""

from __future__ import annotations

from sdnn.support.lazy import attach

_load, __dir__, __all__ = attach(
    __name__,
    {
        "sdnn.estimators.base": "OutOfRangeWarning",
        "sdnn.estimators.classifier": "SDNNClassifier",
        "sdnn.estimators.kernel_ridge": "SDNNKernelClassifier SDNNKernelRidge",
        "sdnn.estimators.outliers": "OutlierWarning",
        "sdnn.estimators.regressor": "SDNNRegressor",
    },
)


def __getattr__(name: str) -> object:
    """Import a public class when it is first used; name the package to install if it is missing."""
    try:
        return _load(name)
    except ModuleNotFoundError as error:
        module = (error.name or "sdnn").partition(".")[0]
        if module == "sdnn":
            raise
        package = "scikit-learn" if module in ("sklearn", "joblib") else module
        raise ModuleNotFoundError(
            f"{name} needs {package}: pip install {package}", name=error.name
        ) from error
