import gymnasium as gym
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple

from sdnn.agents.spaces import require_same_kind

SPACES = (
    Box(-1.0, 1.0, (2,)),
    Box(-1.0, 1.0, (3,)),
    Discrete(2),
    Discrete(3),
    Discrete(3, start=1),
    MultiBinary(2),
    MultiDiscrete([2, 3]),
    MultiDiscrete([2, 4]),
    MultiDiscrete([2, 3], start=[0, 1]),
    Tuple((Discrete(2), Box(-1.0, 1.0, (2,)))),
    Tuple((Discrete(3), Box(-1.0, 1.0, (2,)))),
    Dict(a=Discrete(2), b=Box(-1.0, 1.0, (2,))),
    Dict(a=Discrete(2), c=Box(-1.0, 1.0, (2,))),
)


class Spaces:
    """What is looked at of an agent and of an environment."""

    def __init__(self, observation_space, action_space=SPACES[0]):
        self.observation_space, self.action_space = observation_space, action_space


@pytest.mark.parametrize("own", SPACES, ids=str)
def test_each_space_is_like_itself_only(own):
    for given in SPACES:
        for pair in (
            (Spaces(own), Spaces(given)),
            (Spaces(SPACES[0], own), Spaces(SPACES[0], given)),
        ):
            if given is own:
                require_same_kind(*pair)
            else:
                with pytest.raises(ValueError, match="env must have the agent's"):
                    require_same_kind(*pair)


@pytest.mark.parametrize(
    ("own", "given"),
    [
        (Box(-1.0, 1.0, (2,)), Box(-np.inf, 3.0, (2,), np.float64)),
        (Discrete(3), Discrete(3, seed=1)),
        (Dict(a=Box(0.0, 1.0, (1,))), Dict(a=Box(0.0, 2.0, (1,)))),
    ],
)
def test_bounds_and_types_may_differ(own, given):
    require_same_kind(Spaces(own), Spaces(given))


def test_long_spaces_are_told_in_a_line():
    wide = gym.spaces.Box(np.arange(40.0), np.arange(40.0) + 1, dtype=np.float64)
    with pytest.raises(ValueError, match="observation_space") as caught:
        require_same_kind(Spaces(wide), Spaces(SPACES[0]))
    assert "\n" not in str(caught.value)
