import csv
import dataclasses
import json

import numpy as np
import pytest

from sdnn.runs import Run, RunConfig, RunEnvironment, RunError
from sdnn.runs.curves import curves_of, draw_curves, write_curves

CONFIG = RunConfig(environment=RunEnvironment(id="CartPole-v1"))


def make(folder, config, returns=(), evaluations=()):
    """Make a run that nobody trained: an episode every 10 steps, an evaluation every 20."""
    run = Run.create(folder, config)
    rows = [
        {"kind": "episode", "step": 10 * (n + 1), "return": float(value)}
        for n, value in enumerate(returns)
    ]
    rows += [
        {
            "kind": "evaluation",
            "step": 20 * (n + 1),
            "mean_return": float(np.mean(values)),
            "returns": list(values),
        }
        for n, values in enumerate(evaluations)
    ]
    (folder / "rows.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    return run


def test_one_run(tmp_path):
    run = make(tmp_path / "run", CONFIG, [1, 5, 3], [[1, 2, 3, 4, 10], [5, 5, 5, 5, 5]])
    returns, medians, evaluations = curves_of([run])
    assert (returns.task, returns.agent) == ("CartPole-v1", "sdnn general")
    assert (returns.kind, returns.steps.tolist(), returns.values.tolist()) == (
        "return", [10, 20, 30], [1, 5, 3],
    )  # fmt: skip
    assert (medians.kind, medians.values.tolist()) == ("running median", [1, 3, 3])
    assert (evaluations.kind, evaluations.steps.tolist()) == ("evaluation", [20, 40])
    assert evaluations.values.tolist() == [4, 5]
    assert evaluations.low.tolist() == [2, 5]
    assert evaluations.high.tolist() == [4, 5]


def test_the_running_median_is_of_twenty_episodes(tmp_path):
    run = make(tmp_path / "run", CONFIG, range(50))
    _, medians = curves_of([run])
    assert medians.values[-1] == np.median(range(30, 50))


def test_several_runs_of_one_task_are_one_curve(tmp_path):
    means = ([0, 1], [2, 1], [4, 3, 9])
    runs = [
        make(
            tmp_path / str(seed),
            dataclasses.replace(CONFIG, seed=seed),
            [7],
            [[value] for value in means[seed]],
        )
        for seed in range(3)
    ]
    (curve,) = curves_of(runs)
    assert (curve.kind, curve.n_runs) == ("evaluation", 3)
    assert curve.steps.tolist() == [20, 40]  # which all of them have
    assert curve.values.tolist() == [2, 1]
    assert curve.low.tolist() == [1, 1]
    assert curve.high.tolist() == [3, 2]
    axes = draw_curves([curve]).axes[0]
    assert axes.lines[0].get_ydata().tolist() == [2, 1]


def test_several_runs_without_evaluations_have_the_median_of_running_medians(tmp_path):
    runs = [
        make(tmp_path / str(n), dataclasses.replace(CONFIG, seed=n), [n] * (5 + n))
        for n in range(2)
    ]
    (curve,) = curves_of(runs)
    assert (curve.kind, curve.steps[0], curve.steps[-1]) == ("running median", 10, 50)
    assert set(curve.values.tolist()) == {0.5}


def test_tasks_and_agents_are_parted(tmp_path):
    noisy = dataclasses.replace(
        CONFIG,
        environment=RunEnvironment(
            id="CartPole-v1",
            noise=0.02,
            ranges={"all": (-4.0, 4.0)},
            kwargs={"max_episode_steps": 9},
        ),
    )
    set_otherwise = dataclasses.replace(CONFIG, settings={"learning": {"discount": 0.9}})
    runs = [
        make(tmp_path / str(n), config, [1])
        for n, config in enumerate((CONFIG, noisy, set_otherwise))
    ]
    curves = curves_of(runs)
    assert {(curve.task, curve.agent) for curve in curves} == {
        ("CartPole-v1", "sdnn general"),
        ("CartPole-v1", "sdnn general, discount=0.9"),
        ("CartPole-v1, max_episode_steps=9, range all: -4.0 to 4.0, noise 0.02", "sdnn general"),
    }
    assert len(draw_curves(curves).axes) == 2


def test_files_hold_the_numbers(tmp_path):
    run = make(tmp_path / "run", CONFIG, [1.25], [[1, 2]])
    magic = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    for suffix, first in magic.items():
        figure, numbers = write_curves(curves_of([run]), tmp_path / "new" / f"x{suffix}")
        assert figure.read_bytes().startswith(first)
    rows = list(csv.DictReader(numbers.read_text().splitlines()))
    assert [(row["kind"], row["step"], row["value"]) for row in rows] == [
        ("return", "10", "1.25"), ("running median", "10", "1.25"), ("evaluation", "20", "1.5"),
    ]  # fmt: skip
    assert (rows[2]["low"], rows[2]["high"], rows[2]["run"]) == ("1.25", "1.75", str(run.folder))
    with pytest.raises(RunError, match="must end in one of"):
        write_curves(curves_of([run]), tmp_path / "x.doc")


def test_what_cannot_be_drawn(tmp_path, monkeypatch):
    run = make(tmp_path / "run", CONFIG)
    with pytest.raises(RunError, match="nothing to draw"):
        curves_of([run])
    monkeypatch.setattr("sdnn.runs.curves.find_spec", lambda name: None)
    with pytest.raises(RunError, match=r'pip install "sdnn\[plot\]"'):
        draw_curves([])
