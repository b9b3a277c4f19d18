"""The figures of docs/how-to/regression.md, which compare.py and calibration.py draw."""

from __future__ import annotations

from collections import defaultdict

import matplotlib as mpl
import numpy as np
from demonstration import BLANKS, N_TRAINING, errors, lattice, target, training_points
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sdnn import SDNNKernelRidge, SDNNRegressor
from sdnn.coding import Anchor, Circular, RandomInverse, kernel
from sdnn.estimators.river import RiverRegressor

COLORS = {
    "SDNN (ours)": ("#1f5a96", "o"),
    "SVR (RBF)": ("#c2542d", "s"),
    "Gaussian process (Matern 3/2)": ("#3c7d4b", "D"),
    "gradient boosting": ("#7b5aa6", "^"),
    "MLP 256-256": ("#8a6d1d", "v"),
}


mpl.rcParams["font.size"] = 9


def demonstration_figure(model):
    """Draw the target with the sample, the prediction, and the error."""
    points = lattice()
    X = training_points(N_TRAINING, seed=0)
    predicted = model.fit(X, target(X)).predict(points)
    side = (1001, 1001)
    panels = (
        ("target and training sample", target(points), "viridis", (0, 1)),
        ("prediction", predicted, "viridis", (0, 1)),
        ("prediction minus target", predicted - target(points), "RdBu_r", (-0.5, 0.5)),
    )
    figure = Figure(figsize=(10.5, 3.2), layout="constrained")
    for axes, (title, values, colors, limits) in zip(
        figure.subplots(1, 3, sharey=True), panels, strict=True
    ):
        image = axes.imshow(
            values.reshape(side).T, origin="lower", extent=(0, 1, 0, 1), cmap=colors,
            vmin=limits[0], vmax=limits[1], interpolation="antialiased",
        )  # fmt: skip
        extend = "both" if title != "target and training sample" else "neither"
        figure.colorbar(image, ax=axes, shrink=0.9, extend=extend)
        for a, b, c, d in BLANKS:
            axes.add_patch(
                Rectangle((a, c), b - a, d - c, fill=False, edgecolor="black", linewidth=0.8)
            )
        axes.set(title=title, xlabel="x", xticks=(0, 0.5, 1), yticks=(0, 0.5, 1))
        if title == "target and training sample":
            axes.scatter(*X.T, s=1.2, color="white", linewidths=0)
            axes.set_ylabel("y")
    print("figure's network: RMSE all / data / blank", *errors(points, predicted))
    return figure


def kernel_figure():
    """Draw correlations with the middle bin, for three codings of numbers."""
    figure = Figure(figsize=(8.4, 2.9), layout="constrained")
    codings = (
        ("random-inverse, length scale 0.1", RandomInverse(length_scale=0.1), 0.5),
        ("anchor", Anchor(), 0.5),
        ("circular", Circular(period=1.0), 0.1),
    )
    for axes, (title, coding, at) in zip(figure.subplots(1, 3, sharey=True), codings, strict=True):
        drawn, expected = kernel.similarity(coding), kernel.correlations(coding)
        row = int(at * len(drawn))
        x = (np.arange(len(drawn)) + 0.5) / len(drawn)
        axes.plot(x, drawn[row], color="#1f5a96", linewidth=1.5, label="drawn, 2,000 units")
        axes.plot(x, expected[row], "--", color="black", linewidth=1, label="expected")
        axes.set(title=title, xlabel="value", xticks=(0, 0.5, 1), ylim=(-0.2, 1.05))
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("correlation of patterns")
    figure.axes[2].legend(frameon=False, fontsize=8, loc="upper right")
    return figure


def useless_figure(rows):
    """Draw error against the number of irrelevant inputs: seeds as dots, means as lines."""
    results = defaultdict(lambda: defaultdict(list))
    for (system, n_useless, _), row in rows.items():
        results[system][n_useless].append(row["rmse"])
    figure = Figure(figsize=(6.6, 3.8), layout="constrained")
    axes = figure.subplots()
    for shift, (name, (color, marker)) in enumerate(COLORS.items()):
        numbers = sorted(results[name])
        means = [np.mean(results[name][number]) for number in numbers]
        axes.plot(numbers, means, color=color, marker=marker, markersize=5, label=name)
        for number in numbers:
            values = results[name][number]
            if len(values) == 1:
                continue
            offset = (shift - 2) * 0.07
            axes.plot([number + offset] * len(values), values, ".", color=color, markersize=4,
                      alpha=0.5)  # fmt: skip
    axes.set(
        xlabel="useless inputs added to the two that matter", ylabel="RMSE", xticks=(0, 2, 4, 8)
    )
    axes.set_ylim(bottom=0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def noisy_waves(n_samples, seed):
    """Draw samples of a sine, with noise whose standard deviation grows from 0.05 to 0.55."""
    random = np.random.default_rng(seed)
    x = random.uniform(0, 1, n_samples)
    return x[:, None], np.sin(6 * x) + (0.05 + 0.5 * x) * random.normal(size=n_samples)


def interval_figure():
    """Draw intervals for 0.9 of the targets, of three models and of a stream."""
    X, y = noisy_waves(400, seed=0)
    X_new, y_new = noisy_waves(400, seed=1)
    grid = np.linspace(0, 1, 400)[:, None]
    figure = Figure(figsize=(10.5, 2.9), layout="constrained")
    panels = (
        ("SDNNKernelRidge", SDNNKernelRidge(), {}),
        ("SDNNKernelRidge, scaled=True", SDNNKernelRidge(), {"scaled": True}),
        ("SDNNRegressor(calibrate=True)", SDNNRegressor(calibrate=True, random_state=0), {}),
    )
    *first, last = figure.subplots(1, 4)
    for axes, (title, model, options) in zip(first, panels, strict=True):
        model.fit(X, y)
        draw_interval(axes, grid[:, 0], model.predict_interval(grid, **options).T)
        low, high = model.predict_interval(X_new, **options).T
        axes.plot(X_new[:, 0], y_new, ".", color="black", markersize=2)
        share = np.mean((low <= y_new) & (y_new <= high))
        axes.set_title(title, fontsize=9)
        axes.set(xlabel=f"input; {share:.2f} of new targets inside", ylim=(-3, 3))
    draw_stream(last)
    figure.axes[0].set_ylabel("target")
    return figure


def draw_interval(axes, x, bounds):
    axes.fill_between(x, *bounds, color="#9fc0e0", linewidth=0)
    axes.spines[["top", "right"]].set_visible(False)


def draw_stream(axes):
    """Draw intervals of a stream whose noise is four times as strong after 1,500 samples."""
    random = np.random.default_rng(0)
    network = SDNNRegressor(out_of_range="widen", random_state=0)
    model, bounds, targets = RiverRegressor(network), [], []
    for t in range(3000):
        x = {"a": random.uniform(), "b": random.uniform()}
        y = x["a"] + random.normal(scale=0.1 if t < 1500 else 0.4)
        interval = model.predict_one(x, with_interval=True)
        bounds.append((interval.lower - x["a"], interval.upper - x["a"]))
        targets.append(y - x["a"])
        model.learn_one(x, y)
    t = np.arange(100, 3000)
    low, high = np.array(bounds)[t].T
    draw_interval(axes, t, (low, high))
    axes.plot(t, np.array(targets)[t], ".", color="black", markersize=1)
    share = np.mean((low <= np.array(targets)[t]) & (np.array(targets)[t] <= high))
    axes.set_title("RiverRegressor, noise changes", fontsize=9)
    axes.set(xlabel=f"sample; {share:.2f} of targets inside", ylabel="target minus its mean",
             ylim=(-1.5, 1.5))  # fmt: skip
