"""Plots of fitted estimators; needs matplotlib."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from sdnn.arguments import require, whole
from sdnn.estimators.fitted import Fitted

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_importances(model: Fitted, n_most: int = 15) -> Figure:
    """Plot the importances of features and of pairs, both orders of a pair together.

    Parameters
    ----------
    model : SDNNRegressor or SDNNClassifier
        Fitted.
    n_most : int
        Features, and pairs, that are shown: the most important ones.
    """
    from matplotlib.figure import Figure

    expected = "be an SDNNRegressor or SDNNClassifier"
    require(isinstance(model, Fitted), "model", expected, model, TypeError)
    n_most = whole("n_most", n_most, 1, 1000)
    names = model._names_or_numbers()
    features = dict(zip(names, model.feature_importances_.tolist(), strict=True))
    pairs: Counter[str] = Counter()
    for pair, importance in zip(model.pairs_, model.pair_importances_.tolist(), strict=True):
        pairs[" x ".join(str(names[index]) for index in sorted(set(pair)))] += importance
    n_rows = min(n_most, max(len(features), len(pairs)))
    figure = Figure(figsize=(8.0, 1.0 + 0.22 * n_rows), layout="constrained")
    for axes, (of, shares) in zip(
        figure.subplots(1, 2), (("feature", features), ("pair", pairs)), strict=True
    ):
        most = Counter(shares).most_common(n_most)
        axes.barh([str(name) for name, _ in most], [share for _, share in most], color="tab:blue")
        axes.invert_yaxis()
        axes.set(xlabel=f"importance of the {of}")
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    return figure
