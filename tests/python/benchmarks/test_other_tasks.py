"""Benchmarks: pages show what the store holds; scripts are right in cases worked by hand."""

import argparse
import contextlib
import itertools
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from measurements_for_tests import squared
from sdnn.agents import Transition
from sdnn.reports.statistics import Estimate

EVIDENCE = Path(__file__).parents[3] / "docs" / "evidence"
BENCH = Path(__file__).parents[3] / "bench"
FOLDERS = (BENCH, BENCH / "other_tasks")


@pytest.fixture(scope="module")
def scripts():
    """The modules beside the command, whose names and agents are theirs alone while it runs."""
    from sdnn.agents.registry import AGENTS

    before, path, agents = set(sys.modules), list(sys.path), dict(AGENTS)
    sys.path[:0] = map(str, FOLDERS)
    try:
        import measured
        import page
        import policies
        import report
        import run
        import studies

        yield argparse.Namespace(
            measured=measured, page=page, policies=policies, report=report, run=run,
            studies=studies, study=run.StudyFile(run.STUDY),
        )  # fmt: skip
    finally:
        sys.path[:] = path
        AGENTS.clear()
        AGENTS.update(agents)
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None) or ""
            if Path(file).parent in FOLDERS:
                del sys.modules[name]


def options_of(folder, *only, jobs=1):
    return argparse.Namespace(folder=folder, only=only, jobs=jobs, redraw=False)


def test_the_benchmark_page_has_the_tables_of_the_stored_trials(scripts):
    run, report, study = scripts.run, scripts.report, scripts.study
    tables = report.tables(study, scripts.studies.curves(run.KIND, study, options_of(EVIDENCE)))
    text = (EVIDENCE / "benchmarks.md").read_text()
    assert scripts.page.with_tables(text, tables) == text, "run bench/other_tasks/run.py --redraw"


def test_the_benchmark_page_has_the_table_of_stored_policies(scripts):
    policies = scripts.policies
    table = policies.table(scripts.measured.measured(policies.KIND))
    text = (EVIDENCE / "benchmarks.md").read_text()
    same = scripts.page.with_tables(text, {"policies": table})
    assert same == text, "run bench/other_tasks/policies.py --redraw"


def test_every_stored_curve_is_complete(scripts):
    curves = scripts.studies.curves(scripts.run.KIND, scripts.study, options_of(EVIDENCE))
    for trial in itertools.chain(*curves.values()):
        assert trial["steps"] == sorted(set(trial["steps"]))
        lengths = {len(trial[name]) for name in ("steps", "cpu_seconds", "mean_return")}
        assert len(lengths) == 1
        assert trial["bytes"] > 0
    assert all((case, scripts.report.OURS) in curves for case in scripts.report.GOALS)


def quick(spec, case):
    """The study in 40 steps, but for those that learn in pieces of their own."""
    budget = spec.budget.replace(steps=40)
    return spec.replace(
        budget=budget, protocol=spec.protocol.replace(evaluate_every=20, evaluation_episodes=1)
    )


PHYSICS = {
    "LunarLander", "LunarLanderContinuous", "InvertedPendulum", "Reacher", "Hopper", "HalfCheetah",
    "Walker2d", "Swimmer", "InvertedDoublePendulum",
}  # fmt: skip
"""Cases that need Box2D or MuJoCo."""


def test_every_agent_of_the_study_learns_40_steps(scripts, monkeypatch):
    """The study as specified but for its budget: those that need no other library."""
    monkeypatch.setattr(scripts.studies, "N_MILESTONE_EPISODES", 2)
    study, tried = scripts.study, set()
    for (case, variant), combination in study.combinations.items():
        if variant in {*tried, "sac", "td3", "ppo"} or case in PHYSICS:
            continue
        tried.add(variant)
        spec = quick(combination.spec, case)
        key = study.keys(case, variant)[0]._replace(config_hash=spec.config_hash)
        planned = scripts.studies.PlannedTrial(key, spec)
        record, curve = scripts.studies.learn(planned, lambda done: None)
        assert curve["steps"] == [20, 40]
        assert record.rows.table["kind"].tolist() == 3 * ["evaluation"]
        assert np.round(record.rows.episode_return, 2).tolist() == curve["mean_return"]
        assert curve["bytes"] > 0
    assert len(tried) == 11, "the agents that need no other library"


def test_a_stored_trial_is_not_run_again(scripts, tmp_path):
    studies, file = scripts.studies, tmp_path / "study.toml"
    file.write_text(
        """
        [study]
        imports = ["tile_coding"]
        [base]
        budget.steps = 40
        protocol.evaluate_every = 20
        [cases]
        FrozenLake = { environment.id = "FrozenLake-v1" }
        [variants.tiles]
        agent = "tiles"
        """
    )
    study, curves = scripts.run.StudyFile(file, n_trials=1), {}
    for _ in range(2):
        studies.run_study("x", study, options_of(tmp_path, "tiles"))
        curves, first_curves = studies.curves("x", study, options_of(tmp_path)), curves
    assert set(curves) == {("FrozenLake", "tiles")}
    assert curves == first_curves, "with processor times, which a second run would change"


def test_tables_of_two_hand_made_trials_are_as_worked_by_hand(scripts):
    def trial(*returns):
        steps = [10_000, 20_000, 50_000][: len(returns)]
        return {"steps": steps, "mean_return": returns, "cpu_seconds": [1.0] * 3, "bytes": 2048}

    trials = {
        ("CartPole", "q-lambda"): [trial(20.0, 30.0, 480.0), trial(1.0, 2.0, 470.0)],
        ("CartPole", "tiles"): [trial(500.0, 500.0, 490.0)],
    }
    tables = scripts.report.tables(scripts.study, trials)
    goal = tables["goals"].splitlines()[2]
    assert goal == "| CartPole | 50,000 | 475 | 475 (470 to 480) | **1 of 2** | 2 |"
    # The goal of CartPole is 475, the return of random actions 22.4: (490 - 475) / (475 - 22.4).
    loss = tables["losses"].splitlines()[2]
    assert loss.endswith("| 490 (1 seed) | 475 (2 seeds) | 3 % |")
    assert "| 475 (2) |" in tables["at the end"]
    assert "| **490** (1) |" in tables["at the end"]
    assert "| SDNNQLambda | 20 | 2 |" in tables["costs"]
    along = scripts.report.along_the_way(scripts.study, trials)
    assert "| 2 | 10 | 16 | 475 |" in along, "whole medians of both trials"
    case = "MountainCar goal-only"
    goal_only = {(case, "q-lambda-auto"): [trial(0.5)], (case, "stream-ac"): [trial(1.0)]}
    loss = scripts.report.tables(scripts.study, goal_only)["losses"].splitlines()[2]
    assert loss.endswith("| 1.00 (1 seed) | 0.50 (1 seed) | 50 % |"), "the case has its own scale"


def test_processor_time_excludes_evaluations(scripts, monkeypatch):
    monkeypatch.setattr(scripts.studies, "N_MILESTONE_EPISODES", 2)

    class Slow(gym.Wrapper):
        def step(self, action):
            began = time.process_time()
            while time.process_time() < began + 0.001:
                pass
            return super().step(action)

    spec = quick(scripts.study.combinations["Pendulum", "stream-q"].spec, "Pendulum")
    trial = spec.make_trial(1)
    trial.training.evaluation_env = Slow(trial.training.evaluation_env)
    clock = scripts.studies.Clock(trial.training)
    began = time.process_time()
    trial.training.run()
    assert time.process_time() - began > 0.6  # 3 evaluation episodes of 200 steps of 1 ms
    assert clock.curve["cpu_seconds"][-1] < 0.3  # far less than the evaluations took


def test_a_failed_measurement_does_not_stop_others_or_change_the_packed_store(
    scripts, tmp_path, capsys
):
    measured = scripts.measured
    keys = [("a", 1), ("a b", 2)]
    measured.measure_missing("squares", squared, [*keys, ("bad", -1)], options_of(tmp_path))
    assert "ValueError('negative')" in capsys.readouterr().err
    squares = measured.measured("squares", tmp_path)
    assert {key: row["square"] for key, row in squares.items()} == {("a", 1): 1, ("a b", 2): 4}
    assert [file.name for file in tmp_path.iterdir()] == [measured.PACKED]
    measured.measure_missing("squares", abs, keys, options_of(tmp_path))  # which would fail
    assert measured.measured("squares", tmp_path) == squares
    packed = (tmp_path / measured.PACKED).read_bytes()
    with contextlib.suppress(RuntimeError), measured.opened(tmp_path) as store:
        store.put("squares", '["c", 3]', {"square": 9})
        raise RuntimeError
    assert (tmp_path / measured.PACKED).read_bytes() == packed
    assert len(measured.measured("squares", tmp_path)) == 3


def test_a_process_that_exits_is_reported_with_its_code(scripts, tmp_path, capsys):
    measured = scripts.measured
    keys = [("x", 0), ("x", 3)]
    measured.measure_missing("squares", squared, keys, options_of(tmp_path, jobs=2), apart=True)
    assert "ended with 3" in capsys.readouterr().err
    assert list(measured.measured("squares", tmp_path)) == [("x", 3)]


def test_only_selects_trials_by_whole_words(scripts):
    key = ("SDNN, small", "CartPole", 3)
    assert scripts.measured.is_wanted(key, options_of(EVIDENCE, "CartPole", "3"))
    assert not scripts.measured.is_wanted(key, options_of(EVIDENCE, "Cart"))


def test_a_page_without_the_marks_of_a_table_is_refused(scripts):
    with pytest.raises(ValueError, match="table: here"):
        scripts.page.with_tables("nothing", {"here": "| a |\n"})
    with pytest.raises(ValueError, match="end of table"):
        scripts.page.with_tables("<!-- table: here -->", {"here": "| a |\n"})


def test_tables_replace_the_text_between_their_marks(scripts):
    page = scripts.page
    text = f"before\n<!-- table: here -->\nold\n{page.END}\nafter\n"
    table = page.markdown(("a", "b"), [("1", "2")])
    assert table == "| a | b |\n| --- | --- |\n| 1 | 2 |\n"
    expected = f"before\n<!-- table: here -->\n\n{table}\n{page.END}\nafter\n"
    assert page.with_tables(text, {"here": table}) == expected


def test_an_unreached_target_is_written_as_never(scripts):
    estimate = Estimate(1234.5, 1.0, np.inf)
    assert scripts.page.interval(estimate, 1) == "1,234.5 [1.0, never]"


def test_sensor_wrappers_have_the_stated_noise_and_correlation(scripts):
    options = {"task": "CartPole-v1", "noise": 0.1, "copies": 2, "irrelevant": 3}
    env = gym.make("bench/Sensors-v0", correlation=0.95, **options)
    assert env.observation_space.shape == (4 * 3 + 3,)
    first = [env.reset(seed=5)[0], *(env.step(i % 2)[0] for i in range(8))]
    again = [env.reset(seed=5)[0], *(env.step(i % 2)[0] for i in range(8))]
    assert np.array_equal(first, again)
    observations = []
    for seed in range(300):
        observations.append(env.reset(seed=seed)[0])
        observations += [env.step(i % 2)[0] for i in range(8)]
    observations = np.array(observations).reshape(300, 1 + 8, 4 * 3 + 3)
    # Noise of a copy in the units of a variable: a tenth of its range, 4.8 for the position.
    apart = (observations[:, :, 0] - observations[:, :, 4]) / np.sqrt(2)
    assert apart.std() == pytest.approx(0.48, rel=0.05)
    irrelevant = observations[:, :, 12:]
    assert irrelevant.std() == pytest.approx(1.0, rel=0.1)
    pairs = irrelevant[:, :-1].ravel(), irrelevant[:, 1:].ravel()
    assert np.corrcoef(*pairs)[0, 1] == pytest.approx(0.95, abs=0.02)
    plain = gym.make("bench/Sensors-v0", task="Pendulum-v1", irrelevant=2)
    observation, _ = plain.reset(seed=1)
    assert np.array_equal(observation[:3], gym.make("Pendulum-v1").reset(seed=1)[0])
    assert np.all(np.abs(observation[3:]) < 1)


def test_wrappers_hide_variables_delay_actions_and_leave_the_goals_reward(scripts):
    def rollout(env, actions, seed=3):
        return [env.reset(seed=seed)[0], *(env.step(a)[0] for a in actions)]

    usual = gym.make("CartPole-v1")
    shown = rollout(gym.make("bench/Sensors-v0", task="CartPole-v1", hidden=[1, 3]), [1, 1, 0])
    assert np.array_equal(shown, np.array(rollout(usual, [1, 1, 0]))[:, [0, 2]])
    noisy = gym.make("bench/Sensors-v0", task="CartPole-v1", hidden=[1, 3], noise=0.05)
    assert 0.01 < np.abs(np.subtract(rollout(noisy, [1, 1, 0]), shown)).max() < 1
    late = rollout(gym.make("bench/Sensors-v0", task="CartPole-v1", delay=2), [1, 1, 0, 0])
    assert np.array_equal(late, rollout(usual, [0, 0, 1, 1]))  # two steps of action 0 come first

    hill = gym.make("bench/Sensors-v0", task="MountainCar-v0", goal_only=True)
    observation, _ = hill.reset(seed=1)
    rewards, terminated = [], False
    while not terminated:  # a push along the velocity reaches the goal
        observation, reward, terminated, _, _ = hill.step(2 if observation[1] >= 0 else 0)
        rewards.append(reward)
    assert rewards == [0.0] * (len(rewards) - 1) + [1.0]


def test_an_endless_task_has_episodes_in_evaluations_only(scripts):
    spec = scripts.study.combinations["Pendulum endless", "q-lambda-auto"].spec
    spec = quick(spec, "Pendulum").replace(budget=spec.budget.replace(steps=600))
    trial = spec.replace(protocol=spec.protocol.replace(evaluate_every=600)).make_trial(1)
    clock = scripts.studies.Clock(trial.training)
    trial.training.run()
    assert clock.curve["steps"] == [600]
    rows = [row for row in trial.training.rows if row["kind"] == "episode"]
    assert not rows, "training has no end"
    assert -200 * 17 < clock.curve["mean_return"][0] < 0, "200 steps at most 16.3 each"


def test_cells_end_in_the_opposite_corner_after_the_shortest_path_along_the_borders(scripts):
    right, up, down = 0, 2, 3  # cells are numbered from 0 to 99, by rows of 10
    env = gym.make("bench/Cells-v0")
    assert env.reset(seed=1)[0].nonzero()[0].tolist() == [0]
    assert env.step(down)[0].nonzero()[0].tolist() == [0]  # stays at the border
    assert env.step(up)[0].nonzero()[0].tolist() == [10]
    for steps, action in ((8, up), (9, right)):
        for _ in range(steps):
            observation, reward, terminated, truncated, _ = env.step(action)
            assert (reward, truncated, observation.sum()) == (-1.0, False, 1)
            assert terminated == (observation[99] == 1)
    assert terminated


def test_tile_codings_of_pairs_hashes_and_tables_have_their_indices(scripts):
    tiles = sys.modules["tile_coding"]
    pairs = tiles.PairTiles(n_inputs=3, n_bins=4, n_tilings=2)
    joint = tiles.TileCoding(n_inputs=2, n_bins=4, n_tilings=2)
    assert pairs.n_tiles == 3 * joint.n_tiles
    unit = np.array([0.1, 0.5, 0.9])
    expected = [
        joint(unit[[a, b]]) + n * joint.n_tiles for n, (a, b) in enumerate([(0, 1), (0, 2), (1, 2)])
    ]
    assert pairs(unit).tolist() == np.concatenate(expected).tolist()
    hashed = tiles.HashedTiles(n_inputs=12, n_bins=8, n_tilings=16, n_tiles=1000)
    points = np.random.default_rng(1).random((50, 12))
    indices = np.array([hashed(point) for point in points])
    assert indices.shape == (50, 16)
    assert indices.min() >= 0
    assert indices.max() < 1000
    # 50 * 16 random numbers below 1,000 have 1000 * (1 - e^-0.8) = 551 different values.
    assert len(np.unique(indices)) > 400
    assert hashed(points[0]).tolist() == hashed(points[0] + 1e-6).tolist()
    assert tiles.Table(5)(3).tolist() == [3]


@pytest.mark.parametrize(
    ("settings", "values"),
    [
        ((0.01, 0.001, 0.1, 0.999), [0.0191506256, 1.91424491, 36.9045477, 39.5607346]),
        ((0.001, 0.01, 0.5, 0.9), [0.00193799828, 0.423024012, 42.5330134, 39.3531971]),
        ((0.05, 0.0, 1.0, 1.0), [0.09028176, 8.03872742, 42.4742184, 39.5957511]),
    ],
)
def test_swift_sarsa_has_the_values_of_its_reference_implementation(scripts, settings, values):
    """SwiftTDBinaryFeatures, compiled with doubles, after 10, 100, 1,000 and 3,000 steps."""
    tiles = sys.modules["tile_coding"]
    names = ("step_size", "meta_step_size", "largest_rate", "step_size_decay")
    learning = tiles.SwiftConfig(**dict(zip(names, settings, strict=True)))
    spaces = gym.spaces.Box(0, 1, (1,)), gym.spaces.Discrete(2)
    sizes = tiles.TilesConfig(n_bins=4, n_tilings=4)
    agent = tiles.SwiftSarsa(*spaces, approximator=sizes, learning=learning, seed=1)
    agent.begin_episode()
    random, learned = np.random.default_rng(0), []
    for _ in range(3000):
        active = np.sort(random.choice(40, 4, replace=False))
        agent.step(active, float(active[0] < 5))
        learned.append(agent._value)
    assert [learned[n] for n in (9, 99, 999, 2999)] == pytest.approx(values, rel=1e-8)


def test_stream_q_follows_the_gradient_of_its_value(scripts):
    streaming = sys.modules["streaming"]
    env = gym.make("Pendulum-v1")
    spaces = env.observation_space, env.action_space
    agent = streaming.StreamQ(*spaces, approximator=None, learning=None, seed=2)
    agent.progress = 1.0
    observation, _ = env.reset(seed=1)
    agent.begin_episode()
    for n in range(200):
        action = agent.act(observation)
        following, reward, *_ = env.step(action)
        if n > 20 and agent._is_greedy:
            break
        agent.learn(Transition(observation, action, reward, following, False))
        observation = following
    (network,), agent_action = agent.networks, agent._chosen
    network.end_episode()
    state, before = agent._state.copy(), network.parameters.copy()
    agent.learn(Transition(observation, action, reward, following, False))
    agent.act(following)
    moved = network.parameters - before
    network.parameters[:] = before
    largest = np.argsort(-np.abs(moved))[:20]
    slopes = []
    for parameter in largest:
        values = []
        for change in (1e-3, -1e-3):
            network.parameters[parameter] = before[parameter] + change
            values.append(float(network.outputs(state)[agent_action]))
        network.parameters[parameter] = before[parameter]
        slopes.append((values[0] - values[1]) / 2e-3)
    # Each parameter moves in proportion to its slope, up to the error of finite differences.
    ratios = moved[largest] / np.array(slopes)
    assert np.allclose(ratios, np.median(ratios), rtol=0.05)
