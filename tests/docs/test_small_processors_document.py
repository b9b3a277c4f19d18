"""Statements of docs/how-to/small-processors.md hold."""

import re
from pathlib import Path

import gymnasium as gym

from sdnn.agents import SDNNQLearning
from sdnn.export import c_header

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "small-processors.md"


def test_functions_and_macros_on_the_page_of_small_processors_are_in_a_header():
    env = gym.make("CartPole-v1")
    ranges = ([-4.8, -3.0, -0.4, -3.0], [4.8, 3.0, 0.4, 3.0])
    agent = SDNNQLearning(env.observation_space, env.action_space, observation_range=ranges)
    header = c_header(agent, "cartpole").text
    named = set(re.findall(r"`((?:cartpole|CARTPOLE)_\w+)", PAGE.read_text()))
    assert len(named) > 8
    assert {name for name in named if not re.search(rf"\b{name}\b", header)} == set()
