from sdnn.estimators.base import OutOfRangeWarning as OutOfRangeWarning
from sdnn.estimators.classifier import SDNNClassifier as SDNNClassifier
from sdnn.estimators.kernel_ridge import (
    SDNNKernelClassifier as SDNNKernelClassifier,
    SDNNKernelRidge as SDNNKernelRidge,
)
from sdnn.estimators.outliers import OutlierWarning as OutlierWarning
from sdnn.estimators.regressor import SDNNRegressor as SDNNRegressor
