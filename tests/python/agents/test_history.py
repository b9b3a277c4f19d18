"""States that include earlier observations."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import SDNNActorCritic, SDNNQLambda, Transition, evaluate, load_agent
from sdnn.export import c_header

RANDOM_STEPS = 1100
"""More than the steps of a warm-up."""


def exact():
    return gym.make("CartPole-v1")


def positions():
    env, places = exact(), [0, 2]
    space = env.observation_space
    return gym.wrappers.TransformObservation(
        env, lambda x: x[places], gym.spaces.Box(space.low[places], space.high[places])
    )


def noisy():
    env, random = exact(), np.random.default_rng(1)
    deviation = np.array([0.24, 0.3, 0.02, 0.35])
    return gym.wrappers.TransformObservation(
        env, lambda x: x + deviation * random.standard_normal(4), env.observation_space
    )


@pytest.mark.filterwarnings("ignore:.*is not within the observation space")
@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
@pytest.mark.parametrize(
    ("task", "history"), [(exact, "none"), (positions, "differences"), (noisy, "observer")]
)
def test_history_auto_selects_what_a_task_needs(agent_class, task, history):
    agent = agent_class(task(), seed=1, history="auto")
    assert agent.history == "auto"
    agent.train(task(), steps=RANDOM_STEPS, seed=1)
    assert agent.history == history
    n_inputs = len(agent.inputs) * (2 if history == "differences" else 1)
    assert agent.approximator.n_inputs == n_inputs


@pytest.mark.parametrize("history", ["differences", "averages", "observer"])
def test_a_loaded_agent_with_a_history_acts_and_learns_as_the_saved_one(history, tmp_path):
    agent = SDNNQLambda(positions(), seed=1, history=history)
    agent.train(positions(), steps=RANDOM_STEPS, seed=1)
    agent.save(tmp_path / "agent.safetensors")
    same = load_agent(tmp_path / "agent.safetensors")
    assert same.history == history
    env = positions()
    observation, _ = env.reset(seed=2)
    for learner in (agent, same):
        learner.begin_episode()
    for _ in range(20):
        action = agent.act(observation)
        assert same.act(observation) == action
        next_observation, reward, terminated, _, _ = env.step(action)
        for learner in (agent, same):
            learner.learn(Transition(observation, action, reward, next_observation, terminated))
        observation = next_observation
        if terminated:
            break
    assert all(np.array_equal(a, same.state()[name]) for name, a in agent.state().items())


def test_evaluations_do_not_change_the_history_of_the_current_episode():
    agents = [SDNNQLambda(positions(), seed=1, history="differences") for _ in range(2)]
    for agent in agents:
        agent.train(positions(), steps=RANDOM_STEPS, seed=1)
        agent.begin_episode()
        agent.act(positions().reset(seed=3)[0])
    evaluate(agents[0], positions(), episodes=2, seed=1)
    observation = positions().reset(seed=4)[0]
    assert agents[0].act(observation) == agents[1].act(observation)


def test_environments_of_a_vector_have_separate_histories():
    envs = gym.vector.SyncVectorEnv([positions] * 3)
    agent = SDNNQLambda(positions(), seed=1, history="differences")
    agent.train(envs, steps=3000, seed=1)
    assert agent.history == "differences"
    assert {name.split(".")[1] for name in agent.state() if name.startswith("last_states.")} >= {
        "0", "1", "2",
    }  # fmt: skip


def test_export_refuses_agents_with_a_history():
    agent = SDNNQLambda(positions(), seed=1, history="differences")
    agent.train(positions(), steps=RANDOM_STEPS, seed=1)
    with pytest.raises(ValueError, match="history='none'"):
        c_header(agent, "pole")


def test_missing_codes_and_a_history_exclude_each_other():
    with pytest.raises(ValueError, match="history"):
        SDNNQLambda(exact(), history="auto", missing="code")
