"""Sparse rewards: until the first one the agent searches with repeated random actions."""

import itertools

import gymnasium as gym
import numpy as np
import pytest
import sdnn_q_lambda as transcription

from sdnn.agents import QLambdaConfig, SDNNQLambda, Transition, evaluate, learn_from
from stopped_training import states_equal

SQUARE = gym.spaces.Box(0.0, 1.0, (2,), np.float64)
NO_WARM_UP = {"inputs": "all", "angle_pairs": "none", "observation_range": (0.0, 1.0)}
OBSERVATION = [0.5, 0.5]


def new_agent(**learning):
    actions = gym.spaces.Discrete(4)
    return SDNNQLambda(SQUARE, actions, learning=QLambdaConfig(**learning), seed=1, **NO_WARM_UP)


def act_and_learn(agent, rewards):
    """Act in one state; return the actions."""
    actions = []
    for reward in rewards:
        actions.append(int(agent.act(OBSERVATION)))
        agent.learn(Transition(OBSERVATION, actions[-1], reward, OBSERVATION, False))
    return actions


def longest_run(actions):
    """Return the length of the longest sequence of equal actions."""
    return max(len(list(run)) for _, run in itertools.groupby(actions))


def test_random_actions_are_repeated_while_all_rewards_were_zero():
    # Among 1,000 actions drawn of four, a run of 15 has a probability of 1000 / 4^14. A search
    # takes each drawn action for 1 to m / 2 steps, where max_action_repeat is m, by default 100.
    no_rewards = [0.0] * 1000
    assert longest_run(act_and_learn(new_agent(), no_rewards)) >= 40
    # At most ten steps for each drawn action: 40 are at least four equal draws in a row.
    assert longest_run(act_and_learn(new_agent(max_action_repeat=20), no_rewards)) < 4 * 10
    for learning in ({"max_action_repeat": 1}, {"epsilon": 0.0}):
        assert longest_run(act_and_learn(new_agent(**learning), no_rewards)) < 15


def test_random_actions_are_not_repeated_in_discrete_spaces():
    # With discrete states only, repeating an action leads in no direction.
    agent = SDNNQLambda(gym.spaces.Discrete(5), gym.spaces.Discrete(4), seed=1)
    actions = []
    for _ in range(500):
        actions.append(int(agent.act(2)))
        agent.learn(Transition(2, actions[-1], 0.0, 2, False))
    # A run of 15 equal draws among 500 has a probability of at most 500 / 4^14 = 2e-6.
    assert longest_run(actions) < 15


@pytest.mark.parametrize("has_warm_up", [False, True])
def test_transitions_of_a_log_do_not_count_as_steps_of_a_search(has_warm_up):
    # 20 steps find no reward, then a log has one: the search lasts for twice as many more steps.
    agent = new_agent()
    if has_warm_up:
        agent = SDNNQLambda(SQUARE, gym.spaces.Discrete(4), warm_up_steps=300, seed=1)
    act_and_learn(agent, [0.0] * 20)
    log = [Transition(OBSERVATION, 1, 0.0, OBSERVATION, False)] * 400
    learn_from(agent, [*log, Transition(OBSERVATION, 1, 1.0, OBSERVATION, True)])
    assert int(agent.state()["agent.n_random_left"]) == 2 * 20


def test_ends_of_episodes_are_counted_only_after_the_search():
    # Each end that is counted halves the longest repetition of random actions.
    agent = new_agent()
    act_and_learn(agent, [0.0] * 10)
    # The first reward ends the search, and this episode is not counted.
    agent.learn(Transition(OBSERVATION, 0, 1.0, OBSERVATION, True))
    assert "agent.n_ended" not in agent.state()
    act_and_learn(agent, [1.0] * 20)
    agent.learn(Transition(OBSERVATION, 0, 1.0, OBSERVATION, True))
    assert int(agent.state()["agent.n_ended"]) == 1


@pytest.mark.parametrize("n_steps", [30, 80])  # before and after the first reward, at step 61
def test_a_search_resumes_exactly(n_steps, tmp_path):
    rewards = [0.0] * 60 + [1.0] + [0.0] * 200
    agent, saved = new_agent(), new_agent()
    act_and_learn(agent, rewards)
    act_and_learn(saved, rewards[:n_steps])
    saved.save(tmp_path / "agent.safetensors")
    resumed = SDNNQLambda.load(tmp_path / "agent.safetensors")
    act_and_learn(resumed, rewards[n_steps:])
    assert states_equal(agent, resumed)


def test_the_numpy_transcription_searches_with_the_same_actions_and_weights():
    # Sizes that the agent's preset has with two inputs.
    settings = transcription.Settings(seed=1, n_anchor_patterns=9, n_interpolated=44)
    slow = transcription.new_agent(2, [4], settings)
    agent = new_agent()
    rng = np.random.default_rng(1)
    state = rng.random(2)
    for step in range(160):
        action, next_state = slow.act(state), rng.random(2)
        assert int(agent.act(state)) == action[0]
        # An episode ends before the first reward, one with a reward, and one after the search.
        reward, terminated = float(step in (40, 70)), step in (20, 70, 150)
        slow.learn(state, action, reward, next_state, terminated)
        agent.learn(Transition(state, action[0], reward, next_state, terminated))
        state = rng.random(2) if terminated else next_state
        if terminated:
            slow.begin_episode()
            agent.begin_episode()
    np.testing.assert_array_equal(agent.readout.weights(), slow.weights)


class RewardAtGoal(gym.Wrapper):
    """A reward of 1 where an episode terminates, else 0."""

    def step(self, action):
        observation, _, terminated, truncated, info = self.env.step(action)
        return observation, float(terminated), terminated, truncated, info


def test_mountain_car_is_learned_with_a_reward_at_the_goal_only():
    env = RewardAtGoal(gym.make("MountainCar-v0"))
    agent = SDNNQLambda(env, seed=1003)
    # Actions drawn anew in each step hardly ever reach the goal: a car must swing to it.
    agent.train(env, steps=40_000, seed=1003)
    assert evaluate(agent, env, episodes=10, seed=7).mean_return > 0.8
