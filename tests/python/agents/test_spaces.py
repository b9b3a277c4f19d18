"""Whether an environment is one that an agent was made for."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple

from refusals import refuses
from sdnn.agents.spaces import require_same_kind

PLANE = Box(-1.0, 1.0, (2,))


class Spaces:
    """What is looked at of an agent and of an environment."""

    def __init__(self, observation_space, action_space=PLANE):
        self.observation_space, self.action_space = observation_space, action_space


OBSERVED = [
    (PLANE, Box(-np.inf, 3.0, (2,), np.float64), True),
    (PLANE, MultiDiscrete([4, 4]), True),
    (PLANE, MultiBinary(2), True),
    (Box(0.0, 4.0, ()), Discrete(5), True),
    (PLANE, Box(-1.0, 1.0, (3,)), False),
    (PLANE, Box(-1.0, 1.0, (2, 1)), False),
    (Discrete(5), Discrete(4), True),
    (Discrete(5), Discrete(4, start=1), True),
    (Discrete(5), Discrete(5, start=1), False),
    (Discrete(5), Discrete(6), False),
    (MultiDiscrete([2, 3]), MultiBinary(2), True),
    (MultiBinary(2), MultiDiscrete([2, 3]), False),
    (Discrete(5), PLANE, False),
    (Dict(a=Discrete(2), b=PLANE), Dict(a=Discrete(2), b=PLANE), True),
    (Dict(a=Discrete(2), b=PLANE), Dict(a=Discrete(2), c=PLANE), False),
    (Dict(a=Discrete(2)), Dict(a=Discrete(3)), False),
    (Tuple((Discrete(2), PLANE)), Tuple((Discrete(2), PLANE)), True),
    (Tuple((Discrete(2), PLANE)), Tuple((PLANE, Discrete(2))), False),
    (Tuple((Discrete(2),)), Tuple((Discrete(2), PLANE)), False),
]
ACTED = [
    (PLANE, Box(-5.0, 1.0, (2, 1), np.float64), True),
    (PLANE, Box(-1.0, 1.0, (1,)), False),
    (PLANE, MultiBinary(2), False),
    (Discrete(3), Discrete(3, seed=1), True),
    (Discrete(2), Discrete(3), False),
    (Discrete(3), Discrete(3, start=1), False),
    (MultiDiscrete([2, 2]), MultiBinary(2), True),
    (MultiDiscrete([2, 3]), MultiDiscrete([2, 3], start=[0, 1]), False),
]


@pytest.mark.parametrize(
    ("name", "own", "found", "fits"),
    [("observation", *case) for case in OBSERVED] + [("action", *case) for case in ACTED],
    ids=str,
)
def test_what_an_agent_meets_is_possible_in_its_spaces(name, own, found, fits):
    agent, env = (
        Spaces(space) if name == "observation" else Spaces(PLANE, space) for space in (own, found)
    )
    if fits:
        require_same_kind(agent, env)
        return
    refuses("env", require_same_kind, agent, env)


def test_each_environment_of_a_vector_is_looked_at():
    envs = gym.make_vec("CartPole-v1", num_envs=2, vectorization_mode="sync")
    env = gym.make("CartPole-v1")
    require_same_kind(env, envs)
    refuses("observation_space", require_same_kind, gym.make("Pendulum-v1"), envs)


def test_long_spaces_are_told_in_a_line():
    wide = Box(np.arange(40.0), np.arange(40.0) + 1, dtype=np.float64)
    with pytest.raises(ValueError, match="observation_space") as caught:
        require_same_kind(Spaces(wide), Spaces(PLANE))
    assert "\n" not in str(caught.value)
