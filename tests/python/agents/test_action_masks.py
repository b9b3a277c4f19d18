"""Action masks: masked actions are neither taken nor bootstrapped from."""

import json

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    FuzzyQLearning,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    Transition,
    UnusableStepError,
    evaluate,
    learn_from,
)
from sdnn.approximators import LinearSDNNConfig, SDNNCConfig
from sdnn.environments import ActionMasks
from stopped_training import check_exact_resume, states_equal

SMALL = SDNNCConfig(n_hidden_units=60, n_active_units=20, n_pattern_units=20)
AGENTS = [SDNNQLambda, SDNNQLearning]
SPACES = {"discrete": gym.spaces.Discrete(5, start=-1), "several": gym.spaces.MultiDiscrete([3, 4])}


class Masked(gym.Env):
    """A walk in which a random half of the actions is allowed; others fail an assertion."""

    def __init__(self, actions="discrete", unbounded=False):
        bound = np.inf if unbounded else 1.0
        self.observation_space = gym.spaces.Box(-bound, bound, (2,), np.float64)
        self.action_space = SPACES[actions]

    def numbers_of_actions(self):
        if isinstance(self.action_space, gym.spaces.Discrete):
            return [int(self.action_space.n)]
        return self.action_space.nvec.tolist()

    def mask(self):
        masks = tuple(mask.copy() for mask in self.allowed)
        return masks if len(masks) > 1 else masks[0]

    def begin_state(self):
        self.state = self.np_random.uniform(-1, 1, 2)
        self.allowed = [
            self.np_random.integers(0, 2, n).astype(np.int8) for n in self.numbers_of_actions()
        ]
        for mask in self.allowed:
            mask[self.np_random.integers(len(mask))] = 1
        return self.state.copy()

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.n = 0
        return self.begin_state(), {}

    def step(self, action):
        indices = np.ravel(action) - np.ravel(getattr(self.action_space, "start", 0))
        for index, mask in zip(indices, self.allowed, strict=True):
            assert mask[index] == 1, (indices, self.allowed)
        self.n += 1
        reward = float(self.state[0] * indices[0])
        terminated, truncated = self.n % 7 == 6, self.n == 11
        return self.begin_state(), reward, terminated, truncated, {}


def new_env(actions="discrete", unbounded=False):
    return ActionMasks(Masked(actions, unbounded), Masked.mask)


def new_agent(agent_class, env, **settings):
    approximator = SMALL if agent_class is SDNNQLearning else LinearSDNNConfig(averaging_interval=0)
    spaces = (
        getattr(env, "single_observation_space", env.observation_space),
        getattr(env, "single_action_space", env.action_space),
    )
    return agent_class(*spaces, approximator=approximator, seed=3, warm_up_steps=60, **settings)


@pytest.mark.parametrize("unbounded", [False, True], ids=["bounds", "warm-up"])
@pytest.mark.parametrize("actions", SPACES)
@pytest.mark.parametrize("agent_class", AGENTS)
def test_only_allowed_actions_are_taken(agent_class, actions, unbounded):
    env = new_env(actions, unbounded)
    agent = new_agent(agent_class, env)
    assert agent.train(env, steps=300).n_steps == 300
    assert evaluate(agent, new_env(actions, unbounded), 5).returns.shape == (5,)


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
@pytest.mark.parametrize("actions", SPACES)
def test_masked_vectors_of_every_autoreset_mode_learn_the_same(actions, mode):
    def trained(n, mode):
        envs = gym.vector.SyncVectorEnv(
            [lambda: new_env(actions)] * n, autoreset_mode=gym.vector.AutoresetMode[mode]
        )
        agent = new_agent(SDNNQLambda, envs)
        agent.train(envs, steps=200)
        return agent

    assert states_equal(trained(3, mode), trained(3, "NEXT_STEP"))
    single = new_agent(SDNNQLambda, new_env(actions))
    single.train(new_env(actions), steps=200)
    assert states_equal(trained(1, mode), single)


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP"])
def test_masked_vectors_without_separate_resets_take_allowed_actions(mode, monkeypatch):
    monkeypatch.setattr("sdnn.training.vectors._resets_each", lambda env: False)
    env = gym.vector.SyncVectorEnv([new_env] * 3, autoreset_mode=gym.vector.AutoresetMode[mode])
    agent = new_agent(SDNNQLambda, env)
    assert agent.train(env, steps=200).n_steps == 200


@pytest.mark.parametrize("agent_class", AGENTS)
def test_a_mask_that_allows_every_action_changes_nothing(agent_class):
    env = Masked()
    agent, masked = new_agent(agent_class, env), new_agent(agent_class, env)
    random = np.random.default_rng(1)
    for _ in range(100):
        x, next_x = random.uniform(-1, 1, (2, 2))
        action = agent.act(x)
        assert masked.act(x, mask=np.ones(5, bool)) == action
        assert masked.act(x, False, mask=[1] * 5) == agent.act(x, False)
        agent.learn(Transition(x, action, 1.0, next_x, False))
        masked.learn(Transition(x, action, 1.0, next_x, False, np.ones(5, np.int8)))
    for x in random.uniform(-1, 1, (10, 2)):
        np.testing.assert_array_equal(agent.q_values(x), masked.q_values(x))


@pytest.mark.parametrize("agent_class", AGENTS)
def test_targets_bootstrap_from_allowed_actions_only(agent_class):
    x, next_x = np.array([-0.9, -0.9]), np.array([0.9, 0.9])
    settings = {"value_range": "fixed"} if agent_class is SDNNQLearning else {"schedule_steps": 0}
    learning = agent_class.learning_type(
        discount=0.5, learning_rate=1.0, final_learning_rate=None, **settings
    )
    agent = new_agent(agent_class, Masked(), learning=learning)
    for _ in range(30):  # with a learning rate of 1, so that values become rewards
        for action, value in ((-1, 0.0), (0, 8.0), (1, 2.0), (2, 0.0), (3, 0.0)):
            agent.learn(Transition(next_x, action, value, next_x, True))
            agent.begin_episode()
    high, low = agent.q_values(next_x)[[1, 2]]  # actions 0 and 1; the first one is -1
    assert high > low > 0.5

    def learned(mask):
        masked = type(agent).rebuild(agent.description(), agent.state())
        for _ in range(30):
            masked.learn(Transition(x, 0, 0.0, next_x, False, mask))
            masked.begin_episode()
        return masked.q_values(x)[1], masked.q_values(next_x)

    # SDNN-C with few units has coarse values.
    tolerance = 1.2 if agent_class is SDNNQLearning else 0.05
    # With a reward of 0, the target is the discount 0.5 times the best allowed next value.
    value, next_values = learned(None)
    assert value == pytest.approx(0.5 * next_values.max(), abs=tolerance)
    value, next_values = learned([0, 0, 1, 0, 0])
    assert value == pytest.approx(0.5 * next_values[2], abs=tolerance)


@pytest.mark.parametrize("unbounded", [False, True], ids=["bounds", "warm-up"])
@pytest.mark.parametrize("actions", SPACES)
@pytest.mark.parametrize("agent_class", AGENTS)
@pytest.mark.parametrize(("stop", "n_envs"), [(33, None), (100, None), (20, 3)])
def test_a_training_with_masks_resumes_exactly(
    agent_class, actions, unbounded, stop, n_envs, tmp_path
):
    more = {"n_steps": 3} if agent_class is SDNNQLearning else {"bootstrap": "sarsa"}
    learning = agent_class.learning_type(**more)

    def masked_env():
        if n_envs is None:
            return new_env(actions, unbounded)
        return gym.vector.SyncVectorEnv([lambda: new_env(actions, unbounded)] * n_envs)

    def new_training(*callbacks):
        env = masked_env()
        agent = new_agent(agent_class, env, learning=learning)
        return Training(agent, env, steps=150, callbacks=callbacks)

    check_exact_resume(new_training, masked_env, tmp_path / "part", [stop])


def test_masks_in_a_log_file_are_learned(tmp_path):
    agents = [new_agent(SDNNQLambda, Masked()) for _ in range(2)]
    steps = [Transition([0.1, 0.2], 1, 1.0, [0.3, 0.4], False, [1, 0, 0, 1, 0])] * 3
    learn_from(agents[0], steps)
    with (tmp_path / "log.jsonl").open("w") as file:
        for step in steps:
            file.write(json.dumps(step._asdict()) + "\n")
    learn_from(agents[1], tmp_path / "log.jsonl")
    assert states_equal(*agents)


BAD_MASKS = {
    "discrete": [
        [1, 0], [1] * 6, [0] * 5, [2, 1, 0, 0, 0], [0.5] * 5, "ones", (), [], ([1, 0], [1, 0, 1]),
    ],
    "several": [([1, 0, 0, 0], [0, 0, 1]), [[1, 0, 0]], ([1, 0, 0], 1), [1] * 6],
}  # fmt: skip


@pytest.mark.parametrize("actions", SPACES)
def test_masks_of_wrong_size_or_type_are_refused(actions):
    agent, untouched = (new_agent(SDNNQLambda, Masked(actions)) for _ in range(2))
    action = untouched.act([0.0, 0.0], explore=False)
    for mask in BAD_MASKS[actions]:
        with pytest.raises(ValueError, match=r"^mask "):
            agent.act([0.0, 0.0], mask=mask)
        with pytest.raises(ValueError, match=r"^next_mask "):
            agent.learn(Transition([0.0, 0.0], action, 0.0, [0.5, 0.5], False, mask))
    assert agent.act([0.0, 0.0], explore=False).tolist() == action.tolist()
    assert states_equal(agent, untouched)


def test_a_mask_of_several_dimensions_may_be_parts_or_a_flat_array():
    agent = new_agent(SDNNQLambda, Masked("several"))
    parts = [0, 1, 0], [0, 0, 0, 1]
    for mask in (
        parts,
        list(parts),
        [*parts[0], *parts[1]],
        np.array([*parts[0], *parts[1]], float),
    ):
        np.testing.assert_array_equal(agent.act([0.0, 0.0], mask=mask), [1, 3])
        np.testing.assert_array_equal(agent.predict([0.0, 0.0], action_masks=mask)[0], [1, 3])
    masks = [parts, ([1, 0, 0], [1, 0, 0, 0])]
    actions, _ = agent.predict(np.zeros((2, 2)), action_masks=masks)
    np.testing.assert_array_equal(actions, [[1, 3], [0, 0]])
    with pytest.raises(ValueError, match=r"^action_masks "):
        agent.predict(np.zeros((2, 2)), action_masks=[parts])


def test_continuous_actions_refuse_masks():
    spaces = gym.spaces.Box(-1, 1, (2,)), gym.spaces.Box(-1, 1, (1,))
    for agent_class in (SDNNQLambda, FuzzyQLearning):
        agent = agent_class(*spaces)
        with pytest.raises(ValueError, match=r"^mask must be None"):
            agent.act(np.zeros(2), mask=[1, 0, 1])


def test_the_wrapper_action_masks_refuses_continuous_actions_and_uncallable_masks():
    with pytest.raises(ValueError, match=r"^env must have discrete actions"):
        ActionMasks(gym.make("Pendulum-v1"))
    with pytest.raises(TypeError, match=r"^mask must be a function"):
        ActionMasks(Masked(), 3)


class Forgetful(gym.Wrapper):
    """Loses the mask in some steps."""

    def __init__(self, env):
        super().__init__(env)
        self.n = 0

    def step(self, action):
        *results, info = self.env.step(action)
        self.n += 1
        return (*results, {} if self.n % 5 == 4 else info)


def test_missing_or_misshapen_masks_of_environments_are_unusable_steps():
    env = ActionMasks(gym.make("CartPole-v1"))  # has none
    agent = SDNNQLambda(env.observation_space, env.action_space)
    with pytest.raises(UnusableStepError, match="action_mask"):
        agent.train(env, steps=3)
    with pytest.raises(UnusableStepError, match="action_mask"):
        evaluate(agent, env)
    forgetful = Forgetful(new_env())
    for env in (forgetful, gym.vector.SyncVectorEnv([lambda: Forgetful(new_env())] * 2)):
        with pytest.raises(UnusableStepError, match="action_mask"):
            new_agent(SDNNQLambda, env).train(env, steps=40)
    too_long = ActionMasks(Masked(), lambda env: [1] * 6)  # of five actions
    for masked in (too_long, gym.vector.SyncVectorEnv([lambda: too_long])):
        with pytest.raises(UnusableStepError, match="action_mask"):
            new_agent(SDNNQLambda, masked).train(masked, steps=3)
