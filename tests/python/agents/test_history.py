"""States that include earlier observations, as "differences", "averages" or an "observer".

With "auto", the end of a warm-up selects what the task needs, or "none".
"""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
    evaluate,
    imitate,
    load_agent,
)
from sdnn.agents.imitation import _value
from stopped_training import states_equal

STEPS_BEYOND_WARM_UP = 1100  # a warm-up has 1,000


def cartpole():
    return gym.make("CartPole-v1")


def cartpole_positions():
    """CartPole without velocities: differences of observations replace them."""
    env, indices = cartpole(), [0, 2]
    space = env.observation_space
    return gym.wrappers.TransformObservation(
        env, lambda x: x[indices], gym.spaces.Box(space.low[indices], space.high[indices])
    )


def noisy(env, deviations):
    random = np.random.default_rng(1)
    return gym.wrappers.TransformObservation(
        env, lambda x: x + random.normal(0.0, deviations), env.observation_space
    )


def noisy_cartpole():
    return noisy(cartpole(), [0.24, 0.3, 0.02, 0.35])


@pytest.mark.filterwarnings("ignore:.*is not within the observation space")
@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
@pytest.mark.parametrize(
    ("task", "history"),
    [(cartpole, "none"), (cartpole_positions, "differences"), (noisy_cartpole, "observer")],
)
def test_history_auto_selects_what_a_task_needs(agent_class, task, history):
    agent = agent_class(task(), seed=1, angle_pairs="find")
    assert agent.history == "auto"
    agent.train(task(), steps=STEPS_BEYOND_WARM_UP, seed=1)
    assert agent.history == history
    inputs_of_each = 2 if history == "differences" else 1  # a difference is an input, too
    assert agent.approximator.n_inputs == len(agent.inputs) * inputs_of_each


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
@pytest.mark.parametrize("task", ["Acrobot-v1", "Pendulum-v1", "MountainCar-v0"])
def test_auto_finds_no_history_where_observations_show_the_state(agent_class, task):
    agent = agent_class(gym.make(task), seed=1004, angle_pairs="find")
    agent.train(gym.make(task), steps=STEPS_BEYOND_WARM_UP, seed=1004)
    assert agent.history == "none"


@pytest.mark.parametrize("seed", [1028, 1037])
def test_auto_finds_no_history_in_the_task_of_the_paper(seed):
    # The fitted model lacks products of three variables: its errors are no noise or velocities.
    agent = SDNNQLambda(gym.make("sdnn/PaperAcrobot-v0"), seed=seed)
    agent.train(gym.make("sdnn/PaperAcrobot-v0"), steps=STEPS_BEYOND_WARM_UP, seed=seed)
    assert agent.history == "none"


@pytest.mark.filterwarnings("ignore:.*is not within the observation space")
def test_an_actor_critic_that_knows_angles_finds_an_observer_for_a_noisy_pendulum():
    def noisy_pendulum():
        return noisy(gym.make("Pendulum-v1"), [0.1, 0.1, 0.8])

    agent = SDNNActorCritic(noisy_pendulum(), seed=1, angle_pairs="find")
    agent.train(noisy_pendulum(), steps=STEPS_BEYOND_WARM_UP, seed=1)
    assert (agent.history, len(agent.inputs)) == ("observer", 2)  # the angle and its velocity


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
def test_without_unknown_ranges_and_inputs_history_auto_begins_no_warm_up(agent_class):
    ranges = ([-5, -5, -1, -5], [5, 5, 1, 5])
    agent = agent_class(cartpole(), inputs="all", angle_pairs=[], observation_range=ranges)
    assert (agent.is_warming_up, agent.history, agent.finds_history) == (False, "none", False)
    assert not any(name.startswith("history") for name in agent.state())
    assert agent_class(cartpole(), inputs="all", angle_pairs=[], history="observer").is_warming_up


def test_only_general_presets_without_codes_of_missing_values_find_a_history_by_default():
    def finds_history(agent_class, **settings):
        return agent_class(gym.make("Pendulum-v1"), **settings).finds_history

    # A history of "auto" is found at the end of a warm-up. SDNN-C has none unless it is passed.
    assert finds_history(SDNNQLambda)
    assert not finds_history(SDNNQLambda, preset="paper", observation_range="adaptive")
    assert not finds_history(SDNNQLambda, missing="code")
    assert finds_history(SDNNActorCritic, angle_pairs="find")  # which needs a warm-up
    assert not finds_history(SDNNQLearning, observation_range="adaptive")


@pytest.mark.parametrize("settings", [{}, {"inputs": "all"}], ids=["relevant", "all inputs"])
def test_an_agent_that_finds_no_history_learns_the_bits_of_one_without(settings):
    def cartpole_with_noise_as_6_more_inputs():
        env, random = cartpole(), np.random.default_rng(1)
        high = np.concatenate([env.observation_space.high, np.ones(6, np.float32)])
        return gym.wrappers.TransformObservation(
            env,
            lambda x: np.concatenate([x, random.uniform(-1.0, 1.0, 6).astype(np.float32)]),
            gym.spaces.Box(-high, high),
        )

    states = {}
    for history in ("auto", "none"):
        env = cartpole_with_noise_as_6_more_inputs()
        agent = SDNNQLambda(env, seed=1, history=history, **settings)
        agent.train(env, steps=2500, seed=1)  # relevant inputs are searched for repeatedly
        assert agent.history == "none"
        states[history] = agent.state()
    states["auto"].pop("history.kind")
    assert states["auto"].keys() == states["none"].keys()
    for name, array in states["auto"].items():
        np.testing.assert_array_equal(array, states["none"][name])


@pytest.mark.parametrize("history", ["differences", "averages", "observer"])
def test_a_loaded_agent_with_a_history_acts_and_learns_as_the_saved_one(history, tmp_path):
    agent = SDNNQLambda(cartpole_positions(), seed=1, history=history)
    agent.train(cartpole_positions(), steps=STEPS_BEYOND_WARM_UP, seed=1)
    agent.save(tmp_path / "agent.safetensors")
    loaded = load_agent(tmp_path / "agent.safetensors")
    assert loaded.history == history
    for resumed in (agent, loaded):
        resumed.train(cartpole_positions(), steps=20, seed=2)
    assert states_equal(agent, loaded)


def test_evaluations_do_not_change_the_history_of_the_current_episode():
    agents = [SDNNQLambda(cartpole_positions(), seed=1, history="differences") for _ in range(2)]
    for agent in agents:
        agent.train(cartpole_positions(), steps=STEPS_BEYOND_WARM_UP, seed=1)
        agent.begin_episode()
        agent.act(cartpole_positions().reset(seed=3)[0])
    evaluate(agents[0], cartpole_positions(), episodes=2, seed=1)
    observation = cartpole_positions().reset(seed=4)[0]
    assert agents[0].act(observation) == agents[1].act(observation)


def test_environments_of_a_vector_have_separate_histories():
    envs = gym.vector.SyncVectorEnv([cartpole_positions] * 3)
    agent = SDNNQLambda(cartpole_positions(), seed=1, history="differences")
    agent.train(envs, steps=3000, seed=1)
    assert agent.history == "differences"
    prefixes = {name.rpartition(".")[0] for name in agent.state()}
    assert prefixes >= {f"last_states.{environment}" for environment in range(3)}


def test_the_value_after_a_truncated_episode_of_a_log_does_not_depend_on_earlier_episodes():
    agent = SDNNQLambda(cartpole_positions(), seed=1, history="differences")
    agent.train(cartpole_positions(), steps=STEPS_BEYOND_WARM_UP, seed=1)
    first, second = ([Transition([x, 0.0], 0, 1.0, [x + 0.1, 0.0], False)] for x in (-2.0, 1.0))
    agent.begin_episode()
    value = _value(agent, second)  # of the observation after the episode
    agent.begin_episode()
    agent._follow_teacher(*first)
    assert _value(agent, second) == value


def test_histories_that_cannot_be_fitted_are_refused_or_warned_of():
    with pytest.raises(ValueError, match=r"history must be .* fewer than 100 warm_up_steps"):
        SDNNQLambda(cartpole(), history="observer", warm_up_steps=50)
    box, actions = gym.spaces.Box(-1.0, 1.0, (17,)), gym.spaces.Discrete(2)
    with pytest.raises(ValueError, match=r"history must be .* more than 16 numeric inputs"):
        SDNNQLambda(box, actions, history="observer", inputs="all", angle_pairs=[])
    with pytest.raises(ValueError, match=r"history must be .* discrete"):
        SDNNQLambda(gym.spaces.Discrete(5), actions, history="differences")
    with pytest.raises(ValueError, match="history"):
        SDNNQLambda(cartpole(), history="auto", missing="code")
    agent = SDNNQLambda(cartpole_positions(), history="observer")
    log = [Transition([0.0, 0.1 * i], i % 2, 1.0, [0.0, 0.1], False) for i in range(20)]
    with pytest.warns(UserWarning, match="fewer than 100 transitions"):
        imitate(agent, log)
    assert agent.history == "none"


def test_a_training_prints_the_history_unless_its_option_is_none(invoke, tmp_path):
    def printed_lines(*option):
        folder = tmp_path / "_".join(option)
        options = ("--agent", "q-lambda", "--steps", 1200, "--seed", 1, "--out", folder, *option)
        return invoke("train", "CartPole-v1", *options).output.splitlines()

    assert not any(line.startswith("history") for line in printed_lines("--history", "none"))
    line = "history of observations in states: none, as the warm-up found"
    assert line in printed_lines("--history", "auto")
    assert line in printed_lines("--seed", "1"), "auto is the default"
    averages = printed_lines("--history", "averages")
    assert "history of observations in states: averages" in averages


def test_an_agent_with_differences_of_a_single_relevant_input_is_saved(tmp_path):
    rng = np.random.default_rng(1)
    box = gym.spaces.Box(-1.0, 1.0, (4,), np.float64)
    agent = SDNNQLambda(
        box, gym.spaces.Discrete(2), seed=1, history="differences", warm_up_steps=400
    )
    observation = rng.uniform(-1.0, 1.0, 4)
    for _ in range(420):
        action = int(agent.act(observation))
        next_observation = rng.uniform(-1.0, 1.0, 4)  # noise, except for the first variable
        next_observation[0] = np.clip(observation[0] + 0.2 * (2 * action - 1), -1.0, 1.0)
        agent.learn(Transition(observation, action, next_observation[0], next_observation, False))
        observation = next_observation
    assert agent.inputs[0][1] == [0], "the first variable is the most relevant one"
    agent.save(tmp_path / "agent")
    loaded = SDNNQLambda.load(tmp_path / "agent")
    np.testing.assert_array_equal(loaded.q_values(observation), agent.q_values(observation))
