"""Streams that drift, each sample predicted and then learned, beside the models of river.

    python bench/estimators/streams.py [--seeds 10] [--only WORD] [--redraw]

Measures what the store lacks, draws streams.png and writes the table of streams.md, both
in docs/evidence. Needs sdnn[river].
"""

from __future__ import annotations

import sys
import time
import warnings
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from measured import measure_missing, measured, options
from page import markdown, show
from river import datasets, dummy, forest, linear_model, neighbors, preprocessing, stats, tree
from river.datasets import synth
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

from sdnn import SDNNRegressor
from sdnn.estimators.river import RiverRegressor
from sdnn.files import write_whole
from sdnn.plots import png_bytes

KIND = "streams"
N_SAMPLES = 4000
N_WINDOWS = 20
N_FIRST = 100
"""Samples whose predictions do not count: all models know next to nothing."""


# Streams: pairs of a dictionary and a target, from a seed.


def wave(seed):
    """A wave over three inputs, one of them useless, that turns and grows quicker by and by."""
    random = np.random.RandomState(seed)
    for number in range(N_SAMPLES):
        a, b, c = random.uniform(-1, 1, 3)
        angle = 2 * np.pi * number / N_SAMPLES
        along = a * np.cos(angle) + b * np.sin(angle)
        target = np.sin((3 + 3 * number / N_SAMPLES) * along) + 0.1 * random.normal()
        yield {"a": a, "b": b, "c": c}, target


def friedman(seed):
    return synth.Friedman(seed=seed).take(N_SAMPLES)


def drifting_friedman(kind, *positions):
    def stream(seed):
        options = {"transition_window": N_SAMPLES // 8} if kind == "gsg" else {}
        return synth.FriedmanDrift(kind, positions, seed=seed, **options).take(N_SAMPLES)

    return stream


def numbers(stream):
    for x, y in stream:
        yield {name: float(value) for name, value in x.items()}, float(y)


STREAMS = {
    "Friedman": friedman,
    "Friedman, gradual drift": drifting_friedman("gsg", N_SAMPLES // 3, 2 * N_SAMPLES // 3),
    "Friedman, abrupt drift": drifting_friedman("gra", N_SAMPLES // 3, 2 * N_SAMPLES // 3),
    "turning wave": wave,
    "Trump approval": lambda seed: numbers(datasets.TrumpApproval()),
    "chick weights": lambda seed: numbers(datasets.ChickWeights()),
}
"""The last two are measured data, the same for every seed; models still depend on it."""

# Models, each from a seed, with the defaults of its library.


class Perceptron:
    """scikit-learn's MLP by river's interface, two hidden layers, one gradient step a sample."""

    def __init__(self, seed):
        self.scaler = preprocessing.StandardScaler()
        self.target = preprocessing.StandardScaler()
        self.model = MLPRegressor(
            hidden_layer_sizes=(64, 64), learning_rate_init=3e-3, random_state=seed
        )
        self.is_fitted = False

    def _row(self, x):
        return np.array([list(self.scaler.transform_one(x).values())])

    def predict_one(self, x):
        if not self.is_fitted:
            return 0.0
        return self.model.predict(self._row(x))[0] * self._width() + self.target.means["y"]

    def learn_one(self, x, y):
        self.scaler.learn_one(x)
        self.target.learn_one({"y": y})
        scaled = (y - self.target.means["y"]) / self._width()
        self.model.partial_fit(self._row(x), [scaled])
        self.is_fitted = True

    def _width(self):
        return max(self.target.vars["y"], 1e-12) ** 0.5


def scaled(model):
    return preprocessing.StandardScaler() | model


def ours(seed, **options):
    return RiverRegressor(SDNNRegressor(out_of_range="widen", random_state=seed, **options))


MODELS = {
    "SDNN": ours,
    "SDNN, n_pattern_units=64": lambda seed: ours(seed, n_pattern_units=64),
    "adaptive random forest": lambda seed: forest.ARFRegressor(seed=seed),
    "Mondrian forest (AMF)": lambda seed: forest.AMFRegressor(seed=seed),
    "Hoeffding adaptive tree": lambda seed: tree.HoeffdingAdaptiveTreeRegressor(seed=seed),
    "nearest neighbours": lambda seed: scaled(neighbors.KNNRegressor()),
    "MLP 64-64": Perceptron,
    "linear regression": lambda seed: scaled(linear_model.LinearRegression()),
    "recent mean": lambda seed: dummy.StatisticRegressor(stats.EWMean()),
}


def measure(stream, name, seed):
    """R2, the squared errors of windows as shares of the variance, and microseconds a sample."""
    model = MODELS[name](seed)
    errors, targets, times = [], [], []
    for x, y in STREAMS[stream](seed):
        begin = time.perf_counter()
        guess = model.predict_one(x)
        model.learn_one(x, y)
        times.append(time.perf_counter() - begin)
        errors.append((guess or 0.0) - y)  # some say None before they have learned anything
        targets.append(y)
    squares = np.square(errors[N_FIRST:]) / np.var(targets[N_FIRST:])
    windows = [float(f"{part.mean():.4g}") for part in np.array_split(squares, N_WINDOWS)]
    us = round(1e6 * float(np.median(times)), 1)
    return {"r2": round(float(1 - squares.mean()), 5), "us": us, "windows": windows}


# What is drawn of the measurements.


def interval(values):
    """Median, and the middle eight tenths of the seeds."""
    low, middle, high = np.quantile(values, (0.1, 0.5, 0.9))
    told = ["< -10" if value < -10 else f"{value:.2f}" for value in (middle, low, high)]
    return told[0] + (f" [{told[1]}, {told[2]}]" if high - low >= 0.005 else "")


def table(found):
    """R2 of every stream and model, and the time of a sample."""

    def scores(stream, model):
        return [row["r2"] for row in found[stream, model]]

    best = {
        stream: max(MODELS, key=lambda model: np.median(scores(stream, model)))
        for stream in STREAMS
    }
    rows = []
    for model in MODELS:
        cells = [interval(scores(stream, model)) for stream in STREAMS]
        bold = (f"**{c}**" if best[s] == model else c for s, c in zip(STREAMS, cells, strict=True))
        times = [row["us"] for stream in STREAMS for row in found[stream, model]]
        rows.append((model, *bold, f"{np.median(times):,.0f}"))
    n_seeds = min(map(len, found.values()))
    note = f"*R2 of the predictions, medians of {n_seeds} seeds; in brackets the middle 80 %."
    return markdown(("model", *STREAMS, "us a sample"), rows) + f"\n{note} Best in bold.*\n"


def draw(found, path):
    shown = ("SDNN", "adaptive random forest", "MLP 64-64", "Mondrian forest (AMF)")
    colors = ("#1f5fa8", "#d9822b", "#5b8c5a", "#a05195")
    figure = Figure(figsize=(10, 5.6), layout="constrained")
    for axes, stream in zip(figure.subplots(2, 3).flat, STREAMS, strict=True):
        for model, color in zip(shown, colors, strict=True):
            windows = np.array([row["windows"] for row in found[stream, model]])
            low, middle, high = np.quantile(windows, (0.1, 0.5, 0.9), axis=0)
            x = (np.arange(len(middle)) + 0.5) / len(middle)
            axes.fill_between(x, low, high, color=color, alpha=0.15, linewidth=0)
            axes.plot(x, middle, color=color, label=model, linewidth=1.6)
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_title(stream, loc="left", fontsize=10)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_xlabel("share of the stream", fontsize=8)
        axes.tick_params(labelsize=8)
    figure.axes[0].set_ylabel("squared error / variance", fontsize=8)
    figure.axes[3].set_ylabel("squared error / variance", fontsize=8)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center",
                  ncols=len(shown), frameon=False, fontsize=9)  # fmt: skip
    write_whole(path, png_bytes(figure))


def main():
    given = options(__doc__, seeds=10).parse_args()
    keys = [(s, m, seed) for seed in range(given.seeds) for s in STREAMS for m in MODELS]
    measure_missing(KIND, measure, keys, given)
    if given.only:
        return
    found = defaultdict(list)
    for (stream, model, _), row in measured(KIND, given.folder).items():
        found[stream, model].append(row)
    draw(found, given.folder / "streams.png")
    show({"R2": table(found)}, given.folder / "streams.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore", ConvergenceWarning)
    main()
