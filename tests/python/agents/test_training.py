"""Training loops over single environments: rows, failures, evaluations, and exact resuming."""

import copy
import functools
import json
import re
import tracemalloc
import warnings
from decimal import Decimal

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import (
    Callback,
    CheckpointCallback,
    FuzzyQLearning,
    JSONLines,
    QLearningConfig,
    RBFQLearning,
    SDNNQLambda,
    SDNNQLearning,
    StopTrainingOnRewardThreshold,
    Training,
    Transition,
    UnrepeatedEpisodeError,
    UnusableStepError,
    evaluate,
    load_agent,
)
from sdnn.approximators import SDNNCConfig
from sdnn.support.files import read_file, write_file
from stopped_training import Stop, check_exact_resume, states_equal

SMALL = SDNNCConfig(n_pattern_units=20, n_hidden_units=60, n_active_units=20, n_actions=5)
AGENT_TYPES = {
    "sdnn": (SDNNQLearning, {"approximator": SMALL}),
    "rbf": (RBFQLearning, {}),
    "fuzzy": (FuzzyQLearning, {}),
}


class Corridor(gym.Env):
    """Five cells, begun in cell 0 or 1; cell 4 ends the episode with reward 1, others cost 0.1.

    Episodes are truncated after eight steps.
    """

    observation_space = gym.spaces.Box(0.0, 4.0, (1,), dtype=np.float64)
    action_space = gym.spaces.Discrete(2)

    def __init__(self, is_random=False):
        self._is_random = is_random
        self.seeds = []

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.seeds.append(seed)
        self._at, self._steps = int(self.np_random.integers(2)), 0
        return self._observation(), {}

    def step(self, action):
        self._at = max(0, self._at + (1 if action else -1))
        self._steps += 1
        terminated = self._at == 4
        return self._observation(), 1.0 if terminated else -0.1, terminated, self._steps == 8, {}

    def _observation(self):
        shift = np.random.default_rng().uniform(0, 0.1) if self._is_random else 0.0
        return np.array([self._at + shift])


class Careless(gym.Env):
    """A point on a line that is rewarded in the middle.

    It returns its state without a copy, and changes the action in place; not with ``is_careful``.
    """

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), dtype=np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), dtype=np.float64)

    def __init__(self, is_careful=False):
        self._is_careful = is_careful
        self._state = np.zeros(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._state[:] = self.np_random.uniform(-1.0, 1.0, 2)
        self._steps = 0
        return self._observation(), {}

    def step(self, action):
        force = action.copy() if self._is_careful else action
        force *= 0.1
        self._state[:] = np.clip(self._state + np.append(force, 0.0), -1.0, 1.0)
        self._steps += 1
        reward = np.array([-abs(self._state[0])])
        return self._observation(), reward, np.bool_(False), self._steps == 20, {}

    def _observation(self):
        return self._state.copy() if self._is_careful else self._state


def corridor_agent(**options):
    env = Corridor()
    return SDNNQLearning(
        env.observation_space, env.action_space, approximator=SMALL, seed=1, **options
    )


@pytest.mark.parametrize("agent_type", AGENT_TYPES)
def test_environments_that_modify_arrays_in_place_do_not_change_learning(agent_type):
    make, options = AGENT_TYPES[agent_type]
    agents = []
    for is_careful in (True, False):
        env = Careless(is_careful)
        agents.append(make(env.observation_space, env.action_space, seed=3, **options))
        agents[-1].train(env, steps=300, evaluate_every=100, evaluation_env=Careless(is_careful))
    assert states_equal(*agents)


def test_environments_with_other_spaces_are_refused():
    agent = corridor_agent()
    for name, space in (
        ("observation_space", gym.spaces.Box(0.0, 4.0, (2,), dtype=np.float64)),
        ("action_space", gym.spaces.Discrete(3)),
    ):
        other = Corridor()
        setattr(other, name, space)
        refuses("env", agent.train, other, steps=10)
        refuses("env", evaluate, agent, other)
        evaluations = {"evaluate_every": 5, "evaluation_env": other}
        refuses("evaluation_env", agent.train, Corridor(), steps=10, **evaluations)


def test_evaluations_refuse_vectors_and_the_environment_of_the_training():
    agent, env, several = corridor_agent(), Corridor(), gym.vector.SyncVectorEnv([Corridor] * 2)
    refuses("env", evaluate, agent, several, error=TypeError)
    for wrong, error in ((several, TypeError), (env, ValueError)):
        evaluations = {"evaluate_every": 5, "evaluation_env": wrong}
        refuses("evaluation_env", agent.train, env, steps=10, error=error, **evaluations)


def test_an_evaluation_warns_of_an_episode_of_more_than_100_000_steps():
    class Endless(Corridor):
        def step(self, action):
            self._steps += 1
            return np.zeros(1), 0.0, self._steps == 100_001, False, {}

    class NullAgent:
        def act(self, observation, explore=True):
            return 0

    with pytest.warns(RuntimeWarning, match="max_episode_steps"):
        assert evaluate(NullAgent(), Endless(), 1).lengths.tolist() == [100_001]


def test_a_training_warns_once_of_an_episode_that_continues_after_10_000_steps():
    endless = gym.make("Pendulum-v1", max_episode_steps=20_001)
    agent = SDNNQLambda(endless, warm_up_steps=10)
    with pytest.warns(RuntimeWarning, match="max_episode_steps") as warned:
        agent.train(endless, steps=10_002)
    assert len(warned) == 1
    limited = gym.make("Pendulum-v1", max_episode_steps=10_000)
    assert agent.train(limited, steps=10_001).n_episodes == 1  # without a warning


@pytest.mark.parametrize("reward", [np.float32(1), np.array([1]), Decimal(1), True, np.array(1.0)])
def test_rewards_may_be_scalars_of_any_numeric_type(reward):
    class ConstantReward(Corridor):
        def step(self, action):
            return super().step(action)[0], reward, False, self._steps == 8, {}

    # Episodes have eight steps, each with a reward of 1.
    assert corridor_agent().train(ConstantReward(), episodes=2).returns.tolist() == [8.0, 8.0]
    assert evaluate(corridor_agent(), ConstantReward(), 1).mean_return == 8.0


class Broken(Corridor):
    """A corridor whose 11th step or second reset returns the values that are passed.

    Its episodes have eight steps: both are of the second episode, number 1.
    """

    def __init__(self, **replaced):
        super().__init__()
        self._replaced, self._n_steps, self._n_resets = replaced, 0, 0

    def reset(self, *, seed=None, options=None):
        observation, info = super().reset(seed=seed)
        self._n_resets += 1
        if self._n_resets == 2:
            observation = self._replaced.get("first_observation", observation)
        return observation, info

    def step(self, action):
        observation, *_ = super().step(0)
        self._n_steps += 1
        replaced = self._replaced if self._n_steps == 11 else {}
        observation = replaced.get("observation", observation)
        return observation, replaced.get("reward", 1.0), False, self._steps == 8, {}


@pytest.mark.parametrize(
    ("replaced", "step", "where", "problem"),
    [
        ({"reward": np.nan}, 11, "step 3", "got nan"),
        ({"observation": np.array([np.nan])}, 11, "step 3", "observation[0] must be finite"),
        ({"observation": np.zeros(2)}, 11, "step 3", "observation"),
        ({"first_observation": np.array([np.nan])}, 9, "the reset", "observation[0] must be fin"),
    ],
    ids=["reward", "NaN", "shape", "reset"],
)
def test_errors_of_unusable_steps_name_step_and_episode(replaced, step, where, problem):
    with pytest.raises(UnusableStepError, match=re.escape(problem)) as error:
        corridor_agent().train(Broken(**replaced), steps=40)
    assert f"in step {step} ({where} of episode 1): " in str(error.value)
    with pytest.raises(UnusableStepError, match=re.escape(problem)) as error:
        evaluate(corridor_agent(), Broken(**replaced))
    assert f"in {where} of greedy episode 1: " in str(error.value)


def test_errors_of_unusable_steps_name_the_environment_of_a_vector():
    envs = gym.vector.SyncVectorEnv([Corridor, lambda: Broken(reward=np.nan)])
    with pytest.raises(UnusableStepError, match=r"environment 1\b.*\breward\b"):
        corridor_agent().train(envs, steps=40)


def test_a_reward_of_1e300_causes_one_warning_and_is_not_learned():
    env = Broken(reward=1e300)
    env.action_space = gym.spaces.Box(-1.0, 1.0, (1,))
    agent = FuzzyQLearning(env.observation_space, env.action_space)
    with pytest.warns(UserWarning, match=r"reward 1e\+300 of transition 11") as warned:
        agent.train(env, steps=40)
    assert len(warned) == 1
    assert np.isfinite(agent.state()["agent.rules.values"]).all()


def test_errors_of_an_environment_are_raised_unchanged():
    class Failing(Corridor):
        def step(self, action):
            raise ValueError("no current")

    for use in (lambda agent, env: agent.train(env, steps=9), evaluate):
        with pytest.raises(ValueError, match=r"^no current$") as error:
            use(corridor_agent(), Failing())
        assert not isinstance(error.value, UnusableStepError)


class FailsOnce(Careless):
    """A careful point; one call of its step or reset fails, by an error or by a reward of NaN."""

    def __init__(self, call=("step", None), failure=TimeoutError):
        super().__init__(is_careful=True)
        self._left = {"step": None, "reset": None} | dict([call])
        self._failure = failure

    def reset(self, **options):
        self._fail("reset")
        return super().reset(**options)

    def step(self, action):
        observation, reward, *others = super().step(action)
        return observation, self._fail("step") or float(reward[0]), *others

    def _fail(self, name):
        if self._left[name] is None:
            return None
        self._left[name] -= 1
        if self._left[name] == 0:
            if self._failure is TimeoutError:
                raise TimeoutError("no answer")
            return np.nan
        return None


@pytest.mark.parametrize("agent_type", AGENT_TYPES)
@pytest.mark.parametrize(
    ("call", "failure", "n_learned"),
    [
        (("step", 1), TimeoutError, 0),
        (("step", 33), TimeoutError, 32),
        (("step", 33), UnusableStepError, 32),
        (("reset", 1), TimeoutError, 0),
        (("reset", 3), TimeoutError, 40),
    ],
)
def test_steps_before_a_failure_of_the_environment_are_kept_and_the_training_continues(
    agent_type, call, failure, n_learned, tmp_path
):
    make, options = AGENT_TYPES[agent_type]
    env = FailsOnce(call, failure)
    agent = make(env.observation_space, env.action_space, seed=3, **options)
    path, rows = tmp_path / "checkpoint", JSONLines(tmp_path / "rows.jsonl")
    training = Training(
        agent, env, steps=100, callbacks=[rows, CheckpointCallback(path, every=1000)]
    )
    with pytest.raises(failure):
        training.run()
    assert not training.is_within_step
    loaded = Training.load(path, FailsOnce())
    assert loaded.n_steps == training.n_steps == n_learned
    assert states_equal(loaded.agent, agent)
    # Episodes have 20 steps. A failure at step 33 leaves one whole episode, 12 steps of an
    # abandoned one, and 68 steps for three more; other failures leave five whole ones.
    for continued in (loaded, training):
        continued.run()
        assert (continued.n_steps, continued.n_episodes) == (100, 4 if n_learned == 32 else 5)
    assert states_equal(loaded.agent, agent)
    lines = [json.loads(line) for line in rows.path.read_text().splitlines()]
    assert [row["episode"] for row in lines] == list(range(training.n_episodes))
    assert {row["length"] for row in lines} == {20}


def change_actions(path, change):
    """Save a training in its third step, and change the actions of its episode in the file.

    Returns the name of their array in the file, and the environment.
    """
    env = Corridor()
    agent = SDNNQLearning(env.observation_space, env.action_space, approximator=SMALL, seed=3)
    Training(agent, env, episodes=9, callbacks=[Stop(3, path)]).run()
    description, arrays = read_file(path, "training")
    name = "training.0.actions"
    assert len(arrays[name]) > 0
    write_file(path, "training", arrays | {name: change(arrays[name])}, description)
    return name, env


@pytest.mark.parametrize(
    "change",
    [
        lambda actions: actions + 9,
        lambda actions: actions - 9,
        lambda actions: actions[:, np.newaxis],
        lambda actions: actions + 0.0,
        lambda actions: actions.astype(np.uint64),
        lambda actions: actions[0],
    ],
    ids=["too large", "too small", "two dimensions", "float", "unsigned", "scalar"],
)
def test_invalid_actions_in_a_checkpoint_are_refused_by_name(change, tmp_path):
    path = tmp_path / "checkpoint"
    name, env = change_actions(path, change)
    refuses(name, Training.load, path, env)


def test_a_checkpoint_without_its_actions_cannot_repeat_the_episode(tmp_path):
    path = tmp_path / "checkpoint"
    _, env = change_actions(path, lambda actions: actions[:0])
    with pytest.raises(UnrepeatedEpisodeError):  # the first observation is not the fourth
        Training.load(path, env)


@pytest.mark.parametrize("has_own_resets", [False, True])
def test_steps_before_a_failure_in_a_vector_are_kept_and_the_training_continues(
    has_own_resets, tmp_path
):
    env = gym.vector.SyncVectorEnv([FailsOnce, functools.partial(FailsOnce, ("step", 33))])
    if has_own_resets:
        env = gym.wrappers.vector.NormalizeObservation(env)
    make, options = AGENT_TYPES["sdnn"]
    agent = make(env.single_observation_space, env.single_action_space, seed=3, **options)
    path = tmp_path / "checkpoint"
    training = Training(agent, env, steps=200, callbacks=[CheckpointCallback(path, every=1000)])
    with pytest.raises(TimeoutError):
        training.run()
    careful = gym.vector.SyncVectorEnv([FailsOnce] * 2)
    if has_own_resets:  # the observations of the other vector, not normalized
        space = env.single_observation_space
        careful = gym.wrappers.vector.TransformObservation(
            careful, np.asarray, env.observation_space, space
        )
    loaded = Training.load(path, careful, repeat_episodes=not has_own_resets)
    assert loaded.n_steps == training.n_steps == 64, "32 steps of two environments before step 33"
    training.run()
    loaded.run()
    assert training.n_steps == loaded.n_steps == 200
    assert training.n_episodes == loaded.n_episodes == 8, "two, and then six"
    assert states_equal(loaded.agent, agent) != has_own_resets


def test_resuming_skips_an_episode_whose_reset_failed(tmp_path):
    env = Corridor()
    corridor_agent().train(env, episodes=4, seed=7)
    bad = env.seeds[2:4]  # of the third and fourth episode

    class Picky(Corridor):
        def reset(self, *, seed=None, options=None):
            if seed in bad:
                raise RuntimeError("no such start")
            return super().reset(seed=seed)

    path = tmp_path / "checkpoint"
    callbacks = [CheckpointCallback(path)]
    training = Training(corridor_agent(), Picky(), episodes=4, seed=7, callbacks=callbacks)
    for _ in bad:
        refuses("start", training.run, error=RuntimeError)
        assert training.n_episodes == 2
        training = Training.load(path, Picky(), callbacks=callbacks)
    assert training.run().n_episodes == 4
    assert training.next_episode == 4 + len(bad)


@pytest.mark.parametrize("n_envs", [1, 2])
def test_a_training_stopped_after_a_failure_resumes_exactly(n_envs, tmp_path):
    make, options = AGENT_TYPES["sdnn"]
    envs = [FailsOnce] * (n_envs - 1) + [functools.partial(FailsOnce, ("step", 33))]

    def finished(stop):
        """Continue after the failure at step 33; stop at a step and continue from its file."""
        env = gym.vector.SyncVectorEnv(envs) if n_envs > 1 else envs[0]()
        agent = make(FailsOnce.observation_space, FailsOnce.action_space, seed=3, **options)
        training = Training(agent, env, steps=200, callbacks=[Stop(stop, tmp_path / "t")])
        with pytest.raises(TimeoutError):
            training.run()
        if training.run().is_finished:
            return training
        fresh = gym.vector.SyncVectorEnv([FailsOnce] * n_envs) if n_envs > 1 else FailsOnce()
        loaded = Training.load(tmp_path / "t", fresh)
        assert loaded.run().is_finished
        return loaded

    whole, cut = finished(stop=1000), finished(stop=150)  # in 200 steps: never, and once
    assert states_equal(whole.agent, cut.agent)
    assert whole.next_episode == cut.next_episode


def test_resuming_first_repeats_a_failed_evaluation(tmp_path):
    path, rows = tmp_path / "checkpoint", tmp_path / "rows.jsonl"
    every = {"steps": 100, "evaluate_every": 25, "evaluation_episodes": 2}
    make, options = AGENT_TYPES["sdnn"]

    def training(evaluation_env, name):
        agent = make(FailsOnce.observation_space, FailsOnce.action_space, seed=3, **options)
        callbacks = [JSONLines(tmp_path / name), CheckpointCallback(path, every=1000)]
        evaluations = {"evaluation_env": evaluation_env, **every}
        return Training(agent, FailsOnce(), callbacks=callbacks, **evaluations)

    whole = training(FailsOnce(), "whole")
    whole.run()
    cut = training(FailsOnce(("reset", 3)), "rows.jsonl")  # the second evaluation's first
    with pytest.raises(TimeoutError):
        cut.run()
    assert (cut.n_steps, cut.is_within_step, len(cut.evaluations)) == (50, False, 1)
    again = FailsOnce(("reset", 1))
    loaded = Training.load(path, FailsOnce(), evaluation_env=again, callbacks=[JSONLines(rows)])
    with pytest.raises(TimeoutError):
        loaded.run()
    assert loaded.n_steps == 50
    for continued in (loaded, cut):
        continued.run()
        assert continued.evaluations == whole.evaluations
        assert states_equal(continued.agent, whole.agent)

    def rows_without_times(path):
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        return [{k: v for k, v in line.items() if k != "seconds"} for line in lines]

    assert rows_without_times(rows) == rows_without_times(tmp_path / "whole")


def test_further_trainings_of_an_agent_and_its_copies_continue_the_episode_seeds(tmp_path):
    env, agent = Corridor(), corridor_agent()
    agent.train(env, episodes=3)
    agent.save(tmp_path / "agent")
    for continued in (agent, load_agent(tmp_path / "agent"), copy.deepcopy(agent)):
        continued.train(env, steps=20)
    n = (len(env.seeds) - 3) // 3
    second = env.seeds[3 : 3 + n]
    assert env.seeds[3:] == 3 * second
    assert len({*env.seeds[:3], *second}) == 3 + n, "no seed occurs twice"
    whole = Corridor()
    corridor_agent().train(whole, episodes=5)
    assert whole.seeds == env.seeds[:5]


def test_episode_seeds_are_unique_reproducible_and_apart_from_those_of_evaluations():
    n_episodes, seed = 30, 4
    env, evaluation_env, agent = Corridor(), Corridor(), corridor_agent()
    for _ in range(2):
        agent.train(env, episodes=n_episodes, seed=seed)
    evaluate(agent, evaluation_env, n_episodes, seed=seed)
    first, second = env.seeds[:n_episodes], env.seeds[n_episodes:]
    assert first == second
    assert len({*first, *evaluation_env.seeds}) == 2 * n_episodes


def test_sdnn_q_learning_learns_the_shortest_way_through_a_corridor():
    agent = corridor_agent()
    result = agent.train(Corridor(), episodes=300)
    assert result.is_finished
    assert (result.n_episodes, len(result.returns)) == (300, 300)
    evaluation = evaluate(agent, Corridor(), 20, seed=3)
    assert evaluation.terminated.all()
    assert set(evaluation.lengths) <= {3, 4}, "from cell 0 or 1 straight to cell 4"
    assert evaluation.mean_return == evaluation.returns.mean() > 0.6, "1 minus 0.1 for each step"


def test_evaluations_report_mean_returns_and_do_not_change_what_is_learned():
    unevaluated = Training(corridor_agent(), Corridor(), steps=300)
    evaluated = Training(
        corridor_agent(), Corridor(), steps=300, evaluate_every=50, evaluation_env=Corridor()
    )
    unevaluated.run()
    result = evaluated.run()
    expected, state = unevaluated.agent.state(), evaluated.agent.state()
    # Only the generator that breaks ties in evaluations has drawn numbers.
    differ = {name for name in state if not np.array_equal(state[name], expected[name])}
    assert differ <= {"agent.policy.evaluation_ties.words"}
    assert result.evaluations[:, 0].tolist() == [50, 100, 150, 200, 250, 300]
    rows = [row for row in result.rows if row["kind"] == "evaluation"]
    assert all(row["mean_return"] == np.mean(row["returns"]) for row in rows)


@pytest.mark.parametrize("agent_type", AGENT_TYPES)
def test_a_training_stopped_inside_an_episode_resumes_exactly(agent_type, tmp_path):
    make, options = AGENT_TYPES[agent_type]

    def env():
        return gym.make("Pendulum-v1", max_episode_steps=40)

    def new_training(*callbacks):
        agent = make(env(), seed=3, **options)
        return Training(agent, env(), steps=300, seed=9, callbacks=callbacks)

    cuts = np.random.default_rng(5).integers(1, 300, 12)
    check_exact_resume(new_training, env, tmp_path / "t", cuts)


def test_a_training_stopped_before_or_after_the_end_of_its_warm_up_resumes_exactly(tmp_path):
    env = gym.make("CartPole-v1")

    def new_training(*callbacks):
        agent = SDNNQLearning(env, approximator=SMALL, warm_up_steps=200)
        return Training(agent, env, steps=500, callbacks=callbacks)

    agent = new_training().agent
    assert agent.is_warming_up
    refuses("observation_range", agent.q_values, env.reset()[0], error=RuntimeError)
    cuts = (1, 150, 199, 200, 201, 350)
    whole = check_exact_resume(new_training, lambda: env, tmp_path / "t", cuts)
    assert not whole.agent.is_warming_up
    assert whole.agent.learning_report()["n_corrections"] > 480, (
        "also in the warm-up's 200 of 500 steps"
    )


@pytest.mark.parametrize("missing", ["hold", "code"])
def test_a_training_with_missing_observations_resumes_exactly(missing, tmp_path):
    class Echo(Corridor):
        """A sonar that receives no echo in cell 1: the reading is infinite, that is missing."""

        observation_space = gym.spaces.Box(0.0, np.inf, (1,), dtype=np.float64)

        def _observation(self):
            return np.array([np.inf if self._at == 1 else self._at])

    def new_training(*callbacks):
        agent = SDNNQLearning(Echo(), approximator=SMALL, observation_range=(0, 4), missing=missing)
        return Training(agent, Echo(), steps=60, callbacks=callbacks)

    check_exact_resume(new_training, Echo, tmp_path / "t", range(1, 10))


def test_resuming_refuses_an_environment_that_does_not_reproduce_its_episode(tmp_path):
    env = Corridor(is_random=True)
    Training(corridor_agent(), env, steps=500, callbacks=[Stop(20, tmp_path / "t")]).run()
    refuses("env", Training.load, tmp_path / "t", env, error=UnrepeatedEpisodeError)


def test_resuming_without_repeating_abandons_the_unfinished_episode(tmp_path):
    env = Corridor(is_random=True)
    first = corridor_agent()
    path = tmp_path / "rows.jsonl"
    callbacks = [JSONLines(path), Stop(20, tmp_path / "t")]
    Training(first, env, steps=200, callbacks=callbacks).run()
    new = Corridor(is_random=True)
    training = Training.load(
        tmp_path / "t", new, callbacks=[JSONLines(path)], repeat_episodes=False
    )
    assert new.seeds == [], "nothing happens in the environment before it resumes"
    assert states_equal(training.agent, first)
    assert training.n_steps == 20
    assert training.run().n_steps == 200
    assert not set(new.seeds) & set(env.seeds), "the episode that was left is not begun again"
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    assert [row["episode"] for row in rows] == list(range(training.n_episodes))
    assert [row["step"] for row in rows] == sorted(row["step"] for row in rows)
    unfinished = 20 - sum(row["length"] for row in rows if row["step"] <= 20)
    assert unfinished > 0
    learned = sum(row["length"] for row in rows)
    assert rows[-1]["step"] == learned + unfinished, "the steps of what was left count"


def test_a_training_stopped_between_episodes_resumes_the_same_with_and_without_repeating(tmp_path):
    class StopBetween(Callback):
        def on_row(self, training, row):
            if row["episode"] == 5:
                training.stop()

    training = Training(corridor_agent(), Corridor(), steps=200, callbacks=[StopBetween()])
    training.run()
    training.save(tmp_path / "t")
    resumed = [
        Training.load(tmp_path / "t", Corridor(), repeat_episodes=repeats)
        for repeats in (True, False)
    ]
    assert [training.run().n_steps for training in resumed] == [200, 200]
    assert states_equal(*(training.agent for training in resumed))


def test_n_step_transitions_of_an_abandoned_episode_are_learned_on_resuming(tmp_path):
    env = Corridor()
    learning = QLearningConfig(n_steps=3)
    Training(
        corridor_agent(learning=learning), env, steps=200, callbacks=[Stop(20, tmp_path / "t")]
    ).run()
    with_training = Training.load(tmp_path / "t", Corridor(), steps=20 + 1, repeat_episodes=False)
    with_training.run()
    by_hand, at = load_agent(tmp_path / "t"), Corridor()
    observation, _ = at.reset(seed=env.seeds[-1])
    by_hand.begin_episode()
    action = by_hand.act(observation)
    next_observation, reward, terminated, _, _ = at.step(action)
    by_hand.learn(Transition(observation, action, reward, next_observation, terminated))
    by_hand.progress = 1.0
    assert states_equal(with_training.agent, by_hand)


@pytest.mark.filterwarnings("ignore:an episode has had")
def test_an_endless_episode_takes_less_than_32_bytes_per_step_and_resumes_exactly(tmp_path):
    early, late = 2_000, 20_000

    class Endless(Corridor):
        def step(self, action):
            self._at = int(np.clip(self._at + (1 if action else -1), 0, 4))
            return self._observation(), float(self._at == 2), False, False, {}

    class Watch(Callback):
        def __init__(self):
            self.bytes = {}

        def on_step(self, training):
            if training.n_steps in (early, late):
                self.bytes[training.n_steps] = tracemalloc.get_traced_memory()[0]

    watch = Watch()
    training = Training(corridor_agent(), Endless(), steps=20_500, callbacks=[watch])
    tracemalloc.start()
    try:
        training.run()
    finally:
        tracemalloc.stop()
    assert (watch.bytes[late] - watch.bytes[early]) / (late - early) < 32
    training.save(tmp_path / "t")
    again = Training.load(tmp_path / "t", Endless(), steps=20_600)
    training.steps = 20_600
    assert training.run().n_steps == again.run().n_steps == 20_600
    assert states_equal(training.agent, again.agent)


class Unterminated(Corridor):
    """Episodes are cut off where the corridor's would terminate."""

    def step(self, action):
        observation, reward, terminated, truncated, info = super().step(action)
        return observation, reward, False, truncated or terminated, info


@pytest.mark.parametrize(
    ("discount", "n_environments", "env_class", "limit_bootstraps", "warned_at"),
    [
        (0.999, 1, Unterminated, True, 2_000),
        (1.0, 2, Unterminated, True, 4_000),
        (0.998, 1, Unterminated, True, None),
        (0.999, 1, Corridor, True, None),
        (0.999, 1, Unterminated, False, None),
    ],
)
def test_a_discount_near_1_is_warned_of_once_where_nothing_terminates(
    discount, n_environments, env_class, limit_bootstraps, warned_at, tmp_path
):
    env = env_class()
    if n_environments > 1:
        env = gym.vector.SyncVectorEnv([env_class] * n_environments)
    agent = corridor_agent(learning=QLearningConfig(discount=discount))
    for n_steps in (1_999, 6_000):
        training = Training(agent, env, steps=n_steps, limit_bootstraps=limit_bootstraps)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            training.run()
        messages = [str(warning.message) for warning in caught]
        is_warned = warned_at is not None and n_steps >= warned_at
        assert [f"discount of {discount:g} values" in text for text in messages] == [
            True
        ] * is_warned
    training.save(tmp_path / "t")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Training.load(tmp_path / "t", env, steps=10_000).run()


def test_a_training_continues_after_a_warning_that_is_an_error():
    class Notes(Callback):
        step_interval = 1_000
        steps = ()

        def on_step(self, training):
            self.steps += (training.n_steps,)

    agent, notes = corridor_agent(learning=QLearningConfig(discount=0.999)), Notes()
    training = Training(agent, Unterminated(), steps=3_000, callbacks=[notes])
    for _ in training.pieces(0.0):
        break
    assert 0 < training.n_steps < 2_000
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning, match=r"discount of 0\.999 values"):
            training.run()
        assert training.n_steps == 2_000
        training.run()
    assert training.n_steps == 3_000
    assert notes.steps == (1_000, 2_000, 3_000)


def test_evaluations_every_5_episodes_come_at_their_ends_and_resume_exactly(tmp_path):
    def new_training(*callbacks):
        return Training(
            corridor_agent(), Corridor(), episodes=30, evaluate_every_episodes=5,
            evaluation_env=Corridor(), evaluation_episodes=2, callbacks=callbacks,
        )  # fmt: skip

    rows = new_training().run().rows
    evaluations = [row for row in rows if row["kind"] == "evaluation"]
    assert [row["episode"] for row in evaluations] == [5, 10, 15, 20, 25, 30]
    assert all(len(row["lengths"]) == len(row["terminated"]) == 2 for row in evaluations)
    ends = {row["step"] for row in rows if row["kind"] == "episode"}
    assert {row["step"] for row in evaluations} <= ends
    cuts = (3, 20, 47, evaluations[2]["step"])
    check_exact_resume(new_training, Corridor, tmp_path / "t", cuts, evaluation_env=Corridor())


def test_with_seed_none_no_reset_has_a_seed_and_no_episode_can_be_repeated(tmp_path):
    env, tested = Corridor(), Corridor()
    training = Training(
        corridor_agent(), env, episodes=6, seed=None, evaluate_every_episodes=2,
        evaluation_env=tested, callbacks=[Stop(7, tmp_path / "t")],
    )  # fmt: skip
    training.run()  # stops within an episode
    training.run()
    # Six episodes, and an evaluation of ten after each second of them.
    assert (env.seeds, tested.seeds) == ([None] * 6, [None] * (6 // 2 * 10))
    refuses("repeat_episodes", Training.load, tmp_path / "t", Corridor(), evaluation_env=Corridor())
    loaded = Training.load(
        tmp_path / "t", Corridor(), evaluation_env=Corridor(), repeat_episodes=False
    )
    assert loaded.run().n_episodes == 6


def test_reset_options_depend_on_the_number_of_the_episode():
    class Recorder(Corridor):
        def __init__(self):
            super().__init__()
            self.numbers = []

        def reset(self, *, seed=None, options=None):
            self.numbers.append(options["number"])
            return super().reset(seed=seed)

    env, tested = Recorder(), Recorder()
    training = Training(
        corridor_agent(), env, episodes=4, evaluate_every_episodes=2, evaluation_env=tested,
        evaluation_episodes=1, reset_options=lambda episode: {"number": episode},
    )  # fmt: skip
    training.run()
    assert (env.numbers, tested.numbers) == ([1, 2, 3, 4], [2, 4])


def test_reset_options_are_refused_with_a_vector():
    envs = gym.vector.SyncVectorEnv([Corridor] * 2)
    refuses("reset_options", Training, corridor_agent(), envs, steps=9, reset_options=dict)


def test_without_limit_bootstraps_a_truncation_is_learned_as_a_termination():
    class RecordingAgent:
        def __init__(self):
            self.terminated = []

        def begin_episode(self):
            pass

        def act(self, observation, explore=True):
            return 0

        def learn(self, transition):
            self.terminated.append(transition.terminated)

    agents = RecordingAgent(), RecordingAgent()
    for agent, bootstraps in zip(agents, (True, False), strict=True):
        Training(agent, Corridor(), episodes=1, limit_bootstraps=bootstraps).run()
    assert agents[0].terminated == [False] * 8
    assert agents[1].terminated == [False] * 7 + [True]


def test_a_training_in_pieces_learns_the_same_as_a_whole_one():
    whole, pieces = (Training(corridor_agent(), Corridor(), steps=60) for _ in range(2))
    whole.run()
    assert sum(1 for _ in pieces.pieces(0.0)) == 60
    assert states_equal(whole.agent, pieces.agent)


def test_closing_the_generator_of_pieces_ends_the_callbacks_and_the_training_can_continue():
    n_steps_at_end = []

    class AtEnd(Callback):
        def on_end(self, training):
            n_steps_at_end.append(training.n_steps)

    training = Training(corridor_agent(), Corridor(), steps=60, callbacks=[AtEnd()])
    generator = training.pieces(0.0)
    next(generator)
    generator.close()
    assert (n_steps_at_end, training.n_steps) == ([1], 1)
    assert training.run().n_steps == 60


def test_a_reward_threshold_with_patience_2_stops_after_two_good_evaluations():
    stop = StopTrainingOnRewardThreshold(mean_return=0.6, patience=2)
    result = corridor_agent().train(
        Corridor(), steps=20_000, callbacks=[stop], evaluate_every=200, evaluation_env=Corridor()
    )
    assert not result.is_finished
    assert (result.evaluations[-2:, 1] >= 0.6).all()


def test_patience_counts_evaluations_from_before_a_training_was_loaded(tmp_path):
    # Every evaluation, after each 10 steps, reaches the threshold: the third one stops.
    stop = StopTrainingOnRewardThreshold(mean_return=-np.inf, patience=3)

    def new_training(*callbacks):
        return Training(
            corridor_agent(), Corridor(), steps=100, callbacks=[stop, *callbacks],
            evaluate_every=10, evaluation_env=Corridor(),
        )  # fmt: skip

    whole = check_exact_resume(
        new_training,
        Corridor,
        tmp_path / "t",
        (15, 20, 25, 29),
        callbacks=[stop],
        evaluation_env=Corridor(),
    )
    assert whole.n_steps == 30


def test_the_result_of_a_continued_training_has_all_of_its_episodes():
    training = Training(corridor_agent(), Corridor(), steps=300)
    training.callbacks = (Stop(100),)
    training.run()
    training.callbacks = ()
    result = training.run()
    assert len(result.returns) == result.n_episodes > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "episodes"),
        ({"steps": 10, "episodes": 1}, "episodes"),
        ({"steps": 10, "evaluate_every": 5}, "evaluation_env"),
        ({"steps": 10, "evaluate_every_episodes": 5}, "evaluation_env"),
        ({"steps": 10, "evaluate_every": 5, "evaluate_every_episodes": 5}, "evaluate_every"),
    ],
)
def test_missing_or_conflicting_goals_and_evaluations_are_refused(options, message):
    refuses(message, Training, corridor_agent(), Corridor(), **options)
