"""What docs/how-to/small-processors.md shows works as it stands there."""

import re
import shutil
import subprocess
from pathlib import Path

import gymnasium as gym

from sdnn.agents import SDNNQLearning
from sdnn.cli import main
from sdnn.export import c_header

TEXT = (Path(__file__).parents[2] / "docs" / "how-to" / "small-processors.md").read_text()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


# What the loop of a learner has around it.
AROUND = """
#include "pole.h"
int32_t *observation, *next_observation, reward;
int terminated;
int main(void) {
%s
}
"""


def test_the_examples_work(tmp_path, monkeypatch, skip_unless_ci):
    if shutil.which("gcc") is None:
        skip_unless_ci("needs gcc")
    monkeypatch.chdir(tmp_path)
    for text, name in zip(blocks("python"), ("cartpole", "pole"), strict=True):
        names = {}
        exec(compile(text, "small-processors.md", "exec"), names)
        assert Path(f"{name}.h").read_text() == names["header"].text
    policy, learner = blocks("c")
    options = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-ffreestanding")
    for text in (policy, AROUND % learner):
        Path("main.c").write_text(text)
        subprocess.run(["gcc", *options, "-c", "main.c"], check=True)


def test_the_names_and_options_exist():
    options = {o for c in main.commands.values() for p in c.params for o in p.opts}
    ours = re.sub(r"`python bench[^`]*`", "", TEXT)
    assert set(re.findall(r"--[a-z][a-z-]*", ours)) <= options
    env = gym.make("CartPole-v1")
    ranges = ([-4.8, -3.0, -0.4, -3.0], [4.8, 3.0, 0.4, 3.0])
    agent = SDNNQLearning(env.observation_space, env.action_space, observation_range=ranges)
    header = c_header(agent, "cartpole").text
    told = set(re.findall(r"`((?:cartpole|CARTPOLE)_\w+)", TEXT))
    box_only = {"cartpole_action_fixed", "cartpole_action_float"}
    assert len(told) > 8
    assert {name for name in told if not re.search(rf"\b{name}\b", header)} == box_only
