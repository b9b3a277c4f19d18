"""Training loops over single environments: rows, failures, evaluations, and exact resuming."""

import copy
import json
import re
import tracemalloc
import warnings
from decimal import Decimal
from functools import partial

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
AGENTS = {
    "sdnn": partial(SDNNQLearning, approximator=SMALL),
    "rbf": RBFQLearning,
    "fuzzy": FuzzyQLearning,
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
        self._cell, self._steps = int(self.np_random.integers(2)), 0
        return self._observation(), {}

    def step(self, action):
        self._cell = max(0, self._cell + (1 if action else -1))
        self._steps += 1
        terminated = self._cell == 4
        return self._observation(), 1.0 if terminated else -0.1, terminated, self._steps == 8, {}

    def _observation(self):
        shift = np.random.default_rng().uniform(0, 0.1) if self._is_random else 0.0
        return np.array([self._cell + shift])


class Point(gym.Env):
    """A point that is rewarded in the middle of a line; episodes have 20 steps.

    With ``in_place`` it returns its state without a copy, and changes the action.
    """

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), dtype=np.float64)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), dtype=np.float64)

    def __init__(self, in_place=False):
        self._in_place = in_place
        self._state = np.zeros(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._state[:] = self.np_random.uniform(-1.0, 1.0, 2)
        self._steps = 0
        return self._observation(), {}

    def step(self, action):
        force = action if self._in_place else action.copy()
        force *= 0.1
        self._state[:] = np.clip(self._state + np.append(force, 0.0), -1.0, 1.0)
        self._steps += 1
        reward = np.array([-abs(self._state[0])])
        return self._observation(), reward, np.bool_(False), self._steps == 20, {}

    def _observation(self):
        return self._state if self._in_place else self._state.copy()


def corridor_agent(**options):
    return SDNNQLearning(Corridor(), approximator=SMALL, seed=1, **options)


@pytest.mark.parametrize("name", AGENTS)
def test_environments_that_modify_arrays_in_place_do_not_change_learning(name):
    agents = []
    for in_place in (False, True):
        agent, evaluations = AGENTS[name](Point(), seed=3), Point(in_place)
        agent.train(Point(in_place), steps=300, evaluate_every=100, evaluation_env=evaluations)
        agents.append(agent)
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
    agent, env, envs = corridor_agent(), Corridor(), gym.vector.SyncVectorEnv([Corridor] * 2)
    refuses("env", evaluate, agent, envs, error=TypeError)
    for wrong, error in ((envs, TypeError), (env, ValueError)):
        evaluations = {"evaluate_every": 5, "evaluation_env": wrong}
        refuses("evaluation_env", agent.train, env, steps=10, error=error, **evaluations)


def test_an_evaluation_warns_of_an_episode_of_more_than_100_000_steps():
    class Endless(Corridor):
        def step(self, action):
            self._steps += 1
            return np.zeros(1), 0.0, self._steps == 100_001, False, {}

    class ConstantAgent:
        def act(self, observation, explore=True):
            return 0

    with pytest.warns(RuntimeWarning, match="max_episode_steps"):
        assert evaluate(ConstantAgent(), Endless(), 1).lengths.tolist() == [100_001]


def test_a_training_warns_once_of_an_episode_that_continues_after_10_000_steps():
    unlimited = gym.make("Pendulum-v1", max_episode_steps=20_001)
    agent = SDNNQLambda(unlimited, warm_up_steps=10)
    with pytest.warns(RuntimeWarning, match="max_episode_steps") as warned:
        agent.train(unlimited, steps=10_002)
    assert len(warned) == 1
    limited = gym.make("Pendulum-v1", max_episode_steps=10_000)
    assert agent.train(limited, steps=10_001).n_episodes == 1  # a warning would be an error


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

    Episodes have eight steps, so that both are in the second episode, which has the number 1.
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
def test_errors_of_unusable_steps_and_resets_name_step_and_episode(replaced, step, where, problem):
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
    agent = FuzzyQLearning(env)
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


class FailsOnce(Point):
    """A point whose n-th call of "step" or "reset" fails by an error, or by a reward of NaN."""

    def __init__(self, method="", n_calls=0, failure=TimeoutError):
        super().__init__()
        self._method, self._n_calls_left, self._failure = method, n_calls, failure

    def reset(self, **options):
        self._fails("reset")
        return super().reset(**options)

    def step(self, action):
        observation, reward, *others = super().step(action)
        return observation, np.nan if self._fails("step") else float(reward[0]), *others

    def _fails(self, method):
        if method != self._method:
            return False
        self._n_calls_left -= 1
        if self._n_calls_left == 0 and self._failure is TimeoutError:
            raise TimeoutError("no answer")
        return self._n_calls_left == 0


@pytest.mark.parametrize("name", AGENTS)
@pytest.mark.parametrize(
    ("method", "n_calls", "error", "n_learned"),
    [
        ("step", 1, TimeoutError, 0),
        ("step", 33, TimeoutError, 32),
        ("step", 33, UnusableStepError, 32),
        ("reset", 1, TimeoutError, 0),
        ("reset", 3, TimeoutError, 40),
    ],
)
def test_steps_before_a_failure_of_the_environment_are_kept_and_the_training_continues(
    name, method, n_calls, error, n_learned, tmp_path
):
    agent = AGENTS[name](Point(), seed=3)
    path, rows = tmp_path / "checkpoint", JSONLines(tmp_path / "rows.jsonl")
    callbacks = [rows, CheckpointCallback(path, every=1000)]
    training = Training(agent, FailsOnce(method, n_calls, error), steps=100, callbacks=callbacks)
    with pytest.raises(error):
        training.run()
    assert not training.is_within_step
    loaded = Training.load(path, FailsOnce())  # an environment that does not fail
    assert loaded.n_steps == training.n_steps == n_learned
    assert states_equal(loaded.agent, agent)
    # Episodes have 20 steps. A failure at step 33 leaves one whole episode, 12 steps of an
    # abandoned one, and 68 steps for three more; other failures leave five whole ones.
    for resumed in (loaded, training):
        resumed.run()
        assert (resumed.n_steps, resumed.n_episodes) == (100, 4 if n_learned == 32 else 5)
    assert states_equal(loaded.agent, agent)
    lines = [json.loads(line) for line in rows.path.read_text().splitlines()]
    assert [row["episode"] for row in lines] == list(range(training.n_episodes))
    assert {row["length"] for row in lines} == {20}


ACTIONS_IN_FILE = "training.0.actions"


def save_with_changed_actions(path, change):
    """Save a training in its third step, and change the actions of its episode in the file."""
    Training(corridor_agent(), Corridor(), episodes=9, callbacks=[Stop(3, path)]).run()
    description, arrays = read_file(path, "training")
    arrays[ACTIONS_IN_FILE] = change(arrays[ACTIONS_IN_FILE])
    write_file(path, "training", arrays, description)


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
    save_with_changed_actions(path, change)
    refuses(ACTIONS_IN_FILE, Training.load, path, Corridor())


def test_a_checkpoint_without_its_actions_cannot_repeat_the_episode(tmp_path):
    path = tmp_path / "checkpoint"
    save_with_changed_actions(path, lambda actions: actions[:0])
    with pytest.raises(UnrepeatedEpisodeError):  # the first observation is not the fourth
        Training.load(path, Corridor())


@pytest.mark.parametrize("resets_itself", [False, True])
def test_steps_before_a_failure_in_a_vector_are_kept_and_the_training_continues(
    resets_itself, tmp_path
):
    envs = gym.vector.SyncVectorEnv([FailsOnce, partial(FailsOnce, "step", 33)])
    if resets_itself:  # the wrapper cannot reset a single environment: the vector resets itself
        envs = gym.wrappers.vector.NormalizeObservation(envs)
    agent = AGENTS["sdnn"](envs, seed=3)
    path = tmp_path / "checkpoint"
    training = Training(agent, envs, steps=200, callbacks=[CheckpointCallback(path, every=1000)])
    with pytest.raises(TimeoutError):
        training.run()
    new_envs = gym.vector.SyncVectorEnv([FailsOnce] * 2)
    if resets_itself:  # spaces of the normalized vector, whose episodes cannot be repeated
        new_envs = gym.wrappers.vector.TransformObservation(
            new_envs, np.asarray, envs.observation_space, envs.single_observation_space
        )
    loaded = Training.load(path, new_envs, repeat_episodes=not resets_itself)
    assert loaded.n_steps == training.n_steps == 64, "32 steps of two environments before step 33"
    training.run()
    loaded.run()
    assert training.n_steps == loaded.n_steps == 200
    # The failure abandons the episodes of both environments, after 12 of their 20 steps. Each had a
    # whole one before it, and has three in the 68 steps that are left to it.
    assert training.n_episodes == loaded.n_episodes == 8
    # The environments of the loaded training have the normalized spaces, but do not normalize.
    assert states_equal(loaded.agent, agent) != resets_itself


def test_resuming_skips_an_episode_whose_reset_failed(tmp_path):
    env = Corridor()
    corridor_agent().train(env, episodes=4, seed=7)
    bad_seeds = env.seeds[2:4]  # of the third and fourth episode

    class FailsForSeeds(Corridor):
        def reset(self, *, seed=None, options=None):
            if seed in bad_seeds:
                raise RuntimeError("no such start")
            return super().reset(seed=seed)

    path = tmp_path / "checkpoint"
    callbacks = [CheckpointCallback(path)]
    training = Training(corridor_agent(), FailsForSeeds(), episodes=4, seed=7, callbacks=callbacks)
    for _ in bad_seeds:
        refuses("start", training.run, error=RuntimeError)
        assert training.n_episodes == 2
        training = Training.load(path, FailsForSeeds(), callbacks=callbacks)
    assert training.run().n_episodes == 4
    assert training.next_episode == 4 + len(bad_seeds), "skipped episodes count"


@pytest.mark.parametrize("n_envs", [1, 2])
def test_a_training_stopped_after_a_failure_resumes_exactly(n_envs, tmp_path):
    def new_env(*failure):
        makers = [FailsOnce] * (n_envs - 1) + [partial(FailsOnce, *failure)]
        return gym.vector.SyncVectorEnv(makers) if n_envs > 1 else makers[0]()

    def continued_after_a_failure(*callbacks):
        agent = AGENTS["sdnn"](Point(), seed=3)
        training = Training(agent, new_env("step", 33), steps=200, callbacks=callbacks)
        with pytest.raises(TimeoutError):
            training.run()
        training.run()
        return training

    expected = continued_after_a_failure()
    stopped = continued_after_a_failure(Stop(150, tmp_path / "training"))
    assert not stopped.is_finished
    resumed = Training.load(tmp_path / "training", new_env())
    assert resumed.run().is_finished
    assert states_equal(expected.agent, resumed.agent)
    assert expected.next_episode == resumed.next_episode


def test_resuming_first_repeats_a_failed_evaluation(tmp_path):
    path, rows, expected_rows = (tmp_path / name for name in ("checkpoint", "rows", "expected"))

    def new_training(evaluation_env, rows):
        return Training(
            AGENTS["sdnn"](Point(), seed=3), FailsOnce(), steps=100,
            evaluate_every=25, evaluation_episodes=2, evaluation_env=evaluation_env,
            callbacks=[JSONLines(rows), CheckpointCallback(path, every=1000)],
        )  # fmt: skip

    expected = new_training(FailsOnce(), expected_rows)
    expected.run()
    # An evaluation has two episodes: the third reset begins the second evaluation, at step 50.
    training = new_training(FailsOnce("reset", 3), rows)
    with pytest.raises(TimeoutError):
        training.run()
    assert (training.n_steps, training.is_within_step, len(training.evaluations)) == (50, False, 1)
    fails_again = FailsOnce("reset", 1)
    options = {"evaluation_env": fails_again, "callbacks": [JSONLines(rows)]}
    loaded = Training.load(path, FailsOnce(), **options)
    with pytest.raises(TimeoutError):
        loaded.run()
    assert loaded.n_steps == 50
    for resumed in (loaded, training):
        resumed.run()
        assert resumed.evaluations == expected.evaluations
        assert states_equal(resumed.agent, expected.agent)

    assert rows.read_text() == expected_rows.read_text()


def test_further_trainings_of_an_agent_and_its_copies_continue_the_seeds_of_episodes(tmp_path):
    env, agent = Corridor(), corridor_agent()
    agent.train(env, episodes=3)
    agent.save(tmp_path / "agent")
    seeds, further_seeds = env.seeds, []
    for copied in (agent, load_agent(tmp_path / "agent"), copy.deepcopy(agent)):
        env.seeds = []
        copied.train(env, steps=20)
        further_seeds.append(env.seeds)
    assert further_seeds == [further_seeds[0]] * 3
    seeds += further_seeds[0]
    assert len(set(seeds)) == len(seeds), "no seed occurs twice"
    undivided = Corridor()
    corridor_agent().train(undivided, episodes=5)
    assert undivided.seeds == seeds[:5]


def test_episode_seeds_are_unique_reproducible_and_apart_from_those_of_evaluations():
    n_episodes, seed = 30, 4
    env, evaluation_env, agent = Corridor(), Corridor(), corridor_agent()
    for _ in range(2):
        agent.train(env, episodes=n_episodes, seed=seed)
    evaluate(agent, evaluation_env, n_episodes, seed=seed)
    seeds, seeds_again = env.seeds[:n_episodes], env.seeds[n_episodes:]
    assert seeds == seeds_again
    assert len({*seeds, *evaluation_env.seeds}) == 2 * n_episodes


def test_sdnn_q_learning_learns_the_shortest_way_through_a_corridor():
    agent = corridor_agent()
    result = agent.train(Corridor(), episodes=300)
    assert result.is_finished
    assert (result.n_episodes, len(result.returns)) == (300, 300)
    evaluation = evaluate(agent, Corridor(), 20, seed=3)
    assert evaluation.terminated.all()
    assert set(evaluation.lengths) <= {3, 4}, "from cell 0 or 1 straight to cell 4"
    assert evaluation.mean_return == evaluation.returns.mean() > 0.6, "1 minus at most 3 * 0.1"


def test_evaluations_report_mean_returns_and_do_not_change_what_is_learned():
    agent, unevaluated = corridor_agent(), corridor_agent()
    unevaluated.train(Corridor(), steps=300)
    result = agent.train(Corridor(), steps=300, evaluate_every=50, evaluation_env=Corridor())
    expected, state = unevaluated.state(), agent.state()
    # Only the generator that breaks ties in evaluations has drawn numbers.
    differ = {name for name in state if not np.array_equal(state[name], expected[name])}
    assert differ <= {"agent.policy.evaluation_ties.words"}
    assert result.evaluations[:, 0].tolist() == [50, 100, 150, 200, 250, 300]
    rows = [row for row in result.rows if row["kind"] == "evaluation"]
    assert all(row["mean_return"] == np.mean(row["returns"]) for row in rows)


@pytest.mark.parametrize("name", AGENTS)
def test_a_training_stopped_inside_an_episode_resumes_exactly(name, tmp_path):
    def new_env():
        return gym.make("Pendulum-v1", max_episode_steps=40)

    def new_training(*callbacks):
        agent = AGENTS[name](new_env(), seed=3)
        return Training(agent, new_env(), steps=300, seed=9, callbacks=callbacks)

    stop_steps = np.random.default_rng(5).integers(1, 300, 12)
    check_exact_resume(new_training, new_env, tmp_path / "t", stop_steps)


def test_a_training_stopped_before_or_after_the_end_of_its_warm_up_resumes_exactly(tmp_path):
    env = gym.make("CartPole-v1")

    def new_training(*callbacks):
        agent = SDNNQLearning(env, approximator=SMALL, warm_up_steps=200)
        return Training(agent, env, steps=500, callbacks=callbacks)

    agent = new_training().agent
    assert agent.is_warming_up
    refuses("observation_range", agent.q_values, env.reset()[0], error=RuntimeError)
    stop_steps = (1, 150, 199, 200, 201, 350)
    finished = check_exact_resume(new_training, lambda: env, tmp_path / "t", stop_steps).agent
    assert not finished.is_warming_up
    # The 200 transitions of the warm-up are learned at its end, as well as the other 300.
    assert finished.learning_report()["n_corrections"] > 480, "most of 500 steps"


@pytest.mark.parametrize("missing", ["hold", "code"])
def test_a_training_with_missing_observations_resumes_exactly(missing, tmp_path):
    class Sonar(Corridor):
        """A sonar without echo in cell 1, where the observation is infinite: a missing value."""

        observation_space = gym.spaces.Box(0.0, np.inf, (1,), dtype=np.float64)

        def _observation(self):
            return np.array([np.inf if self._cell == 1 else self._cell])

    def new_training(*callbacks):
        agent = SDNNQLearning(
            Sonar(), approximator=SMALL, observation_range=(0, 4), missing=missing
        )
        return Training(agent, Sonar(), steps=60, callbacks=callbacks)

    check_exact_resume(new_training, Sonar, tmp_path / "t", range(1, 10))


def test_resuming_refuses_an_environment_that_does_not_reproduce_its_episode(tmp_path):
    env = Corridor(is_random=True)
    Training(corridor_agent(), env, steps=500, callbacks=[Stop(20, tmp_path / "t")]).run()
    refuses("env", Training.load, tmp_path / "t", env, error=UnrepeatedEpisodeError)


def test_resuming_without_repeating_abandons_the_unfinished_episode(tmp_path):
    env, new_env, agent = Corridor(is_random=True), Corridor(is_random=True), corridor_agent()
    path, rows = tmp_path / "training", JSONLines(tmp_path / "rows.jsonl")
    Training(agent, env, steps=200, callbacks=[rows, Stop(20, path)]).run()
    training = Training.load(path, new_env, callbacks=[rows], repeat_episodes=False)
    assert new_env.seeds == [], "loading does not reset the environment"
    assert states_equal(training.agent, agent)
    assert training.n_steps == 20
    assert training.run().n_steps == 200
    assert not set(new_env.seeds) & set(env.seeds), "the abandoned episode is not begun again"
    rows = [json.loads(line) for line in rows.path.read_text().splitlines()]
    assert [row["episode"] for row in rows] == list(range(training.n_episodes))
    assert [row["step"] for row in rows] == sorted(row["step"] for row in rows)
    n_abandoned = 20 - sum(row["length"] for row in rows if row["step"] <= 20)
    assert n_abandoned > 0
    n_in_rows = sum(row["length"] for row in rows)
    assert rows[-1]["step"] == n_in_rows + n_abandoned, "abandoned steps count"


def test_a_training_stopped_between_episodes_resumes_the_same_with_and_without_repeating(tmp_path):
    class StopAfterEpisode5(Callback):
        def on_row(self, training, row):
            if row["episode"] == 5:
                training.stop()

    training = Training(corridor_agent(), Corridor(), steps=200, callbacks=[StopAfterEpisode5()])
    training.run()
    training.save(tmp_path / "t")
    repeating = Training.load(tmp_path / "t", Corridor())
    not_repeating = Training.load(tmp_path / "t", Corridor(), repeat_episodes=False)
    assert repeating.run().n_steps == not_repeating.run().n_steps == 200
    assert states_equal(repeating.agent, not_repeating.agent)


def test_n_step_transitions_of_an_abandoned_episode_are_learned_on_resuming(tmp_path):
    agent, path = corridor_agent(learning=QLearningConfig(n_steps=3)), tmp_path / "training"
    Training(agent, Corridor(), steps=200, callbacks=[Stop(20, path)]).run()
    resumed_env = Corridor()
    resumed = Training.load(path, resumed_env, steps=20 + 1, repeat_episodes=False)
    resumed.run()
    by_hand, env = load_agent(path), Corridor()
    observation, _ = env.reset(seed=resumed_env.seeds[0])
    by_hand.begin_episode()  # learns the pending transitions of the abandoned episode
    action = by_hand.act(observation)
    next_observation, reward, terminated, _, _ = env.step(action)
    by_hand.learn(Transition(observation, action, reward, next_observation, terminated))
    by_hand.progress = 1.0  # of 21 steps
    assert states_equal(resumed.agent, by_hand)


@pytest.mark.filterwarnings("ignore:an episode has had")
def test_an_endless_episode_takes_less_than_32_bytes_per_step_and_resumes_exactly(tmp_path):
    early, late = 2_000, 20_000

    class Endless(Corridor):
        def step(self, action):
            self._cell = int(np.clip(self._cell + (1 if action else -1), 0, 4))
            return self._observation(), float(self._cell == 2), False, False, {}

    n_bytes = {}

    class NoteMemory(Callback):
        def on_step(self, training):
            if training.n_steps in (early, late):
                n_bytes[training.n_steps] = tracemalloc.get_traced_memory()[0]

    training = Training(corridor_agent(), Endless(), steps=20_500, callbacks=[NoteMemory()])
    tracemalloc.start()
    try:
        training.run()
    finally:
        tracemalloc.stop()
    assert (n_bytes[late] - n_bytes[early]) / (late - early) < 32
    training.save(tmp_path / "t")
    loaded = Training.load(tmp_path / "t", Endless(), steps=20_600)
    training.steps = 20_600
    assert training.run().n_steps == loaded.run().n_steps == 20_600
    assert states_equal(training.agent, loaded.agent)


class Unterminated(Corridor):
    """A corridor whose episodes are truncated in cell 4, never terminated."""

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
)  # 2,000 steps in each environment; none for discounts up to 0.998 or where an episode terminates
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
        n_warnings = int(warned_at is not None and n_steps >= warned_at)
        assert len(messages) == n_warnings
        assert all(f"discount of {discount:g} values" in message for message in messages)
    training.save(tmp_path / "t")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Training.load(tmp_path / "t", env, steps=10_000).run()


def test_a_training_continues_after_a_warning_that_is_an_error():
    steps_of_calls = []

    class NoteSteps(Callback):
        step_interval = 1_000

        def on_step(self, training):
            steps_of_calls.append(training.n_steps)

    agent = corridor_agent(learning=QLearningConfig(discount=0.999))
    training = Training(agent, Unterminated(), steps=3_000, callbacks=[NoteSteps()])
    next(training.pieces(0.0))
    assert 0 < training.n_steps < 2_000
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning, match=r"discount of 0\.999 values"):
            training.run()
        assert training.n_steps == 2_000
        training.run()
    assert training.n_steps == 3_000
    assert steps_of_calls == [1_000, 2_000, 3_000]


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
    stop_steps = (3, 20, 47, evaluations[2]["step"])
    options = {"evaluation_env": Corridor()}
    check_exact_resume(new_training, Corridor, tmp_path / "t", stop_steps, **options)


def test_with_seed_none_no_reset_has_a_seed_and_no_episode_can_be_repeated(tmp_path):
    env, evaluation_env = Corridor(), Corridor()
    training = Training(
        corridor_agent(), env, episodes=6, seed=None, evaluate_every_episodes=2,
        evaluation_env=evaluation_env, callbacks=[Stop(7, tmp_path / "t")],
    )  # fmt: skip
    training.run()  # stops within an episode
    training.run()
    # Six episodes, and an evaluation of ten after each second of them.
    assert (env.seeds, evaluation_env.seeds) == ([None] * 6, [None] * (6 // 2 * 10))
    refuses("repeat_episodes", Training.load, tmp_path / "t", Corridor(), evaluation_env=Corridor())
    loaded = Training.load(
        tmp_path / "t", Corridor(), evaluation_env=Corridor(), repeat_episodes=False
    )
    assert loaded.run().n_episodes == 6


def test_reset_options_depend_on_the_number_of_the_episode():
    class NotesOptions(Corridor):
        def __init__(self):
            super().__init__()
            self.numbers = []

        def reset(self, *, seed=None, options=None):
            self.numbers.append(options["number"])
            return super().reset(seed=seed)

    env, evaluation_env = NotesOptions(), NotesOptions()
    training = Training(
        corridor_agent(), env, episodes=4, evaluate_every_episodes=2, evaluation_episodes=1,
        evaluation_env=evaluation_env, reset_options=lambda episode: {"number": episode},
    )  # fmt: skip
    training.run()
    assert (env.numbers, evaluation_env.numbers) == ([1, 2, 3, 4], [2, 4])


@pytest.mark.parametrize("n_environments", [1, 2])
def test_reset_options_are_refused_with_a_vector(n_environments):
    envs = gym.vector.SyncVectorEnv([Corridor] * n_environments)
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
        training = Training(agent, Corridor(), episodes=1, limit_bootstraps=bootstraps)
        training.run()
        training.episodes, training.limit_bootstraps = 2, not bootstraps  # of the second episode
        training.run()
    assert agents[0].terminated == [False] * 15 + [True]
    assert agents[1].terminated == [False] * 7 + [True] + [False] * 8


def test_a_training_in_pieces_of_0_seconds_yields_after_each_step_and_learns_as_usual():
    undivided, in_pieces = (Training(corridor_agent(), Corridor(), steps=60) for _ in range(2))
    undivided.run()
    assert len(list(in_pieces.pieces(0.0))) == 60
    assert states_equal(undivided.agent, in_pieces.agent)


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

    options = {"callbacks": [stop], "evaluation_env": Corridor()}
    stop_steps = (15, 20, 25, 29)
    finished = check_exact_resume(new_training, Corridor, tmp_path / "t", stop_steps, **options)
    assert finished.n_steps == 30


def test_the_result_of_a_continued_training_has_all_of_its_episodes():
    training = Training(corridor_agent(), Corridor(), steps=300, callbacks=[Stop(100)])
    assert training.run().n_episodes > 0
    result = training.run()
    assert len(result.returns) == result.n_episodes >= 300 // 8, "episodes have at most 8 steps"


@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({}, "episodes"),
        ({"steps": 10, "episodes": 1}, "episodes"),
        ({"steps": 10, "evaluate_every": 5}, "evaluation_env"),
        ({"steps": 10, "evaluate_every_episodes": 5}, "evaluation_env"),
        ({"steps": 10, "evaluate_every": 5, "evaluate_every_episodes": 5}, "evaluate_every"),
    ],
)
def test_missing_or_conflicting_goals_and_evaluations_are_refused(options, argument):
    refuses(argument, Training, corridor_agent(), Corridor(), **options)
