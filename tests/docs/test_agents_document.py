"""The pages on agents list the options, presets, spaces, features and results of the library."""

import re
from pathlib import Path

import click
import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
)
from sdnn.cli import main
from sdnn.export import export_c_header

DOCS = Path(__file__).parents[2] / "docs"
AGENTS = {
    "q-lambda": SDNNQLambda, "actor-critic": SDNNActorCritic, "sdnn-c": SDNNQLearning,
    "rbf": RBFQLearning, "fuzzy": FuzzyQLearning,
}  # fmt: skip


def options_of_commands():
    """Return the options of all commands of sdnn, such as "--seed"."""
    return {
        option
        for command in main.commands.values()
        for parameter in command.get_params(click.Context(command))
        for option in parameter.opts
    }


GUIDES = ("agents", "choosing-settings", "command-line", "robots", "small-processors", "training")


@pytest.mark.parametrize("page", GUIDES)
def test_options_named_by_a_guide_exist(page):
    text = (DOCS / "how-to" / f"{page}.md").read_text()
    text = re.sub(r"`python bench[^`]*`", "", text)  # scripts with options of their own
    assert set(re.findall(r"--[a-z][a-z-]*", text)) <= options_of_commands() | {"--help"}


def preset_cell(preset, part, name):
    """Return the cell that the table of presets must have for a setting of a part of a preset."""
    chosen = SDNNQLearning.presets[preset]
    value = getattr(getattr(chosen, part), name)
    if name == "q_low":  # the row of both bounds
        is_used = chosen.learning.value_range != "adaptive"
        return f"{value:g}, {chosen.approximator.q_high:g}" if is_used else "not used"
    if name == "n_actions" and value == 0:  # as many as there are windows
        sizes = chosen.approximator
        return f"{sizes.n_hidden_units - sizes.n_active_units + 1}"
    if isinstance(value, str):
        return f"`{value}`"
    final = getattr(getattr(chosen, part), f"final_{name}", None)
    return f"{value:g}" if final is None else f"{value:g} to {final:g}"


def test_the_table_of_presets_has_the_values_of_the_presets():
    text = (DOCS / "reference/agents/sdnn-c.md").read_text()
    # Rows such as: | `learning.n_steps` | 5 | 5 | 1 |
    name, cell = r"`(\w+)\.(\w+)`(?:, `q_high`)?", r"(.*?)"
    rows = re.findall(rf"^\| {name} \| {cell} \| {cell} \| {cell} \|", text, re.MULTILINE)
    assert len(rows) == 13, "all rows of the table were recognized"
    for part, name, *cells in rows:
        for preset, cell in zip(("general", "robust", "paper"), cells, strict=True):
            assert cell == preset_cell(preset, part, name), (name, preset)


def page_of(agent_id):
    return (DOCS / "reference" / "agents" / f"{agent_id}.md").read_text()


def rows_of(text, first_title):
    """Return the rows, cells by title, of all tables whose first column has this title."""
    rows = []
    for table in re.findall(rf"^\| {first_title} \|.*\n(?:\|.*\n)+", text, re.MULTILINE):
        lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]
        titles, _, *body = lines  # the second line is |---|---|
        rows += [dict(zip(titles, cells, strict=True)) for cells in body]
    return rows


@pytest.mark.parametrize("agent_id", AGENTS)
def test_an_agent_page_has_its_sections_in_order_and_at_most_400_words(agent_id):
    before, parameters = page_of(agent_id).split("## Parameters")
    lines_outside_tables = [line for line in before.splitlines() if not line.startswith("|")]
    assert sum(len(line.split()) for line in lines_outside_tables) <= 400
    titles = ["Can I use it?", "Example", "Notes", "Results"]
    assert re.findall(r"^## (.*)", before, re.MULTILINE) == titles
    assert f"::: sdnn.agents.{AGENTS[agent_id].__name__}\n" in parameters


SPACES = {
    "Box": gym.spaces.Box(-1.0, 1.0, (2,), np.float64),
    "Discrete": gym.spaces.Discrete(3),
    "MultiDiscrete": gym.spaces.MultiDiscrete([2, 3]),
    "MultiBinary": gym.spaces.MultiBinary(2),
    "Dict": gym.spaces.Dict(a=gym.spaces.Discrete(2)),
    "Tuple": gym.spaces.Tuple([gym.spaces.Discrete(2)]),
}


@pytest.mark.parametrize("agent_id", AGENTS)
def test_an_agent_accepts_exactly_the_spaces_that_its_page_lists(agent_id):
    rows = rows_of(page_of(agent_id), "space")
    assert [name for row in rows for name in row["space"].split(", ")] == list(SPACES)
    for row in rows:
        for space in map(SPACES.get, row["space"].split(", ")):
            AGENTS[agent_id](space, SPACES["Box"], seed=1)
            if row["actions"].startswith("✔"):
                AGENTS[agent_id](SPACES["Box"], space, seed=1)
            else:
                with pytest.raises(TypeError, match="action_space"):
                    AGENTS[agent_id](SPACES["Box"], space, seed=1)


def agent_of(agent_id, actions="Box", **settings):
    """Return an agent whose observations are a box of two variables."""
    known = {"observation_range": (-1, 1), "inputs": "all", "angle_pairs": "none", "seed": 1}
    return AGENTS[agent_id](SPACES["Box"], SPACES[actions], **known | settings)


def use_mask(agent_id, _folder):
    agent = agent_of(agent_id, "Discrete")
    assert agent.act(np.zeros(2), mask=np.array([0, 1, 0], np.int8)) == 1, "the allowed action"


def learn_foreign_action(agent_id, _folder):
    agent_of(agent_id).learn(Transition(np.zeros(2), np.zeros(2), 1.0, np.zeros(2), False))


FEATURES = {
    "missing readings": lambda agent_id, _folder: agent_of(agent_id, missing="code"),
    "action masks": use_mask,
    "transitions of other policies, logs": learn_foreign_action,
    "export as a C header": lambda agent_id, folder: export_c_header(
        agent_of(agent_id), folder / "agent.h"
    ),
}
"""Uses, of an agent's id and a folder, that raise TypeError or ValueError without the feature."""


@pytest.mark.parametrize("feature", FEATURES)
@pytest.mark.parametrize("agent_id", AGENTS)
def test_an_agent_has_exactly_the_features_that_its_page_lists(agent_id, feature, tmp_path):
    listed = {row["feature"]: row[""] for row in rows_of(page_of(agent_id), "feature")}
    try:
        FEATURES[feature](agent_id, tmp_path)
        works = True
    except (TypeError, ValueError):
        works = False
    assert listed[feature].startswith("✔") == works


@pytest.mark.parametrize("agent_id", AGENTS)
def test_every_agent_page_lists_the_features_of_all_agents(agent_id):
    listed = {row["feature"]: row[""] for row in rows_of(page_of(agent_id), "feature")}
    assert listed["vector environments"].startswith("✔")
    assert listed["exact resume"].startswith("✔")
    agent_of(agent_id).n_environments = 2
    agent_of(agent_id, missing="hold")
    # The cell of missing readings names the setting "code" for agents that have it.
    has_code = listed["missing readings"].startswith("✔")
    assert has_code == ('"code"' in listed["missing readings"])


def test_results_on_agent_pages_equal_the_benchmarks():
    evidence = (DOCS / "evidence" / "benchmarks.md").read_text()
    at_the_end = evidence.split("<!-- table: at the end -->")[1].split("<!-- end of table -->")[0]
    measured = {row["task"]: row for row in rows_of(at_the_end, "task")}
    for agent_id in AGENTS:
        for row in rows_of(page_of(agent_id), "task"):
            for column, cell in row.items():
                assert cell == measured[row["task"]][column].replace("*", ""), (agent_id, row)
