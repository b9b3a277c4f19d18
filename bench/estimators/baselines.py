"""The systems of the comparisons, each with a small grid that cross-validation chooses from."""

from __future__ import annotations

import copy

import numpy as np
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin
from sklearn.ensemble import (
    HistGradientBoostingClassifier,
    HistGradientBoostingRegressor,
    RandomForestClassifier,
    RandomForestRegressor,
)
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.metrics import accuracy_score, r2_score
from sklearn.model_selection import GridSearchCV, train_test_split
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC, SVR

from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse
from sdnn.coding.kernel import AnalyticKernel

INNER_FOLDS = 3


class AnalyticKernelRidge(RegressorMixin, BaseEstimator):
    """Kernel ridge regression with the network's kernel for infinitely long codes."""

    def __init__(self, length_scale=0.1, alpha=1e-3):
        self.length_scale = length_scale
        self.alpha = alpha

    def fit(self, X, y):
        n_bins = 1000
        coding = RandomInverse(length_scale=self.length_scale, n_bins=n_bins)
        codings = [coding.fit(column, 100_000) for column in X.T]
        self.kernel_ = AnalyticKernel(codings, n_units=100_000)
        self.X_, self.mean_ = X, y.mean()
        self.ridge_ = KernelRidge(kernel="precomputed", alpha=self.alpha)
        self.ridge_.fit(self.kernel_(X), y - self.mean_)
        return self

    def predict(self, X):
        parts = np.array_split(X, max(1, len(X) // 20000))
        return self.mean_ + np.concatenate(
            [self.ridge_.predict(self.kernel_(part, self.X_)) for part in parts]
        )


class WithClasses(ClassifierMixin, BaseEstimator):
    """A classifier of whole numbers, for labels of any type."""

    def __init__(self, model):
        self.model = model

    def fit(self, X, y):
        self.classes_, numbers = np.unique(y, return_inverse=True)
        self.model_ = copy.deepcopy(self.model).fit(X, numbers)  # CatBoost's cannot be cloned
        return self

    def predict(self, X):
        return self.classes_[np.asarray(self.model_.predict(X)).reshape(-1)]

    def predict_proba(self, X):
        return self.model_.predict_proba(X)


class RecursiveFeatureMachine(BaseEstimator):
    """xRFM with default settings; a fifth of the sample decides when it stops."""

    def __init__(self, is_classifier=False, seed=0):
        self.is_classifier = is_classifier
        self.seed = seed

    def fit(self, X, y):
        from xrfm import xRFM  # which needs PyTorch, but stored results do not

        self.scaler_ = StandardScaler().fit(X)
        if self.is_classifier:
            self.classes_, targets = np.unique(y, return_inverse=True)
        else:
            self.mean_, self.width_ = np.mean(y), np.std(y)
            targets = (np.asarray(y, dtype=float) - self.mean_) / self.width_
        X, X_held, y, y_held = train_test_split(
            self._inputs(X), targets, test_size=0.2, random_state=self.seed,
            stratify=targets if self.is_classifier else None,
        )  # fmt: skip
        metric = "accuracy" if self.is_classifier else "mse"
        self.model_ = xRFM(
            device="cpu", tuning_metric=metric, n_threads=1, random_state=self.seed, verbose=False
        )
        self.model_.fit(X, y, X_held, y_held)
        return self

    def _inputs(self, X):
        return self.scaler_.transform(X).astype(np.float32)

    def predict_proba(self, X):
        return np.asarray(self.model_.predict_proba(self._inputs(X)))

    def predict(self, X):
        if self.is_classifier:
            return self.classes_[self.predict_proba(X).argmax(axis=1)]
        return (
            np.asarray(self.model_.predict(self._inputs(X))).reshape(-1) * self.width_ + self.mean_
        )

    def score(self, X, y):
        score = accuracy_score if self.is_classifier else r2_score
        return score(y, self.predict(X))


def codings(*length_scales):
    return [RandomInverse(length_scale=length_scale) for length_scale in length_scales]


def gaussian_process(n_inputs, noise):
    scales = np.ones(n_inputs)
    kernel = ConstantKernel() * Matern(scales, (1e-2, 1e3), nu=1.5)
    kernel += WhiteKernel(noise, (1e-8, 1e1))
    return make_pipeline(
        StandardScaler(), GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    )


def scaled(model):
    return make_pipeline(StandardScaler(), model)


def tuned(model, grid):
    """Return the model with the best of a grid by cross-validation, refitted on everything."""
    return GridSearchCV(model, grid, cv=INNER_FOLDS) if grid else model


def regressors(n_inputs, noisy, seed):
    """Name to (model, grid). ``noisy``: whether targets have noise, so grids look elsewhere."""
    lengths = (0.25, 0.5, 1.0) if noisy else (0.05, 0.1, 0.2)
    epochs = (5, 10) if noisy else (300,)
    mlp = MLPRegressor(
        hidden_layer_sizes=(256, 256),
        max_iter=300 if noisy else 2000,
        n_iter_no_change=20 if noisy else 100,
        tol=1e-4 if noisy else 1e-6,
        random_state=seed,
    )
    return {
        "SDNN (ours)": (
            SDNNRegressor(random_state=seed),
            {"coding": codings(*lengths), "max_iter": epochs},
        ),
        "kernel ridge, analytic SDNN kernel": (
            AnalyticKernelRidge(),
            {
                "length_scale": lengths,
                "alpha": (0.1, 0.3, 1.0, 3.0) if noisy else (1e-4, 1e-3, 1e-2),
            },
        ),
        "SVR (RBF)": (
            scaled(SVR(epsilon=0.1 if noisy else 0.005)),
            {
                "svr__C": (10, 30, 100, 300) if noisy else (1, 10, 100),
                "svr__gamma": (0.003, 0.01, 0.03) if noisy else (1, 3, 10),
            },
        ),
        "Gaussian process (Matern 3/2)": (gaussian_process(n_inputs, 1.0 if noisy else 1e-4), {}),
        "MLP 256-256": (
            scaled(mlp),
            # Without noise it is given more iterations instead of a grid.
            {"mlpregressor__alpha": (1.0, 10.0, 100.0)} if noisy else {},
        ),
        "random forest": (
            RandomForestRegressor(300, random_state=seed),
            {"min_samples_leaf": (1, 3, 10) if noisy else (1,), "max_features": (0.3, 1.0)},
        ),
        "gradient boosting": (
            HistGradientBoostingRegressor(random_state=seed),
            {"learning_rate": (0.03, 0.1), "max_leaf_nodes": (4, 15) if noisy else (15, 31)},
        ),
        "linear ridge": (scaled(Ridge()), {"ridge__alpha": (1, 10, 100)}),
    }


def classifiers(seed):
    """Return (model, grid) by name."""
    return {
        "SDNN (ours)": (
            SDNNClassifier(random_state=seed),
            {"coding": codings(0.25, 0.5, 1.0), "scheme": ("one_vs_rest", "one_vs_one")},
        ),
        "SVM (RBF)": (
            scaled(SVC()),
            {"svc__C": (1, 10, 100), "svc__gamma": (0.003, 0.01, 0.03)},
        ),
        "MLP 256-256": (
            scaled(MLPClassifier(hidden_layer_sizes=(256, 256), max_iter=300, random_state=seed)),
            {"mlpclassifier__alpha": (1e-3, 0.1, 1.0)},
        ),
        "random forest": (
            RandomForestClassifier(300, random_state=seed),
            {"min_samples_leaf": (1, 3), "max_features": ("sqrt", 0.3)},
        ),
        "gradient boosting": (
            HistGradientBoostingClassifier(random_state=seed),
            {"learning_rate": (0.03, 0.1), "max_leaf_nodes": (4, 15)},
        ),
        "logistic regression": (
            scaled(LogisticRegression(max_iter=1000)),
            {"logisticregression__C": (0.03, 0.1, 1.0)},
        ),
    }
