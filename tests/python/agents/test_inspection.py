"""Inspected agents, in tasks whose answer is known: which input matters, where actions switch.

`meet_states` runs an agent for its states, a `Reader` returns values and greedy actions in states,
`map_of` those along one or two inputs while the others have typical values.
"""

import copy
import io

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    evaluate,
)
from sdnn.agents.inspection import (
    AgentInput,
    Reader,
    influences,
    inputs_of,
    meet_states,
    named_inputs,
    variable_names,
)
from sdnn.agents.schedules import schedule_of
from sdnn.agents.state_maps import N_ON_MAP, map_of, replay
from sdnn.environments import ActionMasks
from sdnn.export import c_header
from sdnn.training.training import Callback

WITHOUT_SEARCH = {"inputs": "all", "angle_pairs": "none", "history": "none"}
SWITCH = 0.2  # value of an observation at which the best action changes


class Bandit(gym.Env):
    """Episodes of one step with a random observation and `reward(observation, action)`."""

    def __init__(self, observation_space, action_space, reward):
        self.observation_space, self.action_space = observation_space, action_space
        self._reward = reward

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        if seed is not None:
            self.observation_space.seed(seed)
        self._observation = self.observation_space.sample()
        return self._observation, {}

    def step(self, action):
        reward = float(self._reward(self._observation, action))
        self._observation = self.observation_space.sample()
        return self._observation, reward, True, False, {}


def box(n):
    return gym.spaces.Box(-1.0, 1.0, (n,))


def reward_of_switching(observation, action):
    return action == (observation[1] > SWITCH)


@pytest.fixture(scope="module")
def switching_agent():
    """An agent whose best action depends on the second of three variables, and its task."""
    env = Bandit(box(3), gym.spaces.Discrete(2), reward_of_switching)
    agent = SDNNQLambda(env, seed=1, **WITHOUT_SEARCH)
    agent.train(env, steps=6000)
    return agent, env


def influences_in(agent, env, seed=0):
    return influences(Reader(agent), meet_states(agent, env, seed), inputs_of(agent), seed)


def test_the_input_that_decides_has_the_largest_influence(switching_agent):
    for seed in range(3):
        first, *others = influences_in(*switching_agent, seed)
        assert first.input.columns == (1,)
        assert first.on_actions > 0.3
        assert max(other.on_actions for other in others) < 0.1
        assert max(other.on_values for other in others) < first.on_values / 2


def test_the_policy_switches_where_the_optimal_one_does(switching_agent):
    agent, env = switching_agent
    inputs = inputs_of(agent)
    states = meet_states(agent, env)
    line = map_of(Reader(agent), states, [inputs[1]], inputs)
    (numbers,) = line.axes
    actions = line.actions[:, 0]  # in the only dimension of the action space
    tolerance = 0.12
    np.testing.assert_array_equal(actions[numbers < SWITCH - tolerance], 0.0)
    np.testing.assert_array_equal(actions[numbers > SWITCH + tolerance], 1.0)
    plane = map_of(Reader(agent), states, [inputs[0], inputs[1]], inputs)
    assert plane.values.shape == (N_ON_MAP, N_ON_MAP)
    is_right = plane.actions[..., 0] == (plane.axes[1] > SWITCH)[:, np.newaxis]
    assert is_right.mean() > 0.9
    assert plane.typical.keys() == {"observation 2"}
    assert plane.typical["observation 2"] == pytest.approx(np.median(states.rows[:, 2]))


def test_a_discrete_part_of_a_dict_that_decides_is_found_and_mapped():
    space = gym.spaces.Dict(
        colour=gym.spaces.Discrete(3), gear=gym.spaces.Discrete(4, start=2), speed=box(1)
    )
    env = Bandit(space, gym.spaces.Discrete(2), lambda x, action: action == (x["gear"] % 2))
    agent = SDNNQLambda(env, seed=1, **WITHOUT_SEARCH)
    agent.train(env, steps=4000)
    first, *_ = influences_in(agent, env)
    # Flattened, columns 0 to 2 are the colours, 3 to 6 the four gears, and 7 the speed.
    assert (first.input.name, first.input.type, first.input.columns) == (
        "gear", "symbol", (3, 4, 5, 6)
    )  # fmt: skip
    inputs = inputs_of(agent)
    line = map_of(Reader(agent), meet_states(agent, env), [first.input], inputs)
    # Symbols are counted from 0, gears from 2, so that even symbols are even gears.
    np.testing.assert_array_equal(line.axes[0], [0, 1, 2, 3])
    np.testing.assert_array_equal(line.actions[:, 0], [0, 1, 0, 1])


def test_an_angle_is_one_input_in_degrees():
    def reward(observation, action):
        return action == (observation[1] > 0.0)

    class Angles(gym.spaces.Box):
        """Cosine and sine of an angle, and noise."""

        def sample(self):
            angle = self.np_random.uniform(-np.pi, np.pi)
            noise = self.np_random.uniform(-1.0, 1.0)
            return np.array([np.cos(angle), np.sin(angle), noise], np.float32)

    env = Bandit(Angles(-1.0, 1.0, (3,)), gym.spaces.Discrete(2), reward)
    agent = SDNNQLambda(env, seed=1, **WITHOUT_SEARCH | {"angle_pairs": [(0, 1)]})
    agent.train(env, steps=4000)
    inputs = inputs_of(agent)
    angle = next(agent_input for agent_input in inputs if agent_input.type == "angle")
    assert angle.columns == (0, 1)
    states = meet_states(agent, env)
    line = map_of(Reader(agent), states, [angle], inputs)
    degrees, actions = line.axes[0], line.actions[:, 0]
    assert (degrees[0], degrees[-1]) == (-180.0, 180.0)
    # Action 1 is rewarded where the sine is positive; angles near its zeros are left out.
    assert (actions[(degrees > 20) & (degrees < 160)] == 1.0).mean() > 0.9
    assert (actions[(degrees > -160) & (degrees < -20)] == 0.0).mean() > 0.9
    placed = states.rows[:3].copy()
    angle.write(placed, np.array([90.0, -90.0, 180.0]))
    np.testing.assert_allclose(placed[:, :2], [[0, 1], [0, -1], [-1, 0]], atol=1e-12)
    np.testing.assert_allclose(angle.numbers(placed), [90.0, -90.0, 180.0])


@pytest.mark.parametrize(
    "agent_class", [SDNNQLambda, SDNNQLearning, SDNNActorCritic, RBFQLearning, FuzzyQLearning]
)
def test_a_reader_returns_the_values_and_greedy_actions_of_the_agents_methods(agent_class):
    env = Bandit(box(2), gym.spaces.Box(-1.0, 1.0, (2,)), lambda o, a: -abs(o[0] - a).sum())
    options = {} if agent_class in (RBFQLearning, FuzzyQLearning) else WITHOUT_SEARCH
    agent = agent_class(env, seed=1, **options)
    agent.train(env, steps=600)
    states = meet_states(agent, env).thinned(20)
    reading = Reader(agent).read(states)
    assert reading.allowed.all()
    columns = states.rows, reading.action_values, reading.values, reading.actions
    for state, values, value, action in zip(*columns, strict=True):
        state = state.astype(np.float32)
        agent.begin_greedy_episode()
        if hasattr(agent, "value"):
            expected = agent.value(state)
        else:
            q_values = [agent.q_values(state, dimension) for dimension in range(2)]
            np.testing.assert_array_equal(values, np.concatenate(q_values))
            total = q_values[0].max() + q_values[1].max()
            # Each dimension learns a share of the value, or the whole value.
            expected = total if agent_class is SDNNQLambda else total / 2
        assert value == expected
        if agent_class is not FuzzyQLearning:  # its choice among equal values is random
            np.testing.assert_allclose(action, agent.act(state, explore=False), rtol=1e-6)


def test_continuous_actions_follow_the_input_that_decides():
    def reward(observation, action):
        return -abs(observation[1] - action[0])

    env = Bandit(box(2), gym.spaces.Box(-1.0, 1.0, (1,)), reward)
    agent = SDNNQLambda(env, seed=1, **WITHOUT_SEARCH)
    agent.train(env, steps=6000)
    assert influences_in(agent, env)[0].input.columns == (1,)
    inputs = inputs_of(agent)
    line = map_of(Reader(agent), meet_states(agent, env), [inputs[1]], inputs)
    lowest, highest = line.actions[:40], line.actions[-40:]  # at low and high observations
    assert lowest.mean() < -0.4
    assert highest.mean() > 0.4


def test_inspecting_changes_nothing_that_is_learned(switching_agent):
    agent, env = copy.deepcopy(switching_agent)
    untouched, untouched_env = copy.deepcopy(switching_agent)
    Reader(agent).read(meet_states(agent, env))
    influences_in(agent, env)
    replay(Reader(agent), env)
    agent.train(env, steps=300, seed=5)
    untouched.train(untouched_env, steps=300, seed=5)
    state, expected = agent.state(), untouched.state()
    assert state.keys() == expected.keys()
    for name, array in state.items():
        if "evaluation" not in name:  # an inspection is an evaluation, which has its own history
            np.testing.assert_array_equal(array, expected[name], err_msg=name)


def test_a_replay_is_the_first_episode_of_an_evaluation():
    env = gym.make("CartPole-v1")
    agent = SDNNQLambda(env, seed=1)
    agent.train(env, steps=2500)
    evaluation = evaluate(agent, env, 1, seed=7)
    episode = replay(Reader(agent), env, 7)
    assert episode.total_reward == evaluation.returns[0]
    assert len(episode.values) == evaluation.lengths[0]
    assert episode.terminated == evaluation.terminated[0]
    assert episode.states.shape == (len(episode.values), 4)
    assert episode.actions.shape == (len(episode.values), 1)


class Noise(gym.ObservationWrapper):
    """Appends four variables of noise."""

    def __init__(self, env):
        super().__init__(env)
        space = env.observation_space
        low = np.concatenate([space.low, np.full(4, -np.inf, np.float32)])
        high = np.concatenate([space.high, np.full(4, np.inf, np.float32)])
        self.observation_space = gym.spaces.Box(low, high)

    def observation(self, observation):
        noise = self.np_random.normal(size=4)
        return np.concatenate([observation, noise]).astype(np.float32)


@pytest.mark.parametrize("inputs", ["relevant", "all"])
def test_inputs_of_noise_rank_last_and_have_no_influence_if_only_relevant_ones_are_used(inputs):
    env = Noise(gym.make("CartPole-v1"))
    agent = SDNNQLambda(env, seed=100, inputs=inputs)
    agent.train(env, steps=12_000)
    order = influences_in(agent, env)
    # Variables 0 to 3 are those of CartPole, 4 to 7 noise.
    assert {influence.input.columns[0] for influence in order[-4:]} == {4, 5, 6, 7}
    if inputs == "relevant":
        unused = [influence for influence in order if not influence.input.is_used]
        assert [influence.on_values for influence in unused] == [0.0] * 4


def test_observations_with_missing_values_are_in_replays_but_not_in_states_for_maps():
    class WithMissingValues(gym.ObservationWrapper):
        def observation(self, observation):
            return np.where(self.np_random.random(4) < 0.1, np.nan, observation).astype(np.float32)

    env = WithMissingValues(gym.make("CartPole-v1"))
    agent = SDNNQLambda(env, seed=1, missing="code")
    agent.train(env, steps=2000)
    states = meet_states(agent, env)
    assert np.isfinite(states.rows).all()
    assert np.isnan(replay(Reader(agent), env).states).any()


def test_variables_are_named_after_their_places_in_nested_spaces():
    space = gym.spaces.Dict(
        arm=gym.spaces.Dict(angle=box(1), speed=box(2)),
        pair=gym.spaces.Tuple((gym.spaces.Discrete(2, start=3), box(1))),
    )
    assert variable_names(space) == [
        "arm.angle", "arm.speed[0]", "arm.speed[1]", "pair[0] = 3", "pair[0] = 4", "pair[1]"
    ]  # fmt: skip
    assert len(variable_names(space)) == gym.spaces.flatdim(space)
    assert variable_names(gym.spaces.MultiBinary(2)) == ["observation 0", "observation 1"]


def test_one_or_two_different_inputs_are_chosen_by_name_or_number(switching_agent):
    inputs = inputs_of(switching_agent[0])
    assert named_inputs(["observation 2", 0], inputs) == [inputs[2], inputs[0]]
    assert named_inputs(list(np.array([2, 0])), inputs) == [inputs[2], inputs[0]]
    for names in (["other"], ["9"], [], ["0", "1", "2"], ["1", "observation 1"]):
        refuses("inputs", named_inputs, names, inputs)


def test_a_constant_variable_has_a_range_of_width_1_around_it():
    states = np.array([[2.0], [2.0]])
    assert AgentInput("x", "variable", (0,)).limits(states) == (1.5, 2.5)


def test_the_typical_symbol_is_the_most_frequent_one_and_symbols_are_placed_as_one_hot():
    states = np.array([[1, 0], [0, 1], [0, 1]])
    symbol = AgentInput("x", "symbol", (0, 1))
    assert symbol.typical(states) == 1.0
    symbol.write(states, np.zeros(3))
    np.testing.assert_array_equal(states, [[1, 0]] * 3)


class NoteSchedules(Callback):
    """Notes steps, progress, epsilon and learning rate at every hundredth step."""

    step_interval = 100

    def __init__(self):
        self.points = []

    def on_step(self, training):
        progress = training.n_steps / training.steps
        agent = training.agent
        self.points.append((training.n_steps, progress, agent.epsilon, agent.learning_rate))


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning, SDNNActorCritic])
def test_inspected_schedules_are_those_of_the_training(agent_class):
    env = Bandit(box(2), gym.spaces.Discrete(2), reward_of_switching)
    agent = agent_class(env, seed=1, **WITHOUT_SEARCH)
    notes = NoteSchedules()
    agent.train(env, steps=1000, callbacks=[notes])
    steps, progress, epsilon, learning_rate = map(np.array, zip(*notes.points, strict=True))
    schedule = schedule_of(agent, steps, progress)
    np.testing.assert_allclose(schedule.epsilon, epsilon, atol=1e-4)
    np.testing.assert_allclose(schedule.learning_rate, learning_rate, atol=1e-3)


def test_agents_draw_values_policies_and_inputs_and_refuse_unknown_inputs_and_other_sources(
    switching_agent,
):
    agent, env = switching_agent
    observations = [env.observation_space.sample() for _ in range(30)]
    plot_of_inputs = agent.plot_inputs(env, seed=3)
    for figure in (
        agent.plot_values(env),
        agent.plot_policy(observations, inputs=["observation 1"]),
        agent.plot_values(observations, inputs=[0, 2]),
        plot_of_inputs,
    ):
        file = io.BytesIO()
        figure.savefig(file)
        assert len(file.getvalue()) > 3000, "bytes, more than an empty figure has"
    titles = [axes.get_title(loc="left") for axes in plot_of_inputs.axes]
    assert titles == ["change of values", "change of greedy actions"]
    refuses("inputs", agent.plot_values, env, inputs=["none"])
    refuses("source", agent.plot_policy, observations[:1])
    refuses("source", agent.plot_policy, gym.make("MountainCar-v0"))


class Doors(gym.Env):
    """Action i is allowed above i thirds of the range of observation 0, and has the reward i."""

    observation_space, action_space = box(2), gym.spaces.Discrete(3)

    def __init__(self):
        self.metadata = {"action_masks": True}

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observe()

    def step(self, action):
        assert action < self._n_allowed
        observation, info = self._observe()
        return observation, float(action), True, False, info

    def _observe(self):
        observation = self.np_random.uniform(-1.0, 1.0, 2).astype(np.float32)
        self._n_allowed = n_allowed_at(observation[0])
        return observation, {"action_mask": np.arange(3) < self._n_allowed}


def n_allowed_at(x):
    """Return the number of allowed actions at values of observation 0: 1, 2 or 3."""
    return 1 + ((x + 1.0) * 1.5).astype(int)


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning, SDNNActorCritic])
def test_masked_actions_are_in_no_reading_map_or_replay(agent_class):
    env = Doors()
    agent = agent_class(env, seed=1, inputs="all", angle_pairs="none", warm_up_steps=100)
    agent.train(env, steps=3000)
    reader, inputs = Reader(agent), inputs_of(agent)
    states = meet_states(agent, env)
    numbers = states.rows[:, 0]
    n_allowed = n_allowed_at(numbers)
    np.testing.assert_array_equal(states.allowed.sum(axis=1), n_allowed)
    reading = reader.read(states)
    assert (reading.actions[:, 0] < n_allowed).all()
    assert (reader.read(states._replace(allowed=None)).actions[:, 0] >= n_allowed).any()
    for state, value, mask in zip(states.rows, reading.values, states.allowed, strict=True):
        assert reader.value(state, mask) == value
    line = map_of(reader, states, [inputs[0]], inputs)
    points = line.axes[0]
    half_gap = (points[1] - points[0]) / 2
    # A point has the mask of the nearest state, which may be half a gap to its right.
    is_near_states = np.abs(points[:, np.newaxis] - numbers).min(axis=1) < half_gap
    assert is_near_states.mean() > 0.5
    assert (line.actions[:, 0] < n_allowed_at(points + half_gap))[is_near_states].all()
    plane = map_of(reader, states, inputs[:2], inputs)
    assert plane.actions.shape == (N_ON_MAP, N_ON_MAP, 1)
    for influence in influences(reader, states, inputs):
        assert np.isfinite([influence.on_values, influence.on_actions]).all()
    assert replay(reader, env, 3).actions.shape == (1, 1)


def test_states_without_a_mask_allow_all_actions_and_meeting_masks_does_not_prevent_exports():
    class WithoutFullMasks(Doors):
        def _observe(self):
            observation, info = super()._observe()
            return observation, {"action_mask": None} if self._n_allowed == 3 else info

    agent = SDNNQLambda(box(2), gym.spaces.Discrete(3), seed=1, **WITHOUT_SEARCH)
    states = meet_states(agent, WithoutFullMasks())
    np.testing.assert_array_equal(states.allowed.sum(axis=1), n_allowed_at(states.rows[:, 0]))
    assert "policy" in c_header(agent, "policy").text


def test_greedy_actions_on_a_map_of_discrete_states_are_allowed_in_these_states():
    latest_taxi = max(name for name in gym.registry if name.startswith("Taxi-v"))
    env = ActionMasks(gym.make(latest_taxi))
    agent = SDNNQLambda(env, seed=1)
    agent.train(env, steps=3000)
    inputs = inputs_of(agent)
    line = map_of(Reader(agent), meet_states(agent, env), inputs, inputs)
    for state, action in zip(line.axes[0], line.actions[:, 0], strict=True):
        assert env.unwrapped.action_mask(int(state))[int(action)] == 1


def test_agents_that_are_warming_up_cannot_be_inspected():
    env = gym.make("CartPole-v1")
    agent = SDNNQLambda(env, seed=1)
    for draw in (agent.plot_values, agent.plot_policy, agent.plot_inputs):
        with pytest.raises(RuntimeError):
            draw(env)
