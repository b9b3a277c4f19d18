"""Learning curves: grouped runs, medians and quartiles, figures and CSV files."""

import csv
import json

import numpy as np
import pytest

from refusals import refuses
from run_specs import run_spec
from sdnn.runs import EnvironmentSpec, Goal, Run, RunError
from sdnn.runs.curves import MAX_POINTS, curves_of, draw_curves, groups_of, write_curves
from sdnn.runs.levels import Level
from sdnn.runs.store import ResultStore
from sdnn.runs.trial import TrialRows

CONFIG = run_spec(environment=EnvironmentSpec(id="CartPole-v1"))


def fake_run(folder, config, returns=(), evaluations=(), evaluate_every=20):
    """Make a run without training: with the returns of episodes, of 10 steps each.

    ``evaluations`` lists the returns of each evaluation; one comes every ``evaluate_every`` steps.
    """
    run = Run.create(folder, config)
    rows = [
        {"kind": "episode", "step": 10 * n, "episode": n - 1, "return": float(value), "length": 10,
         "terminated": True}
        for n, value in enumerate(returns, 1)
    ]  # fmt: skip
    rows += [
        {"kind": "evaluation", "step": evaluate_every * n, "episode": n - 1,
         "returns": list(values), "lengths": [10] * len(values),
         "terminated": [True] * len(values)}
        for n, values in enumerate(evaluations, 1)
    ]  # fmt: skip
    settings = {"config": run.spec.canonical_json(), "version": "0.1"}
    with ResultStore(folder) as store:
        store.extend(run.key, TrialRows.from_training(rows), 0, **settings)
    return run


def test_a_single_run_has_curves_of_returns_running_medians_and_evaluations(tmp_path):
    run = fake_run(tmp_path / "run", CONFIG, [1, 5, 3], [[1, 2, 3, 4, 10], [5, 5, 5, 5, 5]])
    returns, medians, evaluations = curves_of([run])[0]
    assert (returns.task, returns.agent) == ("CartPole-v1", "sdnn-c general")
    assert (returns.kind, returns.steps.tolist(), returns.values.tolist()) == (
        "return", [10, 20, 30], [1, 5, 3],
    )  # fmt: skip
    assert (medians.kind, medians.values.tolist()) == ("running median", [1, 3, 3])  # of 1, 5, 3
    assert (evaluations.kind, evaluations.steps.tolist()) == ("evaluation", [20, 40])
    # The means of the evaluations; low and high are the quartiles of their returns.
    assert evaluations.values.tolist() == [4, 5]
    assert evaluations.low.tolist() == [2, 5]
    assert evaluations.high.tolist() == [4, 5]


def test_runs_of_one_task_are_one_curve_with_quartiles(tmp_path):
    means = ([0, 1], [2, 1], [4, 3, 9])
    runs = [
        fake_run(tmp_path / str(seed), run_spec(CONFIG, seed=seed), [7], [[m] for m in means[seed]])
        for seed in range(3)
    ]
    *_, curve = curves_of(runs)[0]
    assert (curve.kind, curve.n_runs) == ("evaluation", 3)
    assert curve.steps.tolist() == [20, 40], "the steps at which all runs were evaluated"
    # Medians and quartiles over the runs of the means 0, 2, 4 and 1, 1, 3.
    assert curve.values.tolist() == [2, 1]
    assert curve.low.tolist() == [1, 1]
    assert curve.high.tolist() == [3, 2]
    axes = draw_curves([curve]).axes[0]
    assert axes.lines[0].get_ydata().tolist() == [2, 1]


def test_runs_of_different_seeds_keep_their_episodes_and_share_running_medians(tmp_path):
    returns = [1, 5, 3], [3, 3, 9, 9]
    runs = [fake_run(tmp_path / str(n), run_spec(CONFIG, seed=n), returns[n]) for n in range(2)]
    *episodes, medians = curves_of(runs)[0]
    assert [(curve.kind, curve.run) for curve in episodes] == [
        ("return", str(run.folder)) for run in runs
    ]
    assert [curve.values.tolist() for curve in episodes] == [*map(list, returns)]
    # Running medians are 1, 3, 3 and 3, 3, 3, 6: until step 30, which both have reached.
    assert (medians.kind, medians.n_runs, medians.run) == ("running median", 2, "")
    assert medians.steps.tolist() == [10, 20, 30]
    assert medians.values.tolist() == [2, 3, 3]
    assert medians.low.tolist() == [1.5, 3, 3]


def test_running_medians_of_long_runs_have_few_points(tmp_path):
    runs = [fake_run(tmp_path / str(n), run_spec(CONFIG, seed=n), range(2_000)) for n in range(2)]
    medians = curves_of(runs)[0][-1]
    assert len(medians.steps) == MAX_POINTS
    assert medians.steps[[0, -1]].tolist() == [10, 20_000]  # an episode has 10 steps
    assert medians.values[-1] == np.median(range(1_980, 2_000)), "of the last 20 episodes"


def test_legends_name_each_agent_and_each_type_of_line_once(tmp_path):
    other_agent = run_spec(CONFIG, settings={"learning": {"discount": 0.9}})
    runs = [
        fake_run(tmp_path / f"{n}-{seed}", run_spec(spec, seed=seed), [1, 2], [[3]])
        for n, spec in enumerate((CONFIG, other_agent))
        for seed in range(2)
    ]
    (legend,) = draw_curves(curves_of(runs)[0]).legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert len(texts) == len(set(texts)) == 2 + 3  # agents, and return, median and evaluation


def test_runs_of_other_tasks_or_settings_are_separate_curves(tmp_path):
    noisy = run_spec(
        CONFIG,
        environment=EnvironmentSpec(
            id="CartPole-v1",
            noise=0.02,
            ranges={"all": (-4.0, 4.0)},
            kwargs={"max_episode_steps": 9},
        ),
    )
    other_discount = run_spec(CONFIG, settings={"learning": {"discount": 0.9}})
    runs = [
        fake_run(tmp_path / str(n), config, [1])
        for n, config in enumerate((CONFIG, noisy, other_discount))
    ]
    curves = curves_of(runs)[0]
    discount = CONFIG.learning.discount
    assert {(curve.task, curve.agent) for curve in curves} == {
        ("CartPole-v1, noise=0.0", f"sdnn-c general, discount={discount}"),
        ("CartPole-v1, noise=0.0", "sdnn-c general, discount=0.9"),
        (
            "CartPole-v1, max_episode_steps=9, noise=0.02, all=[-4.0, 4.0]",
            f"sdnn-c general, discount={discount}",
        ),
    }
    assert len(draw_curves(curves).axes) == 2, "one for each of the two tasks"


CHANGES = (
    {},
    {"steps": 300},
    {"steps": None, "episodes": 300},
    {"n_envs": 4},
    {"evaluate_every": 500},
    {"evaluate_every": 0},
    {"evaluation_episodes": 3},
    {"target_return": 400.0},
    {"angle_pairs": "find"},
    {"settings": {"learning": {"discount": 0.5}}},
    {"environment": EnvironmentSpec(id="CartPole-v1", kwargs={"sutton_barto_reward": True})},
    {"environment": EnvironmentSpec(id="CartPole-v1", kwargs={"sutton_barto_reward": 1})},
)


def test_only_runs_that_differ_in_seed_and_output_are_grouped(tmp_path):
    configs = [run_spec(CONFIG, **change) for change in CHANGES]
    number_of_config = {}
    for n, config in enumerate(configs):
        for seed in (1, 2):
            folder = tmp_path / f"{n}-{seed}"
            Run(folder, config).folder.mkdir()
            other = run_spec(config, seed=seed, checkpoint_every=seed, tensorboard=seed == 2)
            (folder / "config.json").write_text(json.dumps(other.values()))
            number_of_config[folder] = n
    groups = groups_of([Run.open(folder) for folder in number_of_config])
    assert [[number_of_config[run.folder] for run in group.runs] for group in groups] == [
        [n, n] for n in range(len(configs))
    ]
    assert len({(group.task, group.agent) for group in groups}) == len(groups)


def test_names_of_groups_state_their_different_settings(tmp_path):
    long = run_spec(CONFIG, steps=600)
    short = run_spec(CONFIG, steps=300)
    specs_and_later_goals = {
        "a": (long, []),
        "b": (short, []),
        "c": (short, [Goal(at_step=300, steps=600)]),
        "d": (short, [Goal(at_step=150, steps=600)]),
        "e": (run_spec(short, n_envs=4), []),
    }
    runs = [Run(tmp_path / name, *parts) for name, parts in specs_and_later_goals.items()]
    groups = groups_of(runs)
    assert [group.agent.removeprefix("sdnn-c general, ") for group in groups] == [
        "600 steps, n_envs=1",
        "300 steps, n_envs=1",
        "300 steps, then 600 steps, n_envs=1",
        "300 steps, then from 150 on 600 steps, n_envs=1",
        "300 steps, n_envs=4",
    ]


def test_later_goals_at_steps_that_depend_on_the_seed_keep_runs_grouped(tmp_path):
    # Trainings of episodes, or up to a return, end at steps that depend on the seed.
    of_episodes = run_spec(CONFIG, steps=None, episodes=30)
    up_to_a_return = run_spec(CONFIG, target_return=5.0)
    for config, later in ((of_episodes, {"episodes": 60}), (up_to_a_return, {"steps": 600})):
        runs = [
            Run(tmp_path / str(seed), run_spec(config, seed=seed), [Goal(at_step=end, **later)])
            for seed, end in ((1, 271), (2, 300))
        ]
        assert len(groups_of(runs)) == 1


def test_runs_evaluated_at_different_steps_are_separate_curves(tmp_path):
    runs = [
        fake_run(tmp_path / f"{n}", run_spec(CONFIG, evaluate_every=n), [1, 2], [[3]], n)
        for n in (500, 700)
    ]
    third = run_spec(CONFIG, environment=EnvironmentSpec(id="Acrobot-v1"))
    runs.append(fake_run(tmp_path / "other", third, [1]))
    curves, notes = curves_of(runs)
    assert notes == []
    assert [
        (curve.agent, curve.steps.tolist()) for curve in curves if curve.kind == "evaluation"
    ] == [
        ("sdnn-c general, evaluate_every=500", [500]),
        ("sdnn-c general, evaluate_every=700", [700]),
    ]
    assert {curve.run for curve in curves} == {str(run.folder) for run in runs}


def test_notes_name_runs_and_evaluations_that_are_omitted(tmp_path):
    seeds = [run_spec(CONFIG, seed=seed) for seed in range(4)]
    whole = fake_run(tmp_path / "whole", seeds[0], [1], [[2], [4], [6]])
    short = fake_run(tmp_path / "short", seeds[1], [1], [[0], [2]])
    begun = fake_run(tmp_path / "begun", seeds[2], [1])
    empty = fake_run(tmp_path / "empty", seeds[3])
    curves, notes = curves_of([whole, short, begun, empty])
    assert {c.run for c in curves if c.kind == "return"} == {
        str(run.folder) for run in (whole, short, begun)
    }
    # `whole` is evaluated at steps 20, 40 and 60, `short` at 20 and 40; medians are of both.
    (curve,) = (curve for curve in curves if curve.kind == "evaluation")
    assert (curve.n_runs, curve.kind, curve.values.tolist()) == (2, "evaluation", [1, 3])
    names = [begun.folder, empty.folder, f"{whole.folder}, {short.folder}"]
    assert [note.partition(":")[0] for note in notes] == [str(name) for name in names]
    assert "step 40" in notes[2]
    curves, notes = curves_of([whole, begun])
    assert [(curve.kind, curve.n_runs, curve.run) for curve in curves] == [
        ("return", 1, str(whole.folder)), ("return", 1, str(begun.folder)),
        ("running median", 2, ""), ("evaluation", 1, str(whole.folder)),
    ]  # fmt: skip
    assert [note.partition(":")[0] for note in notes] == [str(begun.folder)]
    late = fake_run(tmp_path / "late", run_spec(CONFIG, seed=9), [], [[1]], evaluate_every=30)
    curves, notes = curves_of([short, late])
    assert {curve.kind for curve in curves} == {"return", "running median"}
    assert notes == [f"{short.folder}, {late.folder}: their evaluations have no step in common"]
    also_empty = fake_run(tmp_path / "new", CONFIG)
    refuses(empty.folder.name, curves_of, [empty, also_empty], error=RunError)


def test_figures_and_csv_files_are_written_in_every_format(tmp_path):
    run = fake_run(tmp_path / "run", CONFIG, [1.25], [[1, 2]])
    magic = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    for suffix, first in magic.items():
        figure, numbers = write_curves(curves_of([run])[0], tmp_path / "new" / f"x{suffix}")
        assert figure.read_bytes().startswith(first)
    rows = list(csv.DictReader(numbers.read_text().splitlines()))
    assert [(row["kind"], row["step"], row["value"]) for row in rows] == [
        ("return", "10", "1.25"), ("running median", "10", "1.25"), ("evaluation", "20", "1.5"),
    ]  # fmt: skip
    assert (rows[2]["low"], rows[2]["high"], rows[2]["run"]) == ("1.25", "1.75", str(run.folder))
    refuses(".png", write_curves, curves_of([run])[0], tmp_path / "x.doc", error=RunError)


def test_levels_are_dotted_lines_with_labels_and_rows_without_a_step(tmp_path):
    curves, _ = curves_of([fake_run(tmp_path / "run", CONFIG, [1, 100])])
    levels = [
        Level(task="CartPole-v1", title=title, value=value)
        for title, value in (("goal", 475.0), ("PPO", 474.0), ("random actions", 1.234))
    ]
    (axes,) = draw_curves(curves, levels).axes
    dotted = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == ":"]
    assert dotted == [475, 474, 1.234]
    labels = {text.get_text(): text.xy[1] for text in axes.texts}
    assert labels.keys() == {"goal 475", "PPO 474", "random actions 1.23"}
    assert labels["PPO 474"] == 474
    assert labels["goal 475"] > 490, "moved away from the label of PPO"
    _, numbers = write_curves(curves, tmp_path / "x.png", levels)
    rows = list(csv.DictReader(numbers.read_text().splitlines()))[-3:]
    assert [(row["kind"], row["step"], row["value"]) for row in rows] == [
        ("goal", "", "475.0"), ("PPO", "", "474.0"), ("random actions", "", "1.234"),
    ]  # fmt: skip


def test_runs_without_rows_and_a_missing_matplotlib_are_refused(tmp_path, monkeypatch):
    run = fake_run(tmp_path / "run", CONFIG)
    with pytest.raises(RunError, match="nothing to draw"):
        curves_of([run])
    monkeypatch.setattr("sdnn.runs.report.find_spec", lambda name: None)
    with pytest.raises(RunError, match="pip install matplotlib"):
        draw_curves([])
