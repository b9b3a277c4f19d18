"""Draws the figures and prints the tables of docs/regression.md: figures.py ROWS_FOLDER DOCS.

Figures of rows are drawn from rows only. The picture of the demonstration problem shows one
network, trained here in a few seconds.
"""

from __future__ import annotations

import csv
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib as mpl
import numpy as np
from compare import ours
from demonstration import BLANKS, N_TRAINING, errors, lattice, target, training_points
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy import stats

from sdnn import kernel
from sdnn.coding import Anchor, Circular, RandomInverse

COLORS = {
    "SDNN (ours)": ("#1f5a96", "o"),
    "SVR (RBF)": ("#c2542d", "s"),
    "Gaussian process (Matern 3/2)": ("#3c7d4b", "D"),
    "gradient boosting": ("#7b5aa6", "^"),
    "MLP 256-256": ("#8a6d1d", "v"),
}


def rows_of(path):
    with Path(path).open(newline="") as file:
        return list(csv.DictReader(file))


def demonstration_figure():
    """Target with the sample, prediction, and error."""
    points = lattice()
    X = training_points(N_TRAINING, seed=0)
    model = ours(8000, 300, 0).fit(X, target(X))
    predicted = model.predict(points)
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
    """Correlations with the middle bin, for three codings of numbers."""
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
    """Error against the number of useless inputs; single seeds as dots, means as lines."""
    found = defaultdict(lambda: defaultdict(list))
    for row in rows:
        found[row["system"]][int(row["n_useless"])].append(float(row["rmse"]))
    figure = Figure(figsize=(6.6, 3.8), layout="constrained")
    axes = figure.subplots()
    for shift, (name, (color, marker)) in enumerate(COLORS.items()):
        numbers = sorted(found[name])
        means = [np.mean(found[name][number]) for number in numbers]
        axes.plot(numbers, means, color=color, marker=marker, markersize=5, label=name)
        for number in numbers:
            values = found[name][number]
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


def demonstration_table(rows):
    print("\n| system | RMSE all | data | blank |\n|---|---|---|---|")
    found = defaultdict(list)
    for row in rows:
        found[row["system"]].append(row)
    for name, group in sorted(found.items(), key=lambda item: mean_of(item[1], "all")):
        wrong = [spread_of(group, key) for key in ("all", "data", "blank")]
        print("|", " | ".join([name, *wrong]), "|")


def mean_of(group, key):
    return float(np.mean([float(row[key]) for row in group]))


def spread_of(group, key):
    values = [float(row[key]) for row in group]
    text = f"{np.mean(values):.4f}"
    return f"{text} +- {np.std(values, ddof=1):.4f}" if len(values) > 1 else text


def useless_table(rows):
    print("\n| system | 0 | 2 | 4 | 8 |\n|---|---|---|---|---|")
    for name in COLORS:
        cells = []
        for number in (0, 2, 4, 8):
            group = [
                row for row in rows if row["system"] == name and int(row["n_useless"]) == number
            ]
            cells.append(spread_of(group, "rmse") if group else "")
        print("|", " | ".join([name, *cells]), "|")


def real_table(rows):
    """Means over folds; 95 % intervals with Nadeau and Bengio's correction for shared samples."""
    found = defaultdict(list)
    for row in rows:
        found[row["data"], row["system"]].append(float(row["score"]))
    for data in dict.fromkeys(row["data"] for row in rows):
        print(f"\n| {data} | mean | 95 % interval | folds |\n|---|---|---|---|")
        names = [name for where, name in found if where == data]
        for name in sorted(names, key=lambda name: -np.mean(found[data, name])):
            scores = np.array(found[data, name])
            variance = scores.var(ddof=1) * (1 / len(scores) + 1 / 4)
            half = stats.t.ppf(0.975, len(scores) - 1) * np.sqrt(variance)
            mean = scores.mean()
            interval = f"{mean - half:.3f} to {mean + half:.3f}"
            print(f"| {name} | {mean:.3f} | {interval} | {len(scores)} |")


if __name__ == "__main__":
    source, docs = map(Path, sys.argv[1:])
    mpl.rcParams["font.size"] = 9
    useless = rows_of(source / "regression-useless.csv")
    for name, figure in {
        "regression-demonstration": demonstration_figure(),
        "regression-kernels": kernel_figure(),
        "regression-useless": useless_figure(useless),
    }.items():
        figure.savefig(docs / f"{name}.png", dpi=140)
    demonstration_table(rows_of(source / "regression-demonstration.csv"))
    useless_table(useless)
    real_table(rows_of(source / "regression-real.csv"))
