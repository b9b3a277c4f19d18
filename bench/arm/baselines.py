"""Measure models on boards beside those of other tools, and write docs/evidence/boards.md.

    pip install emlearn micromlgen
    git clone https://github.com/rl-tools/rl-tools
    python bench/arm/baselines.py --rl-tools rl-tools [--redraw]

It measures what docs/evidence/boards.json lacks, and needs what tests/boards needs, and
libstdc++-arm-none-eabi-picolibc.
Trees and networks of scikit-learn are those with the best scores of four-fold cross-validation
among those that take at most 128 kB of the micro:bit's flash. Ours have `small_settings`.
"""

import argparse
import contextlib
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from firmware import MEASURED, Firmware, measure
from pendulum_agents import pendulum_agents, rl_tools_actor, rl_tools_training
from sklearn.datasets import load_breast_cancer, load_wine, make_friedman1
from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor
from sklearn.metrics import r2_score
from sklearn.model_selection import GridSearchCV, train_test_split
from sklearn.neural_network import MLPClassifier, MLPRegressor

from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.export import estimator_header, small_settings

sys.path.insert(0, str(Path(__file__).parents[1]))
from page import markdown, show

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
STORE, PAGE = EVIDENCE / "boards.json", EVIDENCE / "boards.md"
MOST_FLASH = 128 * 1024
FORESTS = {
    "n_estimators": [10, 30, 60],
    "max_leaf_nodes": [16, 64, 128],
    "max_features": [1.0, "sqrt"],
}
NETWORKS = {
    "hidden_layer_sizes": [(16,), (64,), (32, 32)],
    "alpha": [1e-3, 1e-1],
}


def friedman():
    X, y = make_friedman1(2000, 5, noise=1.0, random_state=5)
    return X[:, :4], y - 5 * X[:, 4]


def pendulum():
    """Return states of a pendulum with friction and a motor, and its acceleration with noise."""
    random = np.random.default_rng(5)
    high = np.array([np.pi, 8, 2, 0.5])
    X = random.uniform(-high, high, (2000, 4))
    y = 15 * np.sin(X[:, 0]) + 3 * X[:, 2] - (0.6 + X[:, 3]) * X[:, 1]
    return X, y + 0.5 * random.normal(size=len(y))


def cancer():
    data = load_breast_cancer()
    return data.data[:, :10], data.target


def wine():
    return load_wine(return_X_y=True)


PROBLEMS = {
    "Friedman 1, 4 inputs": friedman, "pendulum, 4 inputs": pendulum,
    "breast cancer, 10 inputs": cancer, "wine, 13 inputs": wine,
}  # fmt: skip


class Problem:
    """Training and test data, and a model's score."""

    def __init__(self, name):
        X, y = PROBLEMS[name]()
        self.name, self.is_regression = name, y.dtype.kind == "f"
        self.X, self.test_X, self.y, self.test_y = train_test_split(
            X, y, test_size=0.5 if self.is_regression else 0.3, random_state=0
        )
        self.low, self.high = self.X.min(axis=0), self.X.max(axis=0)

    @property
    def n_inputs(self):
        return self.X.shape[1]

    def integers(self, X):
        """Return inputs in 16 bits, as emlearn recommends for trees."""
        share = (X - self.low) / (self.high - self.low)
        return np.clip(np.round(30_000 * share), -32_000, 32_000).astype(np.int16)

    def standardized(self, X):
        return ((X - self.X.mean(axis=0)) / self.X.std(axis=0)).astype(np.float32)

    def score(self, outputs):
        """Return R2, or the share of right classes."""
        if self.is_regression:
            return r2_score(self.test_y, outputs)
        return float(np.mean(outputs == self.test_y))


def calling(call, begin="(void)0"):
    """Return what calls a model."""
    return f"\n#define BEGIN {begin}\n#define CALL(in, out) {call}\n"


def ours(problem):
    """Yield our models' names and firmware."""
    n, n_classes = problem.n_inputs, len(np.unique(problem.y))
    if problem.is_regression:
        model = SDNNRegressor(**small_settings(n), random_state=0)
        result, dtype, predict = "double y", "<f8", "model_predict({}in.x, &out.y)"
        learn = f"model_learn(&model, in.x, in.x + {n})"
    else:
        model = SDNNClassifier(**small_settings(n, n_classes=n_classes), random_state=0)
        result, dtype, predict = "int32_t y", "<i4", "out.y = model_predict({}in.x)"
        learn = f"model_learn(&model, in.x, (uint32_t)model_fixed(in.x[{n}], 0))"
    model.fit(problem.X, problem.y)
    rows = np.column_stack([problem.test_X, problem.test_y]).astype("<f8")
    for learning, name in enumerate(("sdnn", "sdnn, predicts and learns")):
        text = estimator_header(model, "model", learning=bool(learning)).text
        call, begin = predict.format(""), "(void)0"
        if learning:
            text += "static model_model model;"
            call, begin = f"{predict.format('&model, ')}, {learn}", "model_begin(&model)"
        text += calling(f"(void)({call})", begin)
        yield name, Firmware(f"double x[{n + 1}]", result, text, rows, dtype)


def forests(problem, X):
    """Yield forests for these inputs, the one with the best score first."""
    kind = RandomForestRegressor if problem.is_regression else RandomForestClassifier
    return by_score(kind(random_state=0), FORESTS, X, problem.y)


def by_score(model, grid, X, y):
    """Yield a model with settings of a grid, those with the best cross-validated score first."""
    search = GridSearchCV(model, grid, cv=4, refit=False).fit(X, y)
    for index in np.argsort(search.cv_results_["rank_test_score"], kind="stable"):
        yield model.set_params(**search.cv_results_["params"][index]).fit(X, y)


def emlearn_forests(problem):
    import emlearn

    for model in forests(problem, problem.integers(problem.X)):
        converted = emlearn.convert(model, method="inline", dtype="int16_t")
        result, dtype = ("float y", "<f4") if problem.is_regression else ("int32_t y", "<i4")
        text = converted.save(name="f") + calling(f"out.y = f_predict(in.x, {problem.n_inputs})")
        rows = problem.integers(problem.test_X)
        row = f"int16_t x[{problem.n_inputs}]"
        yield Firmware(row, result, text, rows, dtype, options=_of_emlearn())


def emlearn_networks(problem):
    import emlearn

    X, y = problem.standardized(problem.X), problem.y
    mean, size = (y.mean(), y.std()) if problem.is_regression else (0, 1)
    kind = MLPRegressor if problem.is_regression else MLPClassifier
    targets = (y - mean) / size if problem.is_regression else y
    for model in by_score(kind(max_iter=2000, random_state=0), NETWORKS, X, targets):
        n = problem.n_inputs
        if problem.is_regression:
            converted = emlearn.convert(model, method="loadable", return_type="regressor")
            call, result, dtype = (
                f"{mean:.9g}f + {size:.9g}f * f_regress1(in.x, {n})",
                "float",
                "<f4",
            )
        else:
            converted = emlearn.convert(model, method="loadable")
            call, result, dtype = f"f_predict(in.x, {n})", "int32_t", "<i4"
        text = converted.save(name="f") + calling(f"out.y = {call}")
        rows = problem.standardized(problem.test_X)
        yield Firmware(f"float x[{n}]", f"{result} y", text, rows, dtype, options=_of_emlearn())


def _of_emlearn():
    import emlearn

    return ("-isystem", emlearn.includedir)


def micromlgen_forests(problem):
    import micromlgen

    for model in forests(problem, problem.X.astype(np.float32)):
        result, dtype = ("float", "<f4") if problem.is_regression else ("int", "<i4")
        kind = "RandomForestRegressor" if problem.is_regression else "RandomForest"
        text = micromlgen.port(model).replace("<cstdarg>", "<stdint.h>")
        text += f"static Eloquent::ML::Port::{kind} forest;\n"
        text += f'extern "C" {result} predict(float *x) {{ return forest.predict(x); }}\n'
        call = f"{result} predict(float *x);{calling('out.y = predict(in.x)')}"
        row, rows = f"float x[{problem.n_inputs}]", problem.test_X.astype("<f4")
        yield Firmware(row, f"{result} y", call, rows, dtype, cpp=text)


OTHERS = {
    "emlearn, forest": emlearn_forests,
    "emlearn, MLP": emlearn_networks,
    "micromlgen, forest": micromlgen_forests,
}


def rows_of(name, firmware, folder, outputs_to_score):
    """Return what a model takes on each board."""
    measured = {board: measure(firmware, board, folder / board) for board in MEASURED}
    outputs, *others = (outputs for _, outputs in measured.values() if outputs is not None)
    if name.startswith("sdnn"):
        assert all(np.array_equal(outputs, other) for other in others)
    boards = {board: cost for board, (cost, _) in measured.items()}
    return {"model": name, "score": outputs_to_score(outputs), "boards": boards}


def measure_problem(name, folder):
    """Yield rows of the models of a problem."""
    problem = Problem(name)
    for model, firmware in ours(problem):
        yield {"problem": name, **rows_of(model, firmware, folder, problem.score)}
    for model, candidates in OTHERS.items():
        for firmware in candidates(problem):
            row = rows_of(model, firmware, folder, problem.score)
            cost = row["boards"]["cortex-m0"]
            if cost and cost["flash"] <= MOST_FLASH:
                break
        yield {"problem": name, **row}


def measure_agents(rl_tools, folder):
    """Yield rows of our agents for the pendulum, and of rl-tools'."""
    for name, firmware, actions, score in pendulum_agents():
        row = rows_of(name, firmware, folder, lambda outputs: score)  # noqa: B023
        if actions is not None:
            _, outputs = measure(firmware, "cortex-m4", folder)
            assert np.array_equal(outputs, actions)
        yield row
    actor = rl_tools_actor(rl_tools, folder)
    n_bytes, score = rl_tools_training(rl_tools, folder)
    yield rows_of("rl-tools, TD3's actor", actor, folder, lambda outputs: score)
    yield {"model": "rl-tools, TD3, learns", "score": score, "ram": n_bytes}


def estimators_table(rows):
    """Return the models of each problem."""
    cells = [
        [row["problem"], row["model"], f"{row['score']:.3f}", *_cells(row["boards"])]
        for row in rows
    ]
    return markdown(["problem", "model", "R2 or share right", *COLUMNS], cells)


def agents_table(rows):
    """Return the agents for the pendulum."""
    cells = [
        [row["model"], f"{row['score']:.0f}"]
        + (_cells(row["boards"]) if "boards" in row else ["", f"{row['ram']:,}", "", ""])
        for row in rows
    ]
    return markdown(["agent", "mean return", *COLUMNS], cells)


COLUMNS = ("flash, bytes", "RAM, bytes", "instructions, Cortex-M0", "Cortex-M4F")


def _cells(boards):
    """Return the sizes on the smallest board that has room, and a call's instructions on each."""
    sizes = boards["cortex-m0"] or boards["cortex-m4"]
    calls = [f"{cost['instructions']:,}" if cost else "too large" for cost in boards.values()]
    return [f"{sizes['flash']:,}", f"{sizes['ram']:,}", *calls]


def page_tables():
    """Return each table of the store by its name in the page."""
    rows = json.loads(STORE.read_text())
    estimators = [row for problem in PROBLEMS for row in rows[problem]]
    return {
        "estimators": estimators_table(estimators),
        "agents": agents_table(rows["agents"]),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--rl-tools", type=lambda path: Path(path).absolute(), help="A checkout of rl-tools."
    )
    parser.add_argument("--redraw", action="store_true", help="Only write the page.")
    arguments = parser.parse_args()
    if not arguments.redraw:
        rows = json.loads(STORE.read_text()) if STORE.exists() else {}
        # emlearn writes into the present folder.
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            for problem in PROBLEMS.keys() - rows.keys():
                rows[problem] = list(measure_problem(problem, Path(folder)))
                STORE.write_text(json.dumps(rows, indent=1) + "\n")
            if "agents" not in rows:
                rows["agents"] = list(measure_agents(arguments.rl_tools, Path(folder)))
                STORE.write_text(json.dumps(rows, indent=1) + "\n")
    show(page_tables(), PAGE)


if __name__ == "__main__":
    main()
