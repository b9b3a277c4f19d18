"""Q(lambda) with a linear readout: its NumPy transcription, learning, and inputs.

After 2,000 steps of an episode a fourth of the explorations are excursions: worst actions for some
steps, which are not learned.
"""

import copy

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from q_lambda_transcription import SMALL, Code, QLambda, random_durations, random_transitions
from sdnn import _core
from sdnn.agents import QLambdaConfig, RBFQLearning, SDNNQLambda, Transition, evaluate, load_agent
from sdnn.approximators import LinearSDNNConfig
from stopped_training import states_equal


@given(
    seed=st.integers(0, 10**6),
    n_actions=st.lists(st.integers(1, 4), min_size=1, max_size=2),
    window=st.integers(1, 3),
    bootstrap=st.sampled_from(["sarsa", "q_learning"]),
    traces=st.sampled_from(["dutch", "replacing"]),
    trace_decay=st.sampled_from([0.0, 0.8, 1.0]),
    discount=st.sampled_from([0.0, 0.9, 1.0]),
    learning_rate=st.sampled_from([1e-6, 0.3, 1.0]),
    scale=st.sampled_from([1.0, 100.0, 1e6, 1e-40]),
    durations_are_1=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_weights_are_those_of_the_numpy_transcription(
    seed, n_actions, window, bootstrap, traces, trace_decay, discount, learning_rate, scale,
    durations_are_1,
):  # fmt: skip
    learning = {
        "learning_rate": learning_rate,
        "final_learning_rate": 0.01,
        "schedule_steps": 7,
        "bootstrap": bootstrap,
        "traces": traces,
        "trace_decay": trace_decay,
        "discount": discount,
        "epsilon": 0.0,
        "final_epsilon": 0.0,
    }
    agent = _core.BareAgent(
        approximator=LinearSDNNConfig(**SMALL, action_window=window),
        n_actions=n_actions,
        learning=QLambdaConfig(**learning),
        seed=seed,
    )
    (readout,) = agent.networks
    transcription = QLambda(Code(readout.code, 2), n_actions, window, learning)
    durations = random_durations(seed, durations_are_1)
    for state, action, reward, next_state, end in random_transitions(seed, 25, n_actions, scale):
        dt = next(durations)
        # The agent keeps sums of weights for learning when it acts.
        x = transcription.code(state)
        best = [int(index) for index in agent.act(state)]
        assert transcription.value(x, best) == transcription.best_value(x)
        for learner in (agent, transcription):
            learner.learn(state, action, reward, next_state, end == "terminal", dt)
            if end == "limit":
                learner.begin_episode()
        assert readout.exponent == transcription.exponent
        np.testing.assert_array_equal(readout.weights(), transcription.weights)


def test_excursions_of_an_endless_episode_are_those_of_the_numpy_transcription():
    n_actions = [3, 2]
    learning = {"epsilon": 0.2, "schedule_steps": 1000, "max_action_repeat": 40}
    agent = _core.BareAgent(
        approximator=LinearSDNNConfig(**SMALL),
        n_actions=n_actions,
        learning=QLambdaConfig(**learning),
        seed=1,
    )
    options = {"bootstrap": "q_learning", "traces": "dutch", "seed": 1} | learning
    slow = QLambda(Code(agent.networks[0].code, 2), n_actions, 1, options)
    rng, n_excursions = np.random.default_rng(0), 0
    state = rng.random(2)
    for _ in range(3000):
        action = [int(index) for index in agent.act(state)]
        assert action == [int(index) for index in slow.act(state)]
        n_excursions += slow.is_excursion
        reward, next_state = rng.normal(), rng.random(2)
        for learner in (agent, slow):
            learner.learn(state, action, reward, next_state, False, 1.0)
        state = next_state
    assert 100 < n_excursions < 900  # steps of the last 1,000


def saved_excursions(agent):
    """Return the names of arrays about excursions: none unless an environment is in one."""
    return [name for name in agent.state() if name.endswith(("is_excursion", "skips_learning"))]


@pytest.mark.parametrize("when_saved", ["before learning", "after learning"])
def test_excursions_resume_exactly_and_take_allowed_actions(when_saved, tmp_path):
    def new_agent():
        space = gym.spaces.Box(-1.0, 1.0, (2,))
        learning = QLambdaConfig(epsilon=0.5)
        agent = SDNNQLambda(
            space, gym.spaces.MultiDiscrete([3, 2]), learning=learning, warm_up_steps=50, seed=1
        )
        agent.n_environments = 2
        return agent

    def run_with_saves(agent, saved_steps):
        n_in_excursions = 0
        for step in range(4400):
            rng, environment = np.random.default_rng(step), step % 2
            observation, next_observation = rng.uniform(-1, 1, (2, 2))
            # Two of 3 actions of the first dimension, and both of the second one.
            mask = np.append(rng.permutation([1, 1, 0]), [1, 1]).astype(np.int8)
            action = agent.act(observation, environment=environment, mask=mask)
            assert mask[action[0]]
            transition = Transition(observation, action, rng.normal(), next_observation, False)
            if when_saved == "after learning":
                agent.learn(transition, environment=environment)
            if step in saved_steps:
                n_in_excursions += len(saved_excursions(agent)) > 0
                agent.save(tmp_path / "agent.safetensors")
                agent = load_agent(tmp_path / "agent.safetensors")
            if when_saved == "before learning":
                agent.learn(transition, environment=environment)
        return agent, n_in_excursions

    # From step 4,000 on, both environments have excursions, as each has had 2,000 steps.
    resumed, n_in_excursions = run_with_saves(new_agent(), range(4200, 4400, 10))
    assert n_in_excursions > 3  # of 20 saves
    assert states_equal(run_with_saves(new_agent(), ())[0], resumed)


def agent_with_excursions():
    return SDNNQLambda(
        gym.spaces.Box(-1.0, 1.0, (2,)), gym.spaces.Discrete(2), seed=1,
        learning=QLambdaConfig(epsilon=0.5), warm_up_steps=50,
    )  # fmt: skip


def test_transitions_that_the_agent_did_not_act_in_are_learned_after_an_excursion():
    agent = agent_with_excursions()
    rng = np.random.default_rng(0)
    for _ in range(2100):  # beyond the 2,000 steps before the first excursion
        observation, next_observation = rng.uniform(-1, 1, (2, 2))
        action = agent.act(observation)
        agent.learn(Transition(observation, action, rng.normal(), next_observation, False))
    while not saved_excursions(agent):
        action = agent.act(observation)
    agent.learn(Transition(observation, action, 1.0, next_observation, False))
    for action in (0, 1):
        before = agent.readout.weights()
        agent.learn(Transition(observation, action, 5.0, next_observation, False))
        assert (agent.readout.weights() != before).any()


def test_steps_of_excursions_neither_change_weights_nor_count_as_learned(tmp_path):
    agent = agent_with_excursions()
    rng, n_steps, n_left_out = np.random.default_rng(0), 2500, 0
    for step in range(n_steps):
        observation, next_observation = rng.uniform(-1, 1, (2, 2))
        action = agent.act(observation)
        before = None if agent.is_warming_up else agent.readout.weights()
        agent.learn(Transition(observation, action, rng.normal(), next_observation, False))
        if step >= 2000 and np.array_equal(agent.readout.weights(), before):
            n_left_out += 1
    assert n_left_out > 50  # of the last 500 steps
    assert agent.n_learned == n_steps - n_left_out
    agent.save(tmp_path / "agent.safetensors")
    assert load_agent(tmp_path / "agent.safetensors").n_learned == agent.n_learned


def test_a_few_discrete_states_have_exact_independent_values(tmp_path):
    space = gym.spaces.Discrete(5, start=3)
    agent = SDNNQLambda(space, gym.spaces.Discrete(2), seed=1)
    for state, reward in ((3, 2.0), (7, -5.0)):
        agent.learn(Transition(state, 1, reward, 4, terminated=True))
    agent.save(tmp_path / "agent.safetensors")
    for saved in (agent, load_agent(tmp_path / "agent.safetensors")):
        values = np.array([saved.q_values(state) for state in range(3, 8)])
        np.testing.assert_allclose(values[:, 1], [2, 0, 0, 0, -5], rtol=1e-6)
        np.testing.assert_array_equal(values[:, 0], 0)


@pytest.mark.parametrize(("n_states", "n_units"), [(1, 0), (2000, 0), (5, 40)])
def test_a_single_or_many_states_or_a_set_number_of_units_are_coded_as_patterns(n_states, n_units):
    # From 2 to 1,536 states would have a table instead, with as many units as there are states.
    agent = SDNNQLambda(
        gym.spaces.Discrete(n_states), gym.spaces.Discrete(2), seed=1,
        approximator=LinearSDNNConfig(n_pattern_units=n_units),
    )  # fmt: skip
    assert agent.approximator.n_pattern_units == (n_units or 768)  # the default
    agent.learn(Transition(0, 1, 2.0, 0, terminated=True))
    assert agent.q_values(0)[1] == pytest.approx(2, rel=1e-3)


@pytest.mark.parametrize(
    ("n_inputs", "n_units"), [(1, 768), (2, 768), (3, 512), (4, 256), (8, 256), (11, 128), (17, 64)]
)
def test_the_default_number_of_pattern_units_decreases_with_the_inputs(n_inputs, n_units):
    space = gym.spaces.Box(-1.0, 1.0, (n_inputs,), np.float64)
    agent = SDNNQLambda(space, gym.spaces.Discrete(2), inputs="all", angle_pairs="none")
    assert agent.approximator.n_pattern_units == n_units


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_values_scale_exactly_with_rewards(scale):
    def values(scale):
        agent = _core.BareAgent(
            approximator=LinearSDNNConfig(**SMALL), n_actions=[3], learning=QLambdaConfig(), seed=1
        )
        for state, action, reward, next_state, end in random_transitions(
            3, 200, n_actions=[3], scale=2.0
        ):
            agent.learn(state, action, reward * scale, next_state, end == "terminal")
        return agent.networks[0].values([0.2, 0.6])

    factor = 2.0 ** round(np.log2(scale))  # exact in binary
    np.testing.assert_array_equal(values(factor), values(1.0) * factor)


def test_values_recover_from_an_outlier_reward():
    agent = _core.BareAgent(
        approximator=LinearSDNNConfig(n_inputs=2),
        n_actions=[2],
        learning=QLambdaConfig(final_learning_rate=1.0, trace_decay=0.0),
        seed=1,
    )
    agent.learn([0.1, 0.1], [0], -1e6, [0.2, 0.1], True)
    for _ in range(30):
        agent.learn([0.1, 0.1], [0], 1.0, [0.2, 0.1], True)
    # The resolution stays that of values of a million.
    assert agent.networks[0].values([0.1, 0.1])[0] == pytest.approx(1.0, abs=0.5)


def test_cartpole_is_balanced_for_300_steps_after_20_000_steps():
    env = gym.make("CartPole-v1")
    agent = SDNNQLambda(env, seed=1)
    agent.train(env, steps=20_000, seed=1)
    # Episodes have at most 500 steps, and about 20 with random actions.
    assert evaluate(agent, gym.make("CartPole-v1"), episodes=10, seed=7).mean_return > 300


@pytest.mark.parametrize(
    ("space", "is_searched"),
    [
        (gym.spaces.Box(-1, 1, (3,)), True),
        (gym.spaces.Box(-1, 1, (2,)), True),  # the two may be one angle
        (gym.spaces.Box(-1, 1, (1,)), False),
        (gym.spaces.MultiDiscrete([3, 4]), False),  # of two inputs both are kept
        (gym.spaces.MultiDiscrete([3, 4, 5]), True),
    ],
)
def test_a_warm_up_takes_place_only_where_inputs_can_be_chosen(space, is_searched):
    assert SDNNQLambda(space, gym.spaces.Discrete(2)).is_warming_up == is_searched
    assert not SDNNQLambda(space, gym.spaces.Discrete(2), preset="paper").is_warming_up


def test_the_angle_of_pendulum_is_found_by_default():
    env = gym.make("Pendulum-v1")
    agent = SDNNQLambda(env, seed=1)
    agent.train(env, steps=1001, seed=1)
    assert agent.inputs == [("angle", [0, 1]), ("variable", [2])]


N_WARM_UP = 400


def changing_task(seed, n_steps):
    """Yield transitions of a position that actions move and four variables of noise.

    After the steps of a warm-up, the last variable is rewarded, too.
    """
    rng = np.random.default_rng(seed)
    observation = rng.random(5)
    for t in range(n_steps):
        action = int(rng.integers(3))
        position = np.clip(observation[0] + 0.1 * (action - 1), 0.0, 1.0)
        reward = abs(observation[0] - 0.5) + (5.0 * observation[4] if t >= N_WARM_UP else 0.0)
        next_observation = np.array([position, *rng.random(4)])
        yield Transition(observation, action, reward, next_observation, False)
        observation = next_observation


@pytest.mark.parametrize("inputs", [[2], [1, 3]])
def test_inputs_that_become_relevant_later_are_added_also_after_loading(inputs, tmp_path):
    unit, three = gym.spaces.Box(0.0, 1.0, (5,), np.float64), gym.spaces.Discrete(3)
    agent = SDNNQLambda(
        unit, three, angle_pairs="none", inputs=inputs, warm_up_steps=N_WARM_UP, seed=2
    )
    agent.n_environments = 2
    resumed, observation = copy.deepcopy(agent), np.full(5, 0.3)
    inputs_after = {}  # by the number of steps
    for n_steps, transition in enumerate(changing_task(seed=1, n_steps=1700), start=1):
        for learner in (agent, resumed):
            learner.learn(transition, environment=n_steps // 2 % 2)
        if n_steps % 170 == 20:  # during the warm-up, while transitions are remembered, and later
            resumed.save(tmp_path / "agent.safetensors")
            resumed = load_agent(tmp_path / "agent.safetensors")
        if agent.is_warming_up:
            continue
        assert np.array_equal(agent.q_values(observation), resumed.q_values(observation))
        left_out = agent.learning_report()["left_out"]
        assert len(left_out) + len(agent.inputs) == 5, "all variables"
        if agent.inputs not in inputs_after.values():
            inputs_after[n_steps] = agent.inputs
    # Inputs that were left out are judged again after 2, 4, 8 ... times the steps of the warm-up.
    assert list(inputs_after) == [N_WARM_UP, 2 * N_WARM_UP]
    chosen, with_added = inputs_after.values()
    assert ("variable", [4]) not in chosen
    assert ("variable", [4]) in with_added[len(chosen) :]
    assert agent.approximator.n_inputs == len(with_added)
    assert states_equal(resumed, agent)
    other_observation = [0.3, 0.3, 0.3, 0.3, 0.9]
    assert not np.array_equal(agent.q_values(observation), agent.q_values(other_observation))


def test_an_rbf_network_keeps_the_inputs_that_its_warm_up_chose():
    unit, three = gym.spaces.Box(0.0, 1.0, (5,), np.float64), gym.spaces.Discrete(3)
    # A Q(lambda) agent would add variable 4 after twice the steps of the warm-up, 800.
    agent = RBFQLearning(unit, three, inputs=[2], warm_up_steps=N_WARM_UP)
    for t, transition in enumerate(changing_task(seed=1, n_steps=850)):
        agent.learn(transition)
        if t == N_WARM_UP:
            chosen = agent.inputs
    assert agent.inputs == chosen
    assert 4 in agent.learning_report()["left_out"]


def test_an_outlier_reward_is_not_learned_and_does_not_change_the_unit_of_values():
    agent, without_outlier = (
        SDNNQLambda(gym.spaces.Discrete(2), gym.spaces.Discrete(2)) for _ in range(2)
    )
    assert agent.learning_report()["value_unit"] is None
    for step in range(3000):
        if step == 1000:
            with pytest.warns(UserWarning, match=r"reward -1e\+12 of transition 1001"):
                agent.learn(Transition(0, 0, -1e12, 0, terminated=True))
        for learner in (agent, without_outlier):
            learner.learn(Transition(0, 1, 3.0, 0, terminated=True))
    assert agent.q_values(0).tolist() == without_outlier.q_values(0).tolist()
    report = agent.learning_report()
    assert report["recent_reward"] == 2.0  # the power of two below rewards of 3
    # A unit for the outlier would be larger than 1e-5 by far.
    assert report["value_unit"] == without_outlier.learning_report()["value_unit"] < 1e-5
