"""An agent in several environments: order of learning, and exact resume."""

import itertools

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

import sdnn.environments  # noqa: F401  (registers the acrobot)
from refusals import refuses
from sdnn.agents import (
    Callback,
    CheckpointCallback,
    FuzzyQLearning,
    FuzzyQLearningConfig,
    JSONLines,
    QLearningConfig,
    RBFQLearning,
    SDNNQLearning,
    Training,
    Transition,
    UnrepeatedEpisodeError,
)
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.training.episodes import episode_seed
from stopped_training import Stop, check_exact_resume, states_equal

AutoresetMode = gym.vector.AutoresetMode

SMALL = SDNNCConfig(n_pattern_units=20, n_hidden_units=60, n_active_units=20, n_actions=5)
WITH_ALL_STATE = QLearningConfig(
    n_steps=3, epsilon=0.3, final_epsilon=0.01, n_greedy_steps=2, max_action_repeat=6,
    start_steps=9, value_range="adaptive",
)  # fmt: skip


class Walk(gym.Env):
    """A random walk on a line: episodes of 1 to 15 steps, terminated beyond 1 or truncated."""

    action_space = gym.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)

    def __init__(self, is_bounded=True, is_reproducible=True):
        bound = 2.0 if is_bounded else np.inf
        self.observation_space = gym.spaces.Box(-bound, bound, (2,), dtype=np.float64)
        self._is_reproducible = is_reproducible

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._at, self._steps = self.np_random.uniform(-0.5, 0.5), 0
        self._limit = int(self.np_random.integers(3, 16))
        return self._observation(), {}

    def step(self, action):
        assert self._steps < self._limit, "the episode is over"
        assert abs(self._at) <= 1.0, "the episode is over"
        self._at += 0.3 * float(action[0]) + self.np_random.normal(0.0, 0.1)
        self._steps += 1
        terminated = abs(self._at) > 1.0
        truncated = self._steps == self._limit and not terminated
        return self._observation(), -abs(self._at), terminated, truncated, {}

    def _observation(self):
        shift = 0.0 if self._is_reproducible else np.random.default_rng().uniform()
        return np.array([self._at, self._steps / 16 + shift])


class Unbounded(Walk):
    def __init__(self):
        super().__init__(is_bounded=False)


def sdnn_agent(env=None, **options):
    learning = WITH_ALL_STATE
    return SDNNQLearning(env or Walk(), approximator=SMALL, learning=learning, seed=3, **options)


def rbf_agent():
    return RBFQLearning(Walk(), approximator=RBFNetworkConfig(n_actions=7))


def fuzzy_agent(env=None, **options):
    learning = FuzzyQLearningConfig(trace_decay=0.7, n_greedy_steps=0, epsilon=0.3)
    sizes = FuzzyRulesConfig(n_sets=4)
    return FuzzyQLearning(env or Walk(), learning=learning, approximator=sizes, **options)


AGENTS = {
    "sdnn": (Walk, sdnn_agent),
    "sdnn, warm-up": (Unbounded, lambda: sdnn_agent(Unbounded(), warm_up_steps=60)),
    "rbf": (Walk, rbf_agent),
    "fuzzy": (Walk, fuzzy_agent),
    "fuzzy, warm-up": (Unbounded, lambda: fuzzy_agent(Unbounded(), warm_up_steps=60)),
}
"""Functions that make an environment and an agent."""


def sync_vector(n, env=Walk, mode="NEXT_STEP", **options):
    return SyncVectorEnv([env] * n, autoreset_mode=AutoresetMode[mode], **options)


def vectors(n):
    """Yield vector environments of all classes and modes, to be closed."""
    yield from (sync_vector(n, mode=mode) for mode in ("NEXT_STEP", "SAME_STEP", "DISABLED"))
    yield sync_vector(n, copy=False)
    yield AsyncVectorEnv([Walk] * n)
    yield AsyncVectorEnv([Walk] * n, autoreset_mode=AutoresetMode.SAME_STEP)
    yield AsyncVectorEnv([Walk] * n, shared_memory=False, autoreset_mode=AutoresetMode.DISABLED)


@pytest.mark.parametrize("name", AGENTS)
def test_a_vector_of_one_environment_has_the_bits_of_a_single_environment(name):
    new_env, new_agent = AGENTS[name]
    expected = new_agent()
    rows = expected.train(new_env(), steps=200, seed=4).rows
    vectors = (
        sync_vector(1, new_env),
        sync_vector(1, new_env, "SAME_STEP"),
        AsyncVectorEnv([new_env]),
    )
    for vector in vectors:
        agent = new_agent()
        assert agent.train(vector, steps=200, seed=4).rows == rows
        assert states_equal(agent, expected)
        assert agent.description() == expected.description()
        vector.close()


@pytest.mark.parametrize("name", AGENTS)
def test_a_training_in_a_vector_equals_a_loop_by_hand(name):
    # The agent acts in all environments, all step, and all transitions are learned in order.
    new_env, new_agent = AGENTS[name]
    n = 3
    by_hand, trained = new_agent(), new_agent()
    result = trained.train(sync_vector(n, new_env), steps=200, seed=4)
    by_hand.n_environments = n
    envs = [new_env() for _ in range(n)]
    # An observation is None before the reset of its environment.
    observations, lengths, returns = [None] * n, [0] * n, [0.0] * n
    rows, n_begun, n_learned = [], 0, 0
    while n_learned < 200:
        for i in range(n):
            if observations[i] is None:
                observations[i], _ = envs[i].reset(seed=episode_seed(4, 0, n_begun))
                n_begun, lengths[i], returns[i] = n_begun + 1, 0, 0.0
                by_hand.begin_episode(i)
        actions = [by_hand.act(observations[i], environment=i) for i in range(n)]
        steps = [envs[i].step(actions[i]) for i in range(n)]
        for i, (next_observation, reward, terminated, truncated, _) in enumerate(steps):
            if n_learned == 200:
                break
            transition = Transition(
                observations[i], actions[i], reward, next_observation, terminated
            )
            by_hand.learn(transition, environment=i)
            n_learned += 1
            lengths[i], returns[i] = lengths[i] + 1, returns[i] + reward
            observations[i] = next_observation
            if terminated or truncated:
                rows.append((n_learned, i, lengths[i], returns[i], terminated))
                observations[i] = None
            by_hand.progress = n_learned / 200
    assert states_equal(by_hand, trained)
    names = ("step", "environment", "length", "return", "terminated")
    assert [tuple(row[name] for name in names) for row in result.rows] == rows
    assert [row["episode"] for row in result.rows] == list(range(len(rows)))
    assert {row["environment"] for row in result.rows} == set(range(n))


def test_an_agent_learns_the_same_in_all_classes_and_modes_of_vectors():
    expected = sdnn_agent()
    expected_rows = expected.train(sync_vector(3), steps=151, seed=2).rows
    assert len(expected_rows) > 15, "episodes end during the training"
    for vector in vectors(3):
        agent = sdnn_agent()
        assert agent.train(vector, steps=151, seed=2).rows == expected_rows
        assert states_equal(agent, expected)
        vector.close()


@pytest.mark.parametrize("name", AGENTS)
def test_a_training_stopped_at_any_step_resumes_exactly(name, tmp_path):
    new_env, new_agent = AGENTS[name]
    modes = itertools.cycle(("NEXT_STEP", "SAME_STEP", "DISABLED"))

    def new_training(*callbacks):
        envs = sync_vector(3, new_env)
        return Training(new_agent(), envs, steps=150, seed=9, callbacks=callbacks)

    def envs_of_next_mode():
        return sync_vector(3, new_env, next(modes))

    # Random steps are before and after each environment, in episodes of any length.
    stop_steps = np.random.default_rng(5).permutation(np.arange(1, 150))[:40]
    finished = check_exact_resume(new_training, envs_of_next_mode, tmp_path / "t", stop_steps)
    assert finished.agent.n_environments == 3


def test_a_training_resumed_many_times_in_processes_has_the_same_bits(tmp_path):
    expected = sdnn_agent()
    expected_rows = expected.train(sync_vector(4), steps=120, seed=1).rows
    path = tmp_path / "training"
    training = Training(sdnn_agent(), sync_vector(4), steps=120, seed=1, callbacks=[Stop(7, path)])
    rows = training.run().rows
    for stop_step in (8, 30, 31, 33, 77, None):
        vector = AsyncVectorEnv([Walk] * 4)
        training = Training.load(path, vector, callbacks=[Stop(stop_step, path)])
        rows += training.run().rows
        vector.close()
    assert rows == expected_rows
    assert states_equal(training.agent, expected)


def test_batched_acrobots_have_the_bits_of_single_ones_and_resume_exactly(tmp_path):
    def new_agent():
        return sdnn_agent(gym.make("sdnn/AcrobotSwingUp-v0"))

    def acrobots(mode=None):  # None: the environment's own batched class
        return gym.make_vec("sdnn/AcrobotSwingUp-v0", num_envs=3, vectorization_mode=mode)

    def new_training(*callbacks):
        return Training(new_agent(), acrobots(), steps=400, callbacks=callbacks)

    in_batch = check_exact_resume(new_training, acrobots, tmp_path / "t", (100, 302, 355)).agent
    in_single_ones = new_agent()
    in_single_ones.train(acrobots("sync"), steps=400)
    assert states_equal(in_batch, in_single_ones)


def test_steps_callbacks_and_evaluations_of_vectors_count_transitions(tmp_path):
    progress_after = {}

    class NoteProgress(Callback):
        def on_step(self, training):
            progress_after[training.n_steps] = training.agent.progress

    path = tmp_path / "rows.jsonl"
    callbacks = [JSONLines(path), CheckpointCallback(tmp_path / "c", 7), NoteProgress()]
    result = sdnn_agent().train(sync_vector(4), steps=50, callbacks=callbacks)
    assert result.n_steps == 50
    assert progress_after == {step: step / 50 for step in range(1, 51)}
    assert len(path.read_text().splitlines()) == result.n_episodes
    assert sdnn_agent().train(sync_vector(4), episodes=9).n_episodes == 9
    rows = (
        sdnn_agent().train(sync_vector(2), steps=60, evaluate_every=25, evaluation_env=Walk()).rows
    )
    assert [row["step"] for row in rows if row["kind"] == "evaluation"] == [25, 50]


def test_dict_observations_and_discrete_actions_are_learned_in_vectors():
    class DiscreteWalk(Walk):
        action_space = gym.spaces.Discrete(3, start=1)

        def __init__(self):
            super().__init__()
            lamp = gym.spaces.Discrete(2)
            self.observation_space = gym.spaces.Dict(at=self.observation_space, lamp=lamp)

        def step(self, action):
            return super().step([float(action) - 2.0])  # -1, 0 or 1

        def _observation(self):
            return {"at": super()._observation(), "lamp": int(self._at > 0)}

    in_single, in_vector = sdnn_agent(DiscreteWalk()), sdnn_agent(DiscreteWalk())
    in_single.train(DiscreteWalk(), steps=100)
    in_vector.train(sync_vector(1, DiscreteWalk), steps=100)
    assert states_equal(in_single, in_vector)
    for vector_class in (SyncVectorEnv, AsyncVectorEnv):
        vector = vector_class([DiscreteWalk] * 3)
        assert sdnn_agent(DiscreteWalk()).train(vector, steps=100).n_steps == 100
        vector.close()


def test_a_warm_up_may_continue_in_fewer_environments():
    agent = sdnn_agent(Unbounded(), warm_up_steps=60)
    agent.train(sync_vector(5, Unbounded), steps=40)
    agent.n_environments = 2
    assert agent.is_warming_up
    agent.train(sync_vector(2, Unbounded), steps=30)
    assert not agent.is_warming_up
    assert agent.n_environments == 2


def test_a_fuzzy_warm_up_ends_after_the_last_pending_action():
    agent = fuzzy_agent(Unbounded(), warm_up_steps=3 * 3 + 1)
    agent.n_environments = 3
    x = np.zeros(2)
    for _ in range(3):
        actions = [agent.act(x, environment=i) for i in range(3)]
        for i, action in enumerate(actions):
            agent.learn(Transition(x, action, 0.0, x + i, False), i)
    actions = [agent.act(x, environment=i) for i in range(3)]
    agent.learn(Transition(x, actions[0], 0.0, x, False), 0)
    assert agent.is_warming_up, "all steps are learned, but two actions are pending"
    agent.begin_episode(1)  # abandons the action in this environment
    agent.learn(Transition(x, actions[2], 0.0, x, False), 2)
    assert not agent.is_warming_up


class ResetsItself(gym.vector.VectorEnv):
    """A vector environment of `Walk` that takes a single seed and resets its environments."""

    def __init__(self, n, mode):
        self._envs = sync_vector(n, mode=mode, copy=False)
        self.num_envs, self.metadata = n, {"autoreset_mode": AutoresetMode[mode]}
        for name in ("action_space", "observation_space"):
            setattr(self, name, getattr(self._envs, name))
            setattr(self, f"single_{name}", getattr(self._envs, f"single_{name}"))

    def reset(self, *, seed=None, options=None):
        assert options is None
        return self._envs.reset(seed=int(seed))

    def step(self, actions):
        return self._envs.step(actions)


class Recorder:
    """An agent with separate random actions in each environment, which notes what it learns."""

    action_space = Walk.action_space
    progress = 0.0
    n_environments = 1

    def __init__(self, n):
        self.generators = [np.random.default_rng(i) for i in range(n)]
        self.learned = [[] for _ in range(n)]

    def begin_episode(self, environment=0):
        self.learned[environment].append("begin")

    def act(self, observation, explore=True, environment=0):
        return self.generators[environment].uniform(-1, 1, 1).astype(np.float32)

    def learn(self, transition, environment=0):
        observation, action, reward, next_observation, terminated = transition[:5]
        values = (*observation, *action, reward, *next_observation, terminated)
        self.learned[environment].append(tuple(float(x) for x in values))


def test_steps_of_automatic_resets_are_not_learned():
    n = 3
    recorders = []
    for mode in ("NEXT_STEP", "SAME_STEP"):
        recorder = Recorder(n)
        result = Training(recorder, ResetsItself(n, mode), steps=300, seed=6).run()
        assert result.n_steps == 300
        assert len(result.rows) == result.n_episodes > 30
        recorders.append(recorder)
    for i in range(n):  # a vector adds the number of an environment to its seed
        expected, generator, env = ["begin"], np.random.default_rng(i), Walk()
        observation, _ = env.reset(seed=episode_seed(6, 0, 0) + i)
        for _ in range(80):
            action = generator.uniform(-1, 1, 1).astype(np.float32)
            next_observation, reward, terminated, truncated, _ = env.step(action)
            values = (*observation, *action, reward, *next_observation, terminated)
            expected.append(tuple(float(x) for x in values))
            observation = next_observation
            if terminated or truncated:
                observation, _ = env.reset()
                expected.append("begin")
        for recorder in recorders:
            assert recorder.learned[i][:80] == expected[:80]


def test_gymnasiums_batched_cartpole_is_learned_without_the_steps_of_its_automatic_resets():
    envs = gym.make_vec("CartPole-v1", num_envs=3)  # no SyncVectorEnv
    agent = SDNNQLearning(envs, approximator=SMALL, warm_up_steps=100)
    result = agent.train(envs, steps=500, seed=1)
    assert not agent.is_warming_up
    assert all(row["return"] == row["length"] for row in result.rows), "a reset has reward 0"


@pytest.mark.parametrize(
    "new_vector",
    [lambda: ResetsItself(2, "NEXT_STEP"), lambda: AsyncVectorEnv([Walk] * 2, shared_memory=False)],
    ids=["resets itself", "without shared memory"],
)
def test_vectors_that_cannot_repeat_episodes_resume_with_new_ones_only(new_vector, tmp_path):
    # Neither can be reset one by one: one takes a single seed, the other's next step resets again.
    vector = new_vector()
    checkpoints = CheckpointCallback(tmp_path / "t", 1000)
    training = Training(sdnn_agent(), vector, steps=20, callbacks=[checkpoints])
    training.run()
    refuses("env", Training.load, tmp_path / "t", vector)
    resumed = Training.load(tmp_path / "t", vector, steps=50, repeat_episodes=False)
    assert states_equal(resumed.agent, training.agent)
    assert resumed.run().n_steps == 50
    refuses("env", Training.load, tmp_path / "t", sync_vector(2), error=UnrepeatedEpisodeError)
    # A training in a vector that can repeat its episodes.
    Training(sdnn_agent(), sync_vector(2), steps=20, callbacks=[checkpoints]).run()
    refuses("repeat_episodes", Training.load, tmp_path / "t", vector)
    vector.close()


def test_resuming_refuses_another_number_of_environments_or_other_observations(tmp_path):
    Training(sdnn_agent(), sync_vector(3), steps=50, callbacks=[Stop(20, tmp_path / "t")]).run()
    not_reproducible = sync_vector(3, lambda: Walk(is_reproducible=False))
    for env in (sync_vector(2), Walk(), not_reproducible):
        refuses("env", Training.load, tmp_path / "t", env)
    Training(sdnn_agent(), Walk(), steps=50, callbacks=[Stop(20, tmp_path / "t")]).run()
    refuses("env", Training.load, tmp_path / "t", sync_vector(3))
    assert Training.load(tmp_path / "t", sync_vector(1)).run().n_steps == 50


def test_without_repeating_a_training_resumes_in_any_number_of_environments(tmp_path):
    Training(sdnn_agent(), sync_vector(3), steps=50, callbacks=[Stop(20, tmp_path / "t")]).run()
    for env in (*map(sync_vector, (3, 2, 5)), Walk(), ResetsItself(2, "NEXT_STEP")):
        training = Training.load(tmp_path / "t", env, repeat_episodes=False)
        assert training.n_steps == 20
        assert training.run().n_steps == 50
        assert training.agent.n_environments == training.n_environments


def test_a_callback_with_step_interval_7_is_called_at_multiples_of_7():
    steps = []

    class NoteSteps(Callback):
        step_interval = 7

        def on_step(self, training):
            steps.append(training.n_steps)

    without_callback, with_callback = sdnn_agent(), sdnn_agent()
    without_callback.train(sync_vector(3), steps=50, seed=1)
    with_callback.train(sync_vector(3), steps=50, seed=1, callbacks=[NoteSteps()])
    assert steps == [7, 14, 21, 28, 35, 42, 49]
    assert states_equal(without_callback, with_callback)


def test_a_training_calls_the_learn_method_of_a_subclass():
    class DoublesRewards(RBFQLearning):
        def learn(self, transition, environment=0):
            super().learn(transition._replace(reward=2 * transition.reward), environment)

    class WalkWithDoubleRewards(Walk):
        def step(self, action):
            observation, reward, *others = super().step(action)
            return observation, 2 * reward, *others

    agent, expected = DoublesRewards(Walk(), seed=1), RBFQLearning(Walk(), seed=1)
    agent.train(sync_vector(2), steps=60, seed=1)
    expected.train(sync_vector(2, WalkWithDoubleRewards), steps=60, seed=1)
    assert states_equal(agent, expected)


def test_learn_each_learns_up_to_the_first_bad_transition():
    agent, by_hand = sdnn_agent(), sdnn_agent()
    agent.n_environments = by_hand.n_environments = 3
    observations = np.zeros((3, 2))
    core, _, new_actions, _ = agent.core_parts()
    actions = new_actions([None] * 3)  # which the core fills
    core.act_each(observations, [0, 1, 2], actions)
    for i in range(3):
        assert by_hand.act(observations[i], environment=i) == actions[i]
    by_hand.learn(Transition(observations[0], actions[0], -1.0, observations[0] + 1, False), 0)
    rewards, no_end = [-1.0, np.nan, -1.0], [False] * 3

    def learn(environments, n_next=3):
        steps = (observations, actions, rewards, observations[:n_next] + 1, no_end, no_end)
        return core.learn_each(*steps, environments, most=3, n_steps=0, goal=None)

    assert learn([0, 1, 2]) == 1
    assert states_equal(agent, by_hand)
    refuses("reward", learn, [1, 2])
    refuses("environments", learn, [3])
    refuses("next_observations", learn, [2], 2)
    assert states_equal(agent, by_hand)


def test_learn_each_ends_with_an_episode_and_sets_the_progress_before():
    agent = sdnn_agent()
    agent.n_environments = 4
    observations = np.zeros((4, 2))
    core, _, new_actions, _ = agent.core_parts()
    actions = new_actions([None] * 4)  # which the core fills
    core.act_each(observations, [0, 1, 2, 3], actions)
    terminated, truncated, environments = [False] * 4, [False, False, True, False], [0, 1, 2, 3]
    steps = (observations, actions, [0.0] * 4, observations + 1, terminated, truncated)
    # The third transition ends an episode: only the two before it, after 10, set the progress.
    assert core.learn_each(*steps, environments, most=4, n_steps=10, goal=40) == 3
    assert core.progress == (10 + 2) / 40
    assert core.learn_each(*steps, environments, most=1, n_steps=13, goal=40) == 1
    assert core.progress == (13 + 1) / 40
