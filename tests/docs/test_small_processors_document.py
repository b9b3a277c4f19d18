"""Statements of docs/how-to/small-processors.md hold."""

import re
from pathlib import Path

import click
import gymnasium as gym

from sdnn.agents import SDNNQLearning
from sdnn.cli import main
from sdnn.export import c_header

TEXT = (Path(__file__).parents[2] / "docs" / "how-to" / "small-processors.md").read_text()


def test_names_and_options_on_the_page_of_small_processors_exist():
    commands = main.commands.values()
    options = {o for c in commands for p in c.get_params(click.Context(c)) for o in p.opts}
    ours = re.sub(r"`python bench[^`]*`", "", TEXT)
    assert set(re.findall(r"--[a-z][a-z-]*", ours)) <= options
    env = gym.make("CartPole-v1")
    ranges = ([-4.8, -3.0, -0.4, -3.0], [4.8, 3.0, 0.4, 3.0])
    agent = SDNNQLearning(env.observation_space, env.action_space, observation_range=ranges)
    header = c_header(agent, "cartpole").text
    named = set(re.findall(r"`((?:cartpole|CARTPOLE)_\w+)", TEXT))
    assert len(named) > 8
    assert {name for name in named if not re.search(rf"\b{name}\b", header)} == set()
