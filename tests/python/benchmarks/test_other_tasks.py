"""Scripts of bench/other_tasks: pages show stored trials, and cases worked by hand are right."""

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
    """The scripts' modules and study; their names and agents are removed again afterwards."""
    from sdnn.agents.registry import AGENTS

    modules, path, agents = set(sys.modules), list(sys.path), dict(AGENTS)
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
        for name in set(sys.modules) - modules:
            file = getattr(sys.modules[name], "__file__", None) or ""
            if Path(file).parent in FOLDERS:
                del sys.modules[name]


def options_of(folder, *only, jobs=1):
    """Return the options of a script's command line; `only` selects trials."""
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
    expected = scripts.page.with_tables(text, {"policies": table})
    assert text == expected, "run bench/other_tasks/policies.py --redraw"


def test_every_stored_curve_is_complete(scripts):
    curves = scripts.studies.curves(scripts.run.KIND, scripts.study, options_of(EVIDENCE))
    for trial in itertools.chain(*curves.values()):
        assert trial["steps"] == sorted(set(trial["steps"]))
        lengths = {len(trial[name]) for name in ("steps", "cpu_seconds", "mean_return")}
        assert len(lengths) == 1
        assert trial["bytes"] > 0
    assert all((case, scripts.report.OURS) in curves for case in scripts.report.GOALS)


def of_40_steps(spec):
    """Return a specification with 40 steps, and an evaluation of an episode after each 20."""
    protocol = spec.protocol.replace(evaluate_every=20, evaluation_episodes=1)
    return spec.replace(budget=spec.budget.replace(steps=40), protocol=protocol)


PHYSICS = {
    "LunarLander", "LunarLanderContinuous", "InvertedPendulum", "Reacher", "Hopper", "HalfCheetah",
    "Walker2d", "Swimmer", "InvertedDoublePendulum",
}  # fmt: skip
"""Cases that need Box2D or MuJoCo."""


def test_every_agent_of_the_study_learns_40_steps(scripts, monkeypatch):
    monkeypatch.setattr(scripts.studies, "N_MILESTONE_EPISODES", 2)
    study, tried = scripts.study, set()
    for (case, variant), combination in study.combinations.items():
        if variant in {*tried, "sac", "td3", "ppo"} or case in PHYSICS:  # need other libraries
            continue
        tried.add(variant)
        spec = of_40_steps(combination.spec)
        key = study.keys(case, variant)[0]._replace(config_hash=spec.config_hash)
        planned = scripts.studies.PlannedTrial(key, spec)
        record, curve = scripts.studies.learn(planned, lambda done: None)
        assert curve["steps"] == [20, 40]
        # Evaluations after 20 and 40 steps, and one at the end.
        assert record.rows.table["kind"].tolist() == 3 * ["evaluation"]
        assert np.round(record.rows.episode_return, 2).tolist() == curve["mean_return"]
        assert curve["bytes"] > 0
    assert len(tried) == 11


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


def test_tables_of_hand_made_trials_are_as_worked_by_hand(scripts):
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

    class TakesMilliseconds(gym.Wrapper):
        def step(self, action):
            began = time.process_time()
            while time.process_time() < began + 0.001:
                pass
            return super().step(action)

    spec = of_40_steps(scripts.study.combinations["Pendulum", "stream-q"].spec)
    trial = spec.make_trial(1)
    trial.training.evaluation_env = TakesMilliseconds(trial.training.evaluation_env)
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
    # Stored keys are not measured again: `abs` would fail.
    measured.measure_missing("squares", abs, keys, options_of(tmp_path))
    assert measured.measured("squares", tmp_path) == squares
    # After a failure the new row is in the store, which is not packed then.
    packed = (tmp_path / measured.PACKED).read_bytes()
    with contextlib.suppress(RuntimeError), measured.opened(tmp_path) as store:
        store.put("squares", '["c", 3]', {"square": 9})
        raise RuntimeError
    assert (tmp_path / measured.PACKED).read_bytes() == packed
    assert len(measured.measured("squares", tmp_path)) == 3


def test_a_process_that_exits_is_reported_with_its_code(scripts, tmp_path, capsys):
    measured = scripts.measured
    keys = [("x", 0), ("x", 3)]  # the first one's process exits with code 3
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


def sensors(task, **options):
    return gym.make("bench/Sensors-v0", task=task, **options)


def rollout(env, actions, seed=3):
    """Return the observations of an episode."""
    return [env.reset(seed=seed)[0], *(env.step(action)[0] for action in actions)]


def test_sensor_wrappers_have_the_stated_noise_and_correlation(scripts):
    env = sensors("CartPole-v1", noise=0.1, copies=2, irrelevant=3, correlation=0.95)
    # Four variables and two copies of each, then the irrelevant ones.
    assert env.observation_space.shape == (4 * 3 + 3,)
    actions = [0, 1] * 4
    assert np.array_equal(rollout(env, actions, seed=5), rollout(env, actions, seed=5))
    observations = np.array([rollout(env, actions, seed) for seed in range(300)])
    # Noise of a copy in the units of a variable: a tenth of its range, 4.8 for the position.
    differences = observations[:, :, 0] - observations[:, :, 4]
    assert differences.std() == pytest.approx(np.sqrt(2) * 0.48, rel=0.05)
    irrelevant = observations[:, :, 12:]
    assert irrelevant.std() == pytest.approx(1.0, rel=0.1)
    consecutive = irrelevant[:, :-1].ravel(), irrelevant[:, 1:].ravel()
    assert np.corrcoef(*consecutive)[0, 1] == pytest.approx(0.95, abs=0.02)


def test_sensor_wrappers_add_irrelevant_variables_after_those_of_the_task(scripts):
    observation, _ = sensors("Pendulum-v1", irrelevant=2).reset(seed=1)
    assert np.array_equal(observation[:3], gym.make("Pendulum-v1").reset(seed=1)[0])
    assert np.all(np.abs(observation[3:]) < 1)


def test_sensor_wrappers_hide_variables_and_delay_actions(scripts):
    cartpole = gym.make("CartPole-v1")
    positions = rollout(sensors("CartPole-v1", hidden=[1, 3]), [1, 1, 0])
    assert np.array_equal(positions, np.array(rollout(cartpole, [1, 1, 0]))[:, [0, 2]])
    noisy = rollout(sensors("CartPole-v1", hidden=[1, 3], noise=0.05), [1, 1, 0])
    assert 0.01 < np.abs(np.subtract(noisy, positions)).max() < 1
    delayed = rollout(sensors("CartPole-v1", delay=2), [1, 1, 0, 0])
    assert np.array_equal(delayed, rollout(cartpole, [0, 0, 1, 1])), "two steps of action 0 first"


def test_a_goal_only_task_has_a_reward_of_1_at_its_goal_and_no_other(scripts):
    env = sensors("MountainCar-v0", goal_only=True)
    observation, _ = env.reset(seed=1)
    rewards, terminated = [], False
    while not terminated:  # a push along the velocity reaches the goal
        observation, reward, terminated, _, _ = env.step(2 if observation[1] >= 0 else 0)
        rewards.append(reward)
    assert rewards == [0.0] * (len(rewards) - 1) + [1.0]


def test_an_endless_task_has_episodes_in_evaluations_only(scripts):
    spec = of_40_steps(scripts.study.combinations["Pendulum endless", "q-lambda-auto"].spec)
    protocol, budget = spec.protocol.replace(evaluate_every=600), spec.budget.replace(steps=600)
    trial = spec.replace(protocol=protocol, budget=budget).make_trial(1)
    clock = scripts.studies.Clock(trial.training)
    trial.training.run()
    assert clock.curve["steps"] == [600]
    assert not any(row["kind"] == "episode" for row in trial.training.rows)
    # An episode of the evaluation has 200 steps, each with a cost of at most 16.3.
    assert -200 * 16.3 < clock.curve["mean_return"][0] < 0


def test_cells_end_in_the_opposite_corner_after_the_shortest_path_along_the_borders(scripts):
    right, up, down = 0, 2, 3  # actions
    env = gym.make("bench/Cells-v0")  # one-hot vectors of cells 0 to 99, by rows of 10
    assert env.reset(seed=1)[0].nonzero()[0].tolist() == [0]
    assert env.step(down)[0].nonzero()[0].tolist() == [0], "stays at the border"
    assert env.step(up)[0].nonzero()[0].tolist() == [10]
    for action in [up] * 8 + [right] * 9:
        observation, reward, terminated, truncated, _ = env.step(action)
        assert (reward, truncated, observation.sum()) == (-1.0, False, 1)
        assert terminated == (observation[99] == 1)
    assert terminated


def test_tiles_of_pairs_are_those_of_a_tile_coding_of_each_pair_of_inputs(scripts):
    tiles = sys.modules["tile_coding"]
    of_pairs = tiles.PairTiles(n_inputs=3, n_bins=4, n_tilings=2)
    of_two = tiles.TileCoding(n_inputs=2, n_bins=4, n_tilings=2)
    assert of_pairs.n_tiles == 3 * of_two.n_tiles
    state = np.array([0.1, 0.5, 0.9])
    expected = [
        of_two(state[list(pair)]) + number * of_two.n_tiles
        for number, pair in enumerate([(0, 1), (0, 2), (1, 2)])
    ]
    assert of_pairs(state).tolist() == np.concatenate(expected).tolist()


def test_a_table_has_a_tile_for_each_discrete_observation(scripts):
    assert sys.modules["tile_coding"].Table(5)(3).tolist() == [3]


def test_hashed_tiles_have_an_index_for_each_tiling_with_few_collisions(scripts):
    tiles = sys.modules["tile_coding"]
    hashed = tiles.HashedTiles(n_inputs=12, n_bins=8, n_tilings=16, n_tiles=1000)
    points = np.random.default_rng(1).random((50, 12))
    indices = np.array([hashed(point) for point in points])
    assert indices.shape == (50, 16)
    assert indices.min() >= 0
    assert indices.max() < 1000
    # 50 * 16 random numbers below 1,000 have 1000 * (1 - e^-0.8) = 551 different values.
    assert len(np.unique(indices)) > 400
    assert hashed(points[0]).tolist() == hashed(points[0] + 1e-6).tolist()


@pytest.mark.parametrize(
    ("settings", "values"),
    [
        ((0.01, 0.001, 0.1, 0.999), [0.0191506256, 1.91424491, 36.9045477, 39.5607346]),
        ((0.001, 0.01, 0.5, 0.9), [0.00193799828, 0.423024012, 42.5330134, 39.3531971]),
        ((0.05, 0.0, 1.0, 1.0), [0.09028176, 8.03872742, 42.4742184, 39.5957511]),
    ],
)
def test_swift_sarsa_has_the_values_of_its_reference_implementation(scripts, settings, values):
    # Values are those of the authors' SwiftTDBinaryFeatures, compiled with doubles.
    tiles = sys.modules["tile_coding"]
    names = ("step_size", "meta_step_size", "largest_rate", "step_size_decay")
    learning = tiles.SwiftConfig(**dict(zip(names, settings, strict=True)))
    spaces = gym.spaces.Box(0, 1, (1,)), gym.spaces.Discrete(2)
    sizes = tiles.TilesConfig(n_bins=4, n_tilings=4)
    agent = tiles.SwiftSarsa(*spaces, approximator=sizes, learning=learning, seed=1)
    agent.begin_episode()
    random, value_after = np.random.default_rng(0), {}
    for n_steps in range(1, 3001):
        active_tiles = np.sort(random.choice(40, 4, replace=False))
        agent.step(active_tiles, float(active_tiles[0] < 5))
        value_after[n_steps] = agent._value
    assert [value_after[n] for n in (10, 100, 1000, 3000)] == pytest.approx(values, rel=1e-8)


def test_stream_q_moves_parameters_along_the_gradient_of_the_value_of_the_action(scripts):
    streaming = sys.modules["streaming"]
    env = gym.make("Pendulum-v1")
    spaces = env.observation_space, env.action_space
    agent = streaming.StreamQ(*spaces, approximator=None, learning=None, seed=2)
    agent.progress = 1.0
    observation, _ = env.reset(seed=1)
    agent.begin_episode()
    for step in range(200):
        action = agent.act(observation)
        next_observation, reward, *_ = env.step(action)
        # After 20 steps weights and normalizations are no longer the initial ones.
        if step > 20 and agent._is_greedy:
            break
        agent.learn(Transition(observation, action, reward, next_observation, False))
        observation = next_observation
    else:
        pytest.fail("no greedy action")
    (network,), chosen = agent.networks, agent._chosen
    network.end_episode()  # without traces of earlier steps
    state, before = agent._state.copy(), network.parameters.copy()
    agent.learn(Transition(observation, action, reward, next_observation, False))
    agent.act(next_observation)  # with the next action, the transition is learned
    changes = network.parameters - before

    def value_with(parameter, change):
        network.parameters[:] = before
        network.parameters[parameter] += change
        return float(network.outputs(state)[chosen])

    # All parameters move by the same factor, error / bound, times the gradient: equal ratios.
    largest = np.argsort(-np.abs(changes))[:20]
    gradient = [(value_with(i, 1e-3) - value_with(i, -1e-3)) / 2e-3 for i in largest]
    ratios = changes[largest] / gradient
    assert np.allclose(ratios, np.median(ratios), rtol=0.05)  # finite differences are not exact
