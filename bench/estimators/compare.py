"""Measure and draw what docs/evidence/problems.md shows of tuned baselines.

    python bench/estimators/compare.py [--seeds 5] [--only WORD] [--redraw]

The demonstration problem, the same with useless inputs, and data of scikit-learn, beside baselines
that are tuned by cross-validation; and the network alone over 20 seeds. Tables are printed. The
picture of the demonstration problem shows one network, trained here in a few seconds.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from baselines import classifiers, regressors, tuned
from demonstration import N_TRAINING, errors, lattice, target, training_points
from figures import COLORS, demonstration_figure, kernel_figure, useless_figure
from measured import grouped, measure_missing, measured, options
from page import markdown
from scipy import stats
from sklearn.datasets import load_breast_cancer, load_diabetes
from sklearn.exceptions import ConvergenceWarning
from sklearn.model_selection import RepeatedKFold, RepeatedStratifiedKFold

from sdnn import SDNNRegressor, _core
from sdnn.coding import RandomInverse
from sdnn.reports.plots import png_bytes
from sdnn.support.files import write_whole

ONCE = (
    "kernel ridge, analytic SDNN kernel", "SVR (RBF)", "Gaussian process (Matern 3/2)",
    "MLP 256-256",
)  # fmt: skip
"""Systems that are fitted once: but for the MLP they have no randomness, and the sample is one."""
USELESS = (0, 2, 4, 8)


def ours(n_units, max_iter, seed):
    """Make a model with LIBSDNN's setting, or longer codes with the same share of flips."""
    coding = RandomInverse(n_bins=1001, n_flipped=round(5 * n_units / 2000), low=0.0, high=1.0)
    return SDNNRegressor(
        coding,
        n_pattern_units=n_units,
        tables="separate",
        output_range=(-0.2, 1.2),
        max_iter=max_iter,
        shuffle=False,
        random_state=seed,
    )


FIXED = {
    "SDNN, n = 2000, 300 epochs (LIBSDNN's setting)": 2000,
    "SDNN, n = 8000, 300 epochs": 8000,
}
"""Units of settings that are not tuned."""


def chosen(model):
    return str(getattr(model, "best_params_", "")).replace("\n", " ")


def timed_fit(model, X, y):
    """Return the fitted model, and the entries that every measurement of it has."""
    begin = time.process_time()
    model = model.fit(X, y)
    return model, {"train": round(time.process_time() - begin, 2), "chosen": chosen(model)}


# The measurements: keys, and what is measured of each.


def demonstration_keys(n_seeds):
    names = [*FIXED, *regressors(2, noisy=False, seed=0)]
    names = [name for name in names if name not in ("SDNN (ours)", "linear ridge")]
    return [
        (name, seed) for seed in range(n_seeds) for name in names if seed == 0 or name not in ONCE
    ]


def demonstration(name, seed):
    """Fit one training sample and predict the full lattice."""
    X = training_points(2000, seed=0)
    if name in FIXED:
        model, n_parts = ours(FIXED[name], 300, seed), 1
    else:
        model, n_parts = tuned(*regressors(2, noisy=False, seed=seed)[name]), 50
    model.fit(X, target(X))
    parts = np.array_split(lattice(), n_parts)
    wrong = errors(lattice(), np.concatenate([model.predict(part) for part in parts]))
    results = dict(zip(("all", "data", "blank"), (round(rmse, 5) for rmse in wrong), strict=True))
    return {**results, "chosen": chosen(model)}


def useless_keys(n_seeds):
    return [(name, n, seed) for seed in range(n_seeds) for n in USELESS for name in COLORS]


def useless(name, n_useless, seed):
    """Measure the demonstration problem with irrelevant inputs; a new sample for each seed."""
    random = np.random.RandomState(1000 + seed)
    train, test = training_points(1000, seed), training_points(4000, 500 + seed)
    noise, test_noise = random.uniform(size=(1000, 8)), random.uniform(size=(4000, 8))
    X, Z = np.hstack([train, noise[:, :n_useless]]), np.hstack([test, test_noise[:, :n_useless]])
    model = tuned(*regressors(2 + n_useless, noisy=False, seed=seed)[name])
    model, results = timed_fit(model, X, target(train))
    rmse = np.sqrt(np.mean((model.predict(Z) - target(test)) ** 2))
    return {**results, "rmse": round(float(rmse), 5)}


REAL = {
    "diabetes (R2)": (load_diabetes, RepeatedKFold),
    "breast cancer (accuracy)": (load_breast_cancer, RepeatedStratifiedKFold),
}
N_FOLDS, N_REPEATS = 5, 2


def real_candidates(data, n_inputs, seed):
    return regressors(n_inputs, noisy=True, seed=seed) if "R2" in data else classifiers(seed)


def real_keys():
    numbers = [(repeat, fold) for repeat in range(N_REPEATS) for fold in range(N_FOLDS)]
    names = {data: real_candidates(data, 1, 0) for data in REAL}
    return [(data, name, *n) for data in REAL for n in numbers for name in names[data]]


def real(data, name, repeat, fold):
    """Measure data of scikit-learn by nested cross-validation: 5 folds outside, 3 inside."""
    loader, splitter = REAL[data]
    X, y = loader(return_X_y=True)
    folds = splitter(n_splits=N_FOLDS, n_repeats=N_REPEATS, random_state=0).split(X, y)
    train, test = list(folds)[N_FOLDS * repeat + fold]
    model = tuned(*real_candidates(data, X.shape[1], repeat)[name])
    model, results = timed_fit(model, X[train], y[train])
    return {**results, "score": round(float(model.score(X[test], y[test])), 5)}


LOW, STEP, N_UNITS, N_EPOCHS, N_CODES = -0.2, 0.005, 280, 300, 20


def bins(points):
    """Return the bins of points, which are multiples of 0.001."""
    return np.rint(1000 * points).astype(np.int32)


def seeds(n_pattern_units, seed):
    """Measure a network with the sample and the code of a seed, and its processor seconds."""
    points = training_points(N_TRAINING, seed)
    n_flipped = round(5 * n_pattern_units / 2000)  # r / n as in LIBSDNN's setting
    tables = [
        _core.random_inverse_patterns(n_pattern_units, 1001, n_flipped, 4 * seed + k)
        for k in range(4)
    ]
    code = _core.SelectiveDesensitization(tables[:2], tables[2:], np.array([[0, 1], [1, 0]]))
    layer = _core.ParallelPerceptron(code, N_UNITS, seed=seed)
    counts = (target(points)[:, None] - LOW) / STEP
    start = time.process_time()
    trainer = _core.PDeltaTrainer(layer, bins(points), counts)
    for _ in range(N_EPOCHS):
        trainer.present(np.arange(N_TRAINING))
    trainer.synchronize()
    trained = time.process_time()
    predicted = STEP * layer.counts(bins(lattice()))[:, 0] + LOW
    times = {"train_s": trained - start, "predict_s": time.process_time() - trained}
    wrong = dict(zip(("all", "data", "blank"), errors(lattice(), predicted), strict=True))
    return {
        "training": trainer.form,
        **{name: round(value, 3) for name, value in times.items()},
        **{name: round(value, 5) for name, value in wrong.items()},
    }


# The tables.


def spread_of(group, name):
    values = [row[name] for row in group]
    text = f"{np.mean(values):.4f}"
    return f"{text} +- {np.std(values, ddof=1):.4f}" if len(values) > 1 else text


def demonstration_table(results):
    wrong = ("all", "data", "blank")
    by_error = sorted(results.items(), key=lambda item: np.mean([row["all"] for row in item[1]]))
    rows = [(name, *(spread_of(group, key) for key in wrong)) for (name,), group in by_error]
    return markdown(("system", "RMSE all", "data", "blank"), rows)


def useless_table(results):
    rows = [(name, *(spread_of(results[name, n], "rmse") for n in USELESS)) for name in COLORS]
    return markdown(("system", *map(str, USELESS)), rows)


def real_tables(results):
    """Yield tables of means over folds; intervals have Nadeau and Bengio's correction."""
    for data in REAL:
        rows = []
        for (where, name), group in results.items():
            if where != data:
                continue
            scores = np.array([row["score"] for row in group])
            variance = scores.var(ddof=1) * (1 / len(scores) + 1 / 4)
            half = stats.t.ppf(0.975, len(scores) - 1) * np.sqrt(variance)
            mean = scores.mean()
            interval = f"{mean - half:.3f} to {mean + half:.3f}"
            rows.append((name, f"{mean:.3f}", interval, str(len(scores))))
        rows.sort(key=lambda row: row[1], reverse=True)
        yield markdown((data, "mean", "95 % interval", "folds"), rows)


def seeds_table(results):
    names = ("all", "data", "blank")
    seconds = ("train_s", "predict_s")
    rows = [
        (str(n), *(spread_of(group, name) for name in names),
         *(f"{np.median([row[name] for row in group]):.2f}" for name in seconds))
        for (n,), group in results.items()
    ]  # fmt: skip
    return markdown(("units a pattern", *(f"RMSE {n}" for n in names), *seconds), rows)


def main():
    arguments = options(__doc__, seeds=5).parse_args()
    codes = [(n, seed) for n in (2000, 8000) for seed in range(1, N_CODES + 1)]
    for kind, measure, keys in (
        ("demonstration", demonstration, demonstration_keys(arguments.seeds)),
        ("useless", useless, useless_keys(arguments.seeds)),
        ("real", real, real_keys()),
        ("seeds", seeds, codes),
    ):
        measure_missing(f"regression {kind}", measure, keys, arguments)
    if arguments.only:
        return
    folder = arguments.folder
    print(demonstration_table(grouped("regression demonstration", folder)))
    print(useless_table(grouped("regression useless", folder)))
    print(*real_tables(grouped("regression real", folder, n_dropped=2)), sep="\n")
    print(seeds_table(grouped("regression seeds", folder)))
    network = ours(8000, N_EPOCHS, 0)
    for name, figure in {
        "demonstration": demonstration_figure(network),
        "kernels": kernel_figure(),
        "useless": useless_figure(measured("regression useless", folder)),
    }.items():
        write_whole(folder / f"regression-{name}.png", png_bytes(figure, dpi=140))


if __name__ == "__main__":
    warnings.simplefilter("ignore", ConvergenceWarning)
    main()
