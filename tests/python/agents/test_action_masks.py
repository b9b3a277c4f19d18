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
    """Random states, in each of which a random half of the actions is allowed, by an assertion."""

    def __init__(self, actions="discrete", unbounded=False):
        bound = np.inf if unbounded else 1.0
        self.observation_space = gym.spaces.Box(-bound, bound, (2,), np.float64)
        self.action_space = SPACES[actions]

    def n_actions_of_dimensions(self):
        if isinstance(self.action_space, gym.spaces.Discrete):
            return [int(self.action_space.n)]
        return self.action_space.nvec.tolist()

    def mask(self):
        masks = tuple(mask.copy() for mask in self.allowed)
        return masks if len(masks) > 1 else masks[0]

    def draw_state_and_mask(self):
        self.state = self.np_random.uniform(-1, 1, 2)
        self.allowed = [
            self.np_random.integers(0, 2, n).astype(np.int8) for n in self.n_actions_of_dimensions()
        ]
        for mask in self.allowed:
            mask[self.np_random.integers(len(mask))] = 1
        return self.state.copy()

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.n_steps = 0
        return self.draw_state_and_mask(), {}

    def step(self, action):
        indices = np.ravel(action) - np.ravel(getattr(self.action_space, "start", 0))
        for index, mask in zip(indices, self.allowed, strict=True):
            assert mask[index] == 1, (indices, self.allowed)
        self.n_steps += 1
        reward = float(self.state[0] * indices[0])
        terminated, truncated = bool(self.np_random.random() < 0.1), self.n_steps == 11
        return self.draw_state_and_mask(), reward, terminated, truncated, {}


def new_env(actions="discrete", unbounded=False):
    return ActionMasks(Masked(actions, unbounded), Masked.mask)


def new_agent(agent_class, env, **settings):
    approximator = SMALL if agent_class is SDNNQLearning else LinearSDNNConfig(averaging_interval=0)
    return agent_class(env, approximator=approximator, seed=3, warm_up_steps=60, **settings)


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
def test_masked_vectors_learn_alike_in_all_modes_and_one_environment_as_a_single_one(actions, mode):
    def trained(n_environments, mode):
        envs = gym.vector.SyncVectorEnv(
            [lambda: new_env(actions)] * n_environments,
            autoreset_mode=gym.vector.AutoresetMode[mode],
        )
        agent = new_agent(SDNNQLambda, envs)
        agent.train(envs, steps=200)
        return agent

    assert states_equal(trained(3, mode), trained(3, "NEXT_STEP"))
    single = new_agent(SDNNQLambda, new_env(actions))
    single.train(new_env(actions), steps=200)
    assert states_equal(trained(1, mode), single)


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP"])
def test_masked_vectors_that_reset_themselves_take_allowed_actions(mode, monkeypatch):
    # Without this, the training would reset each environment of a SyncVectorEnv itself.
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
        assert masked.act(x, explore=False, mask=[1] * 5) == agent.act(x, explore=False)
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

    def value_and_next_values_after_learning(mask):
        copy = type(agent).rebuild(agent.description(), agent.state())
        for _ in range(30):
            copy.learn(Transition(x, 0, 0.0, next_x, False, mask))
            copy.begin_episode()
        return copy.q_values(x)[1], copy.q_values(next_x)

    # SDNN-C with few units has coarse values.
    tolerance = 1.2 if agent_class is SDNNQLearning else 0.05
    # With a reward of 0, the target is the discount 0.5 times the best allowed next value.
    value, next_values = value_and_next_values_after_learning(None)
    assert value == pytest.approx(0.5 * next_values.max(), abs=tolerance)
    value, next_values = value_and_next_values_after_learning([0, 0, 1, 0, 0])
    assert value == pytest.approx(0.5 * next_values[2], abs=tolerance)


@pytest.mark.parametrize("unbounded", [False, True], ids=["bounds", "warm-up"])
@pytest.mark.parametrize("actions", SPACES)
@pytest.mark.parametrize("agent_class", AGENTS)
@pytest.mark.parametrize(("stop_step", "n_envs"), [(33, 1), (100, 1), (20, 3)])
def test_a_training_with_masks_resumes_exactly(
    agent_class, actions, unbounded, stop_step, n_envs, tmp_path
):
    # Masks of several earlier steps, or of the next one, are part of the state. A warm-up has 60
    # steps: the stops after 33 and, in three environments, 20 are within it, and 100 is after it.
    settings = {"n_steps": 3} if agent_class is SDNNQLearning else {"bootstrap": "sarsa"}
    learning = agent_class.learning_type(**settings)

    def masked_env():
        if n_envs == 1:
            return new_env(actions, unbounded)
        return gym.vector.SyncVectorEnv([lambda: new_env(actions, unbounded)] * n_envs)

    def new_training(*callbacks):
        env = masked_env()
        agent = new_agent(agent_class, env, learning=learning)
        return Training(agent, env, steps=150, callbacks=callbacks)

    check_exact_resume(new_training, masked_env, tmp_path / "training", [stop_step])


def test_masks_in_a_log_file_are_learned_like_those_of_transitions(tmp_path):
    ranges = {"observation_range": (-1.0, 1.0), "inputs": "all", "angle_pairs": "none"}
    agents = [new_agent(SDNNQLambda, Masked(), **ranges) for _ in range(2)]
    transition = Transition([0.1, 0.2], 1, 1.0, [0.3, 0.4], False, [1, 0, 0, 1, 0])
    learn_from(agents[0], [transition] * 3)
    path = tmp_path / "log.jsonl"
    path.write_text((json.dumps(transition._asdict()) + "\n") * 3)
    learn_from(agents[1], path)
    assert states_equal(*agents)


BAD_MASKS = {
    "discrete": [
        [1, 0], [1] * 6, [0] * 5, [2, 1, 0, 0, 0], [0.5] * 5, "ones", (), [], ([1, 0], [1, 0, 1]),
    ],
    "several": [([1, 0, 0, 0], [0, 0, 1]), [[1, 0, 0]], ([1, 0, 0], 1), [1] * 6],
}  # fmt: skip
"""Five actions need five flags, two dimensions three and four, some of which are set."""


@pytest.mark.parametrize("actions", SPACES)
def test_invalid_masks_are_refused_and_change_nothing(actions):
    agent, untouched = (new_agent(SDNNQLambda, Masked(actions)) for _ in range(2))
    action = untouched.act([0.0, 0.0], explore=False)
    for mask in BAD_MASKS[actions]:
        with pytest.raises(ValueError, match=r"^mask "):
            agent.act([0.0, 0.0], mask=mask)
        with pytest.raises(ValueError, match=r"^next_mask "):
            agent.learn(Transition([0.0, 0.0], action, 0.0, [0.5, 0.5], False, mask))
    assert agent.act([0.0, 0.0], explore=False).tolist() == action.tolist()
    assert states_equal(agent, untouched)


def test_a_mask_of_two_dimensions_may_be_two_lists_or_a_flat_array():
    agent = new_agent(SDNNQLambda, Masked("several"))
    parts = [0, 1, 0], [0, 0, 0, 1]
    flat = [*parts[0], *parts[1]]
    for mask in (parts, list(parts), flat, np.array(flat, float)):
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
    """Returns no mask in the fourth step of an episode."""

    def step(self, action):
        *results, info = self.env.step(action)
        return (*results, {} if self.unwrapped.n_steps == 4 else info)


@pytest.mark.filterwarnings("ignore:agent is still warming up")
def test_missing_or_misshapen_masks_of_environments_are_unusable_steps():
    env = ActionMasks(gym.make("CartPole-v1"))  # CartPole has no masks
    agent = SDNNQLambda(env)
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
