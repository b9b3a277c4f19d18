"""An agent in several environments: order of learning, and exact resume."""

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
GENERAL = QLearningConfig(
    n_steps=3, epsilon=0.3, final_epsilon=0.01, n_greedy_steps=2, max_action_repeat=6,
    start_steps=9, value_range="adaptive",
)  # fmt: skip


class Walk(gym.Env):
    """A walk on a line with gusts: episodes of 1 to 15 steps, ended by its end or a time limit."""

    action_space = gym.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)

    def __init__(self, is_bounded=True, drifts=False):
        bound = 2.0 if is_bounded else np.inf
        self.observation_space = gym.spaces.Box(-bound, bound, (2,), dtype=np.float64)
        self._drifts = drifts

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
        shift = np.random.default_rng().uniform() if self._drifts else 0.0
        return np.array([self._at, self._steps / 16 + shift])


class Unbounded(Walk):
    def __init__(self):
        super().__init__(is_bounded=False)


def sdnn_agent(env=None, **options):
    env = env or Walk()
    settings = {"approximator": SMALL, "learning": GENERAL, "seed": 3, **options}
    return SDNNQLearning(env.observation_space, env.action_space, **settings)


def rbf_agent():
    sizes = RBFNetworkConfig(n_actions=7)
    return RBFQLearning(Walk().observation_space, Walk.action_space, approximator=sizes)


def fuzzy_agent(env=None, **options):
    env = env or Walk()
    learning = FuzzyQLearningConfig(trace_decay=0.7, n_greedy_steps=0, epsilon=0.3)
    sizes = FuzzyRulesConfig(n_sets=4)
    return FuzzyQLearning(
        env.observation_space, env.action_space, learning=learning, approximator=sizes, **options
    )


KINDS = {
    "sdnn": (Walk, sdnn_agent),
    "sdnn, warm-up": (Unbounded, lambda: sdnn_agent(Unbounded(), warm_up_steps=60)),
    "rbf": (Walk, rbf_agent),
    "fuzzy": (Walk, fuzzy_agent),
    "fuzzy, warm-up": (Unbounded, lambda: fuzzy_agent(Unbounded(), warm_up_steps=60)),
}


def sync(n, env=Walk, mode="NEXT_STEP", **options):
    return SyncVectorEnv([env] * n, autoreset_mode=AutoresetMode[mode], **options)


def vectors(n):
    """Vector environments of all kinds, to be closed."""
    yield from (sync(n, mode=mode) for mode in ("NEXT_STEP", "SAME_STEP", "DISABLED"))
    yield sync(n, copy=False)
    yield AsyncVectorEnv([Walk] * n)
    yield AsyncVectorEnv([Walk] * n, autoreset_mode=AutoresetMode.SAME_STEP)
    yield AsyncVectorEnv([Walk] * n, shared_memory=False, autoreset_mode=AutoresetMode.DISABLED)


@pytest.mark.parametrize("name", KINDS)
def test_a_vector_of_one_environment_has_the_bits_of_a_single_environment(name):
    env, make = KINDS[name]
    plain = Training(make(), env(), steps=200, seed=4)
    rows = plain.run().rows
    for vector in (sync(1, env), sync(1, env, "SAME_STEP"), AsyncVectorEnv([env])):
        training = Training(make(), vector, steps=200, seed=4)
        assert training.run().rows == rows
        assert states_equal(training.agent, plain.agent)
        assert training.agent.description() == plain.agent.description()
        vector.close()


@pytest.mark.parametrize("name", KINDS)
def test_a_training_in_a_vector_equals_a_loop_by_hand(name):
    # All environments act, all step, and all transitions are learned in order.
    env_type, make = KINDS[name]
    n = 3
    by_hand, trained = make(), make()
    result = trained.train(sync(n, env_type), steps=200, seed=4)
    by_hand.n_environments = n
    envs = [env_type() for _ in range(n)]
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


def test_all_types_of_vectors_give_the_same_bits():
    outcomes = []
    for vector in vectors(3):
        agent = sdnn_agent()
        outcomes.append((agent.train(vector, steps=151, seed=2).rows, agent))
        vector.close()
    (rows, agent), *others = outcomes
    assert len(rows) > 15
    for other_rows, other in others:
        assert other_rows == rows
        assert states_equal(other, agent)


@pytest.mark.parametrize("name", KINDS)
def test_a_training_stopped_at_any_step_resumes_exactly(name, tmp_path):
    env, make = KINDS[name]
    path = tmp_path / "training"
    whole = Training(make(), sync(3, env), steps=150, seed=9)
    rows = whole.run().rows
    for cut in np.random.default_rng(5).permutation(np.arange(1, 150))[:40]:
        # Cuts come before and after any of the three environments, in episodes of any length.
        first = Training(make(), sync(3, env), steps=150, seed=9, callbacks=[Stop(cut, path)])
        before = first.run()
        assert not before.is_finished
        second = Training.load(path, sync(3, env, ("NEXT_STEP", "SAME_STEP", "DISABLED")[cut % 3]))
        assert second.agent.n_environments == 3
        after = second.run()
        assert (*before.rows, *after.rows) == rows
        assert states_equal(whole.agent, second.agent)


def test_a_training_resumed_many_times_in_processes_has_the_same_bits(tmp_path):
    whole = Training(sdnn_agent(), sync(4), steps=120, seed=1)
    rows = whole.run().rows
    path = tmp_path / "training"
    training = Training(sdnn_agent(), sync(4), steps=120, seed=1, callbacks=[Stop(7, path)])
    rows_of_parts = list(training.run().rows)
    for cut in (8, 30, 31, 33, 77, 1000):
        vector = AsyncVectorEnv([Walk] * 4)
        training = Training.load(path, vector, callbacks=[Stop(cut, path)])
        rows_of_parts += training.run().rows
        vector.close()
    assert tuple(rows_of_parts) == rows
    assert states_equal(whole.agent, training.agent)


def test_batched_acrobots_have_the_bits_of_single_ones_and_resume_exactly(tmp_path):
    def agent():
        env = gym.make("sdnn/AcrobotSwingUp-v0")
        return sdnn_agent(env, approximator=SMALL)

    def acrobots(mode=None):
        return gym.make_vec("sdnn/AcrobotSwingUp-v0", num_envs=3, vectorization_mode=mode)

    def new_training(*callbacks):
        return Training(agent(), acrobots(), steps=400, callbacks=callbacks)

    whole = check_exact_resume(new_training, acrobots, tmp_path / "t", (100, 302, 355))
    of_singles = Training(agent(), acrobots("sync"), steps=400)
    of_singles.run()
    assert states_equal(whole.agent, of_singles.agent)


def test_steps_callbacks_and_evaluations_count_transitions(tmp_path):
    progress_after = {}

    class Note(Callback):
        def on_step(self, training):
            progress_after[training.n_steps] = training.agent.progress

    path = tmp_path / "rows.jsonl"
    callbacks = [JSONLines(path), CheckpointCallback(tmp_path / "c", 7), Note()]
    result = sdnn_agent().train(sync(4), steps=50, callbacks=callbacks)
    assert result.n_steps == 50
    assert progress_after == {step: step / 50 for step in range(1, 51)}
    assert len(path.read_text().splitlines()) == result.n_episodes
    assert sdnn_agent().train(sync(4), episodes=9).n_episodes == 9
    rows = sdnn_agent().train(sync(2), steps=60, evaluate_every=25, evaluation_env=Walk()).rows
    assert [row["step"] for row in rows if row["kind"] == "evaluation"] == [25, 50]


def test_dict_observations_and_discrete_actions_are_learned_in_vectors():
    class Buttons(Walk):
        action_space = gym.spaces.Discrete(3, start=1)

        def __init__(self):
            super().__init__()
            parts = {"at": self.observation_space, "lamp": gym.spaces.Discrete(2)}
            self.observation_space = gym.spaces.Dict(parts)

        def step(self, action):
            return super().step([float(action) - 2.0])

        def _observation(self):
            return {"at": super()._observation(), "lamp": int(self._at > 0)}

    plain, in_vector = sdnn_agent(Buttons()), sdnn_agent(Buttons())
    plain.train(Buttons(), steps=100)
    in_vector.train(sync(1, Buttons), steps=100)
    assert states_equal(plain, in_vector)
    for make in (sync, lambda n, env: AsyncVectorEnv([env] * n)):
        vector = make(3, Buttons)
        assert sdnn_agent(Buttons()).train(vector, steps=100).n_steps == 100
        vector.close()


def test_a_warm_up_may_continue_in_fewer_environments():
    agent = sdnn_agent(Unbounded(), warm_up_steps=60)
    agent.train(sync(5, Unbounded), steps=40)
    agent.n_environments = 2
    assert agent.is_warming_up
    agent.train(sync(2, Unbounded), steps=30)
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
    agent.begin_episode(1)
    agent.learn(Transition(x, actions[2], 0.0, x, False), 2)
    assert not agent.is_warming_up


class Opaque(gym.vector.VectorEnv):
    """A vector environment that takes one seed, and resets itself."""

    def __init__(self, n, mode):
        self._envs = sync(n, mode=mode, copy=False)
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
    """A learner that acts by a plan of its own in each environment, and notes what it learns."""

    action_space = Walk.action_space
    progress = 0.0
    n_environments = 1

    def __init__(self, n):
        self.plans = [np.random.default_rng(i) for i in range(n)]
        self.learned = [[] for _ in range(n)]

    def begin_episode(self, environment=0):
        self.learned[environment].append("begin")

    def act(self, observation, explore=True, environment=0):
        return self.plans[environment].uniform(-1, 1, 1).astype(np.float32)

    def learn(self, transition, environment=0):
        observation, action, reward, next_observation, terminated = transition[:5]
        values = (*observation, *action, reward, *next_observation, terminated)
        self.learned[environment].append(tuple(float(x) for x in values))


def test_steps_of_automatic_resets_are_not_learned():
    n = 3
    by_mode = {}
    for mode in ("NEXT_STEP", "SAME_STEP"):
        learner = by_mode[mode] = Recorder(n)
        result = Training(learner, Opaque(n, mode), steps=300, seed=6).run()
        assert result.n_steps == 300
        assert len(result.rows) == result.n_episodes > 30
    for i in range(n):
        expected, plan, env = [], np.random.default_rng(i), Walk()
        observation, _ = env.reset(seed=episode_seed(6, 0, 0) + i)
        expected.append("begin")
        for _ in range(80):
            action = plan.uniform(-1, 1, 1).astype(np.float32)
            next_observation, reward, terminated, truncated, _ = env.step(action)
            values = (*observation, *action, reward, *next_observation, terminated)
            expected.append(tuple(float(x) for x in values))
            observation = next_observation
            if terminated or truncated:
                observation, _ = env.reset()
                expected.append("begin")
        for learner in by_mode.values():
            assert learner.learned[i][:80] == expected[:80]


def test_gymnasiums_batched_cartpole_is_learned_without_its_resets():
    envs = gym.make_vec("CartPole-v1", num_envs=3)  # no SyncVectorEnv
    agent = SDNNQLearning(
        envs.single_observation_space, envs.single_action_space, approximator=SMALL,
        warm_up_steps=100,
    )  # fmt: skip
    result = agent.train(envs, steps=500, seed=1)
    assert not agent.is_warming_up
    assert all(row["return"] == row["length"] for row in result.rows), "a reset has reward 0"


@pytest.mark.parametrize(
    "make",
    [lambda: Opaque(2, "NEXT_STEP"), lambda: AsyncVectorEnv([Walk] * 2, shared_memory=False)],
)
def test_vectors_that_cannot_repeat_episodes_resume_with_new_ones_only(make, tmp_path):
    vector = make()
    checkpoints = CheckpointCallback(tmp_path / "t", 1000)
    training = Training(sdnn_agent(), vector, steps=20, callbacks=[checkpoints])
    training.run()
    refuses("env", Training.load, tmp_path / "t", vector)
    again = Training.load(tmp_path / "t", vector, steps=50, repeat_episodes=False)
    assert states_equal(again.agent, training.agent)
    assert again.run().n_steps == 50
    refuses("env", Training.load, tmp_path / "t", sync(2), error=UnrepeatedEpisodeError)
    Training(sdnn_agent(), sync(2), steps=20, callbacks=[checkpoints]).run()
    refuses("repeat_episodes", Training.load, tmp_path / "t", vector)
    vector.close()


def test_resuming_refuses_a_vector_of_another_size_or_other_observations(tmp_path):
    Training(sdnn_agent(), sync(3), steps=50, callbacks=[Stop(20, tmp_path / "t")]).run()
    for other in (sync(2), Walk()):
        refuses("env", Training.load, tmp_path / "t", other)
    refuses("env", Training.load, tmp_path / "t", sync(3, lambda: Walk(drifts=True)))
    Training(sdnn_agent(), Walk(), steps=50, callbacks=[Stop(20, tmp_path / "t")]).run()
    refuses("env", Training.load, tmp_path / "t", sync(3))
    assert Training.load(tmp_path / "t", sync(1)).run().n_steps == 50


def test_without_repeating_a_training_resumes_in_any_number_of_environments(tmp_path):
    Training(sdnn_agent(), sync(3), steps=50, callbacks=[Stop(20, tmp_path / "t")]).run()
    for other in (sync(3), sync(2), sync(5), Walk(), Opaque(2, "NEXT_STEP")):
        training = Training.load(tmp_path / "t", other, repeat_episodes=False)
        assert training.n_steps == 20
        assert training.run().n_steps == 50
        assert training.agent.n_environments == training.n_environments


def test_a_callback_with_step_interval_7_is_called_at_multiples_of_7():
    class Rare(Callback):
        step_interval = 7

        def __init__(self):
            self.steps = []

        def on_step(self, training):
            self.steps.append(training.n_steps)

    rare, plain, watched = Rare(), sdnn_agent(), sdnn_agent()
    plain.train(sync(3), steps=50, seed=1)
    watched.train(sync(3), steps=50, seed=1, callbacks=[rare])
    assert rare.steps == [7, 14, 21, 28, 35, 42, 49]
    assert states_equal(plain, watched)


def test_a_training_calls_the_learn_method_of_a_subclass():
    class Doubled(RBFQLearning):
        def learn(self, transition, environment=0):
            super().learn(transition._replace(reward=2 * transition.reward), environment)

    class DoubleWalk(Walk):
        def step(self, action):
            observation, reward, *others = super().step(action)
            return observation, 2 * reward, *others

    sizes = RBFNetworkConfig(n_actions=7)
    agents = [
        name(Walk().observation_space, Walk.action_space, approximator=sizes, seed=1)
        for name in (Doubled, RBFQLearning)
    ]
    for agent, env in zip(agents, (Walk, DoubleWalk), strict=True):
        agent.train(sync(2, env), steps=60, seed=1)
    assert states_equal(*agents)


def test_learn_each_learns_up_to_the_first_bad_transition():
    agent, by_hand = sdnn_agent(), sdnn_agent()
    agent.n_environments = by_hand.n_environments = 3
    observations = np.zeros((3, 2))
    core, _, batch, _ = agent.core_parts()
    actions = batch([None] * 3)
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
    core, _, batch, _ = agent.core_parts()
    actions = batch([None] * 4)
    core.act_each(observations, [0, 1, 2, 3], actions)
    terminated, truncated, environments = [False] * 4, [False, False, True, False], [0, 1, 2, 3]
    steps = (observations, actions, [0.0] * 4, observations + 1, terminated, truncated)
    # The third transition ends an episode: only the two before it, after 10, set the progress.
    assert core.learn_each(*steps, environments, most=4, n_steps=10, goal=40) == 3
    assert core.progress == (10 + 2) / 40
    assert core.learn_each(*steps, environments, most=1, n_steps=13, goal=40) == 1
    assert core.progress == (13 + 1) / 40
