"""Spaces: which environments fit an agent, and which spaces are accepted."""

import enum

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple

from refusals import refuses
from sdnn.agents import FuzzyQLearning, RBFQLearning, SDNNQLambda, SDNNQLearning, load_agent
from sdnn.environments.space_kinds import require_same_kind, space_of

PLANE = Box(-1.0, 1.0, (2,))


class Spaces:
    """The attributes that are compared of an agent and an environment."""

    def __init__(self, observation_space, action_space=PLANE):
        self.observation_space, self.action_space = observation_space, action_space


OBSERVATION_SPACES = [
    (PLANE, Box(-1.0, 1.0, (2,), np.float16), True),
    (PLANE, Box(-1.0, 1.000001, (2,), np.float64), True),  # bounds that are equal as floats
    (PLANE, Box(-1.0, 1.001, (2,)), False),
    (PLANE, Box(-np.inf, 3.0, (2,), np.float64), False),
    (Box(np.finfo(np.float32).min, np.inf, (2,)), Box(-np.inf, np.inf, (2,), np.float64), True),
    (PLANE, MultiDiscrete([4, 4]), False),
    (Box(0, 1, (2,)), MultiBinary(2), True),
    (Dict(a=PLANE), Dict(a=Box(-2.0, 2.0, (2,))), False),
    (Box(0.0, 4.0, ()), Discrete(5), True),
    (PLANE, Box(-1.0, 1.0, (3,)), False),
    (PLANE, Box(-1.0, 1.0, (2, 1)), False),
    (Discrete(5), Discrete(4, start=1), True),
    (Discrete(5), Discrete(5, start=1), False),
    (Discrete(5), Discrete(6), False),
    (MultiDiscrete([2, 3]), MultiBinary(2), True),
    (MultiBinary(2), MultiDiscrete([2, 3]), False),
    (Discrete(5), PLANE, False),
    (Dict(a=Discrete(2), b=PLANE), Dict(a=Discrete(2), b=PLANE), True),
    (Dict(a=Discrete(2), b=PLANE), Dict(a=Discrete(2), c=PLANE), False),
    (Tuple((Discrete(2), PLANE)), Tuple((Discrete(2), PLANE)), True),
    (Tuple((Discrete(2),)), Tuple((Discrete(2), PLANE)), False),
]
ACTION_SPACES = [
    (PLANE, Box(-1.0, 1.0, (2, 1), np.float64), True),
    (PLANE, Box(-5.0, 1.0, (2,)), False),
    (PLANE, Box(-1.0, 1.0, (1,)), False),
    (PLANE, MultiBinary(2), False),
    (Discrete(3), Discrete(3, seed=1), True),
    (Discrete(2), Discrete(3), False),
    (Discrete(3), Discrete(3, start=1), False),
    (MultiDiscrete([2, 3]), MultiDiscrete([2, 3], start=[0, 1]), False),
]
"""Spaces of an agent and of an environment, and whether the agent accepts the environment.

Bounds of a Box must be the same, as others may be other units. All integers that an environment
observes must be possible in a discrete space of the agent; discrete actions must be the same.
"""


@pytest.mark.parametrize(
    ("name", "agent_space", "env_space", "fits"),
    [("observation", *spaces) for spaces in OBSERVATION_SPACES]
    + [("action", *spaces) for spaces in ACTION_SPACES],
    ids=str,
)
def test_environments_are_accepted_if_their_spaces_fit_the_agents(
    name, agent_space, env_space, fits
):
    agent, env = (
        Spaces(space) if name == "observation" else Spaces(PLANE, space)
        for space in (agent_space, env_space)
    )
    if fits:
        require_same_kind(agent, env)
    else:
        refuses("env", require_same_kind, agent, env)


def test_spaces_of_a_vector_are_compared_for_a_single_environment():
    envs = gym.make_vec("CartPole-v1", num_envs=2, vectorization_mode="sync")
    env = gym.make("CartPole-v1")
    require_same_kind(env, envs)
    refuses("observation_space", require_same_kind, gym.make("Pendulum-v1"), envs)


def test_messages_about_large_spaces_are_single_lines():
    wide = Box(np.arange(40.0), np.arange(40.0) + 1, dtype=np.float64)
    with pytest.raises(ValueError, match="observation_space") as caught:
        require_same_kind(Spaces(wide), Spaces(PLANE))
    assert "\n" not in str(caught.value)


def test_other_bounds_are_named_and_can_be_accepted_by_setting_the_space(tmp_path):
    agent = RBFQLearning(Tuple((Discrete(2), Box(-1, 1, (9,)))), Discrete(2))
    high = np.array([1, 57.3] + [1] * 7, np.float32)  # variable 1 in degrees, not radians
    env = Spaces(Tuple((Discrete(2), Box(-high, high))), Discrete(2))
    with pytest.raises(ValueError, match=r"variable 1 of \[1\] \(-57.3 to 57.3 instead of -1"):
        require_same_kind(agent, env)
    refuses("observation_space", setattr, agent, "observation_space", PLANE)
    agent.observation_space = env.observation_space
    agent.save(tmp_path / "agent")
    for loaded in (agent, load_agent(tmp_path / "agent")):
        require_same_kind(loaded, env)
        assert loaded.observation_range[1][-1] == 1.0


def test_an_action_space_beside_an_environment_is_refused():
    env = gym.make("CartPole-v1")
    for observed in (env, "CartPole-v1"):
        refuses("action_space", SDNNQLambda, observed, env.action_space, error=TypeError)


def test_actions_of_a_box_without_dimensions_are_arrays(tmp_path):
    actions = []

    class Push(gym.Env):
        observation_space, action_space = gym.spaces.Box(-1, 1, (1,)), gym.spaces.Box(-1, 1, ())

        def reset(self, *, seed=None, options=None):
            return np.zeros(1, np.float32), {}

        def step(self, action):
            actions.append(action)
            return np.zeros(1, np.float32), 1.0, True, False, {}

    agent = SDNNQLambda(Push(), observation_range=(-1, 1), inputs="all", seed=1)
    agent.train(Push(), steps=3)
    agent.train(gym.vector.SyncVectorEnv([Push]), steps=3)
    actions.append(agent.act(np.zeros(1)))
    assert all(type(action) is np.ndarray and action.shape == () for action in actions)


class Colour(enum.Enum):
    RED = 1


@pytest.mark.parametrize("key", [("left", 0), 3, True, (("a", 1), "b"), ()])
def test_keys_of_dict_spaces_are_saved_with_their_types(key, tmp_path):
    space = Dict([(key, PLANE), ("other", Discrete(3))])
    agent = RBFQLearning(space, Discrete(2), seed=1)
    agent.save(tmp_path / "agent")
    loaded = load_agent(tmp_path / "agent")
    assert list(loaded.observation_space.spaces) == [key, "other"]
    observation = space.sample()
    assert loaded.act(observation) == agent.act(observation)


@pytest.mark.parametrize(
    "key", [None, 0.5, b"a", Colour.RED, np.int64(3), np.str_("a"), frozenset(), ("a", 0.5)]
)
def test_dict_keys_that_cannot_be_saved_are_refused_by_the_constructor(key):
    with pytest.raises(TypeError, match=r"observation_space.*\bkey\b"):
        RBFQLearning(Dict([(key, PLANE)]), Discrete(2))


@pytest.mark.parametrize("name", ["CartPole-v1", "Pendulum-v1", "MountainCarContinuous-v0"])
@pytest.mark.parametrize("n_environments", [1, 3])
def test_batched_spaces_of_a_vector_are_refused_and_the_single_ones_named(name, n_environments):
    envs = gym.make_vec(name, num_envs=n_environments)
    with pytest.raises(ValueError, match="single_observation_space"):
        RBFQLearning(envs.observation_space, envs.action_space)
    assert RBFQLearning(envs.single_observation_space, envs.single_action_space)


def test_matrices_that_are_no_batch_of_a_vector_are_accepted_as_observations():
    for observations, actions in (
        (Box(-1.0, 1.0, (3, 2)), PLANE),
        (Box(-1.0, 1.0, (2, 2)), PLANE),
        (Box(-1.0, 1.0, (2, 2)), MultiDiscrete([2, 3])),
        (Box(np.array([[-1.0], [-2.0]]), np.ones((2, 1)), dtype=np.float64), MultiDiscrete([3, 3])),
    ):
        assert RBFQLearning(observations, actions).is_warming_up is False


def test_unbounded_actions_are_refused_with_a_remedy_that_works():
    class Unbounded(gym.Env):
        observation_space, action_space = PLANE, Box(-np.inf, np.inf, (2,))

    env = Unbounded()
    with pytest.raises(ValueError, match=r"TransformAction\(env, lambda action: action,"):
        RBFQLearning(env.observation_space, env.action_space)
    bounded = gym.wrappers.TransformAction(env, lambda action: action, Box(-1.0, 1.0, (2,)))
    assert RBFQLearning(bounded.observation_space, bounded.action_space)


def test_images_are_refused_with_a_remedy():
    for agent_class in (RBFQLearning, SDNNQLearning):
        with pytest.raises(ValueError, match="TransformObservation"):
            agent_class(Box(0, 1, (10, 10, 6), np.bool_), Discrete(6))


@pytest.mark.parametrize("agent_class", [RBFQLearning, SDNNQLearning, FuzzyQLearning])
def test_max_table_bytes_limits_the_sum_of_the_networks_of_all_action_dimensions(agent_class):
    def fits(n_dimensions, max_table_bytes):
        approximator = agent_class.approximator_type(max_table_bytes=max_table_bytes)
        try:
            agent_class(PLANE, Box(-1.0, 1.0, (n_dimensions,)), approximator=approximator)
        except ValueError as error:
            return "max_table_bytes" not in str(error)
        return True

    low, high = 1, 2**30  # bisected until `low` is the smallest limit of one network
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if fits(1, middle) else (middle + 1, high)
    for n_dimensions in (2, 3):
        assert fits(n_dimensions, n_dimensions * low)
        assert not fits(n_dimensions, n_dimensions * low - 1)


def test_bounds_in_a_file_beyond_their_dtype_are_refused():
    data = {"dtype": "<f4", "shape": [1], "box": [[-1.0], [1e300]]}
    refuses("box", space_of, data)
