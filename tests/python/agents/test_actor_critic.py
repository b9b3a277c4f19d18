"""The actor-critic: its NumPy transcription, learning, and refusals."""

import gymnasium as gym
import numpy as np
import pytest
import sdnn_actor_critic as transcription
from hypothesis import given, settings, strategies as st

from q_lambda_transcription import SMALL, VariableDiscount, random_durations, random_transitions
from refusals import refuses
from sdnn import _core
from sdnn.agents import ActorCriticConfig, SDNNActorCritic, SDNNQLambda, Transition, evaluate
from sdnn.approximators import LinearSDNNConfig
from sdnn.export import c_header

FIXED_RANGE = {"observation_range": (-1.0, 1.0)}


class Code(transcription.CodeWithThermometers):
    """The binary features of a state that a compiled network returns."""

    def __init__(self, readout):
        self.readout, self.n_columns = readout, len(readout.code([0.5, 0.5]))

    def __call__(self, state):
        return np.array(self.readout.code(state), np.int64)


class ActorCritic(transcription.ActorCritic):
    """The agent of `docs/examples/sdnn_actor_critic.py`, with transitions of any duration."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.discount = VariableDiscount(self.settings)
        self.update_actor = self.discount.in_traces(self.update_actor)
        self.critic.update_trace = self.discount.in_traces(self.critic.update_trace)

    def learn(self, state, action, reward, next_state, terminated, dt=1.0):
        self.discount.set(dt)
        super().learn(state, action, reward, next_state, terminated)
        self.discount.end()


@given(
    seed=st.integers(0, 10**6),
    n_actions=st.lists(st.integers(1, 4), min_size=1, max_size=2),
    trace_decay=st.sampled_from([0.0, 0.8, 1.0]),
    discount=st.sampled_from([0.0, 0.9, 1.0]),
    rate=st.sampled_from([1e-6, 0.3, 1.0]),
    entropy=st.sampled_from([0.0, 0.01, 1.0]),
    scale=st.sampled_from([1.0, 100.0, 1e6, 1e-40]),
    durations_are_1=st.booleans(),
)
@settings(max_examples=40, deadline=None)
def test_actions_and_weights_are_those_of_the_numpy_transcription(
    seed, n_actions, trace_decay, discount, rate, entropy, scale, durations_are_1
):
    learning = {
        "learning_rate": rate,
        "actor_learning_rate": rate,
        "final_actor_learning_rate": rate,
        "entropy": entropy,
        "schedule_steps": 7,
        "trace_decay": trace_decay,
        "discount": discount,
    }
    agent = _core.BareAgent(
        approximator=LinearSDNNConfig(**SMALL),
        n_actions=n_actions,
        learning=ActorCriticConfig(**learning),
        seed=seed,
    )
    (critic,) = agent.networks
    slow = ActorCritic(Code(critic), n_actions, transcription.Settings(**learning, seed=seed))
    durations = random_durations(seed, durations_are_1)
    for state, action, reward, next_state, end in random_transitions(seed, 25, n_actions, scale):
        dt = next(durations)
        np.testing.assert_array_equal(agent.act(state), slow.act(state))
        for learner in (agent, slow):
            learner.learn(state, action, reward, next_state, end == "terminal", dt)
            if end == "limit":
                learner.begin_episode()
        assert critic.exponent == slow.critic.exponent
        np.testing.assert_array_equal(critic.weights(), slow.critic.weights)


def test_an_agent_of_a_bounded_space_acts_without_a_warm_up():
    env = gym.make("sdnn.environments:sdnn/AcrobotSwingUp-v0")
    agent = SDNNActorCritic(env, seed=1)
    assert not agent.is_warming_up
    assert agent.act(env.reset(seed=1)[0]) in env.action_space


def test_cartpole_is_balanced_for_300_steps_after_20_000_steps():
    env = gym.make("CartPole-v1")
    agent = SDNNActorCritic(env, seed=1)
    agent.train(env, steps=20_000, seed=1)
    # Episodes have at most 500 steps, and about 20 with random actions.
    assert evaluate(agent, gym.make("CartPole-v1"), episodes=10, seed=7).mean_return > 300


def test_in_a_bandit_the_best_arm_becomes_probable_and_the_value_its_mean_reward():
    space, arms = gym.spaces.Box(-1.0, 1.0, (2,), np.float64), gym.spaces.Discrete(3, start=1)
    agent = SDNNActorCritic(space, arms, seed=1, **FIXED_RANGE)
    zeros = np.zeros(2)
    np.testing.assert_allclose(agent.action_probabilities(zeros), 1 / 3)
    for _ in range(1500):
        action = agent.act(zeros)
        agent.learn(Transition(zeros, action, float(action == 2), zeros, True))
    probabilities = agent.action_probabilities(zeros)
    assert probabilities.sum() == pytest.approx(1)
    assert probabilities[1] > 0.9
    assert agent.value(zeros) == pytest.approx(probabilities[1], abs=0.1)
    assert agent.act(zeros, explore=False) == 2


def test_greedy_actions_of_a_box_are_the_mean_of_the_best_one_and_its_neighbours():
    box = gym.spaces.Box(np.array([-1.0, 0.0]), np.array([1.0, 8.0]), dtype=np.float64)
    agent = SDNNActorCritic(gym.spaces.Box(-1, 1, (2,)), box, seed=2, **FIXED_RANGE)
    observation = np.array([0.2, -0.4], np.float32)
    for step in range(40):
        action = agent.act(observation)
        reward = -abs(action[0] - 0.3) - abs(action[1] - 7.0)
        agent.learn(Transition(observation, action, reward, observation, terminated=step % 2 == 0))
    expected = []
    for dimension, actions in enumerate((np.linspace(-1.0, 1.0, 5), np.linspace(0.0, 8.0, 5))):
        p = agent.action_probabilities(observation, dimension)
        near = slice(max(p.argmax() - 1, 0), p.argmax() + 2)  # the best action and its neighbours
        expected.append(p[near] @ actions[near] / p[near].sum())
        assert not np.isclose(expected[-1], actions).any(), "a mean between two actions"
    action = agent.act(observation, explore=False)
    np.testing.assert_allclose(action, expected, atol=1e-4)
    # An action between two of the agent's can be learned.
    agent.learn(Transition(observation, action, 0.0, observation, terminated=True))


def test_q_values_and_epsilon_are_refused_with_their_alternatives():
    agent = SDNNActorCritic(gym.spaces.Box(-1.0, 1.0, (2,)), gym.spaces.Discrete(2), seed=1)
    assert not hasattr(agent, "q_values")
    with pytest.raises(AttributeError, match="action_probabilities"):
        agent.q_values(np.zeros(2))
    with pytest.raises(ValueError, match="entropy"):
        agent.epsilon = 0.1
    agent.epsilon = None
    assert agent.epsilon == 0


def test_a_warm_up_selects_relevant_inputs_but_does_not_change_probabilities():
    space = gym.spaces.Box(-np.inf, np.inf, (3,), np.float64)
    agent = SDNNActorCritic(
        space, gym.spaces.Discrete(2), seed=1, inputs="relevant", warm_up_steps=300
    )
    rng, observation = np.random.default_rng(1), np.zeros(3)
    while agent.is_warming_up:  # actions move and rewards pay the first variable; others are noise
        action = agent.act(observation)
        next_observation = np.array([0.9 * observation[0] + action - 0.5, *rng.normal(size=2)])
        agent.learn(Transition(observation, action, next_observation[0], next_observation, False))
        observation = next_observation
    assert ("variable", [0]) in agent.inputs
    np.testing.assert_allclose(agent.action_probabilities(observation), 0.5)


def test_running_ranges_that_include_first_observations_of_episodes_let_an_agent_tell_them_apart():
    # Episodes have one step and end in zeros, so that only first observations have a range.
    space = gym.spaces.Box(-np.inf, np.inf, (1,), np.float64)
    agent = SDNNActorCritic(space, gym.spaces.Discrete(2), seed=1)
    rng, rewards = np.random.default_rng(1), []
    for _ in range(2000):
        observation = rng.normal(100.0, 10.0, 1)
        agent.begin_episode()
        action = agent.act(observation)
        rewards.append(1.0 if action == (observation[0] > 100.0) else -1.0)
        agent.learn(Transition(observation, action, rewards[-1], np.zeros(1), True))
    assert np.mean(rewards[-300:]) > 0.7  # 0 by chance


def test_traces_survive_alternating_environments_with_missing_values():
    space = gym.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    agent = SDNNActorCritic(space, gym.spaces.Discrete(2), seed=1, missing="code")
    agent.n_environments = 2
    rng, observations = np.random.default_rng(1), np.full((2, 2), np.nan)
    for environment in [0, 1] * 20:
        observation, next_observation = observations[environment], np.array([rng.normal(), np.nan])
        action = agent.act(observation, environment=environment)
        transition = Transition(observation, action, 1.0, next_observation, False)
        agent.learn(transition, environment=environment)
        observations[environment] = next_observation
    # If another environment's step ended them, traces would be those of one step: 0 and one size.
    traces = agent.state()["agent.trace.values"]
    assert len(np.unique(np.abs(traces))) > 3, "traces of several steps differ in size"


def test_export_with_learning_refuses_running_ranges():
    agent = SDNNQLambda(
        gym.spaces.Box(-1.0, 1.0, (2,)), gym.spaces.Discrete(2), seed=1, inputs="all",
        angle_pairs="none", observation_range="running",
    )  # fmt: skip
    refuses("agent", c_header, agent, "robot", learning=True)


def test_a_space_with_a_constant_variable_is_accepted():
    space = gym.spaces.Box(np.array([0.0, 1.0]), np.array([1.0, 1.0]), dtype=np.float64)
    agent = SDNNActorCritic(space, gym.spaces.Discrete(2), seed=1)
    agent.act(np.array([0.5, 1.0]))
