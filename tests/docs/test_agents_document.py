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


def test_options_named_by_the_guides_exist():
    commands = main.commands.values()
    options = {o for c in commands for p in c.get_params(click.Context(c)) for o in p.opts}
    for page in ("agents", "choosing-settings", "command-line", "robots", "training"):
        text = (DOCS / "how-to" / f"{page}.md").read_text()
        assert set(re.findall(r"--[a-z][a-z-]*", text)) <= options | {"--help"}, page


def test_the_table_of_presets_has_the_values_of_the_presets():
    text = (DOCS / "reference/agents/sdnn-c.md").read_text()
    name, cell = r"`(\w+)\.(\w+)`(?:, `q_high`)?", r"(.*?)"
    rows = re.findall(rf"^\| {name} \| {cell} \| {cell} \| {cell} \|", text, re.MULTILINE)
    assert len(rows) == 13
    for section, name, *cells in rows:
        for preset, cell in zip(("general", "robust", "paper"), cells, strict=True):
            chosen = SDNNQLearning.presets[preset]
            value = getattr(getattr(chosen, section), name)
            final = getattr(getattr(chosen, section), f"final_{name}", None)
            if name == "q_low":
                shown = "not used" if chosen.learning.value_range == "adaptive" else "-20, 20"
            elif name == "n_actions":
                sizes = chosen.approximator
                shown = f"{value or sizes.n_hidden_units - sizes.n_active_units + 1}"
            elif isinstance(value, str):
                shown = f"`{value}`"
            else:
                shown = f"{value:g}" + ("" if final is None else f" to {final:g}")
            assert cell == shown, (name, preset)


def page_of(agent_id):
    return (DOCS / "reference" / "agents" / f"{agent_id}.md").read_text()


def rows_of(text, first_cell):
    """Return the rows, cells by column, of the tables whose first column has this title."""
    rows = []
    for table in re.findall(rf"^\| {first_cell} \|.*\n(?:\|.*\n)+", text, re.MULTILINE):
        lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]
        rows += [dict(zip(lines[0], cells, strict=True)) for cells in lines[2:]]
    return rows


@pytest.mark.parametrize("agent_id", AGENTS)
def test_an_agent_page_has_its_sections_in_order_and_at_most_400_words(agent_id):
    before, parameters = page_of(agent_id).split("## Parameters")
    assert sum(len(line.split()) for line in before.splitlines() if line[:1] != "|") <= 400
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


@pytest.mark.parametrize("agent_id", AGENTS)
def test_an_agent_has_exactly_the_features_that_its_page_lists(agent_id, tmp_path):
    features = {row["feature"]: row[""] for row in rows_of(page_of(agent_id), "feature")}
    known = {"observation_range": (-1, 1), "inputs": "all", "angle_pairs": "none", "seed": 1}
    agent = AGENTS[agent_id](SPACES["Box"], SPACES["Box"], **known)
    agent.n_environments = 2
    zeros = np.zeros(2)

    def works(call):
        try:
            call()
        except (TypeError, ValueError):
            return False
        return True

    def has(feature):
        return features[feature].startswith("✔")

    def act_with_mask():
        masked = AGENTS[agent_id](SPACES["Box"], SPACES["Discrete"], **known)
        assert masked.act(zeros, mask=np.array([0, 1, 0], np.int8)) == 1

    assert works(lambda: AGENTS[agent_id](*[SPACES["Box"]] * 2, missing="hold", seed=1))
    has_code = works(lambda: AGENTS[agent_id](*[SPACES["Box"]] * 2, missing="code", seed=1))
    assert has_code == has("missing readings") == ('"code"' in features["missing readings"])
    assert works(act_with_mask) == has("action masks")
    is_off_policy = works(lambda: agent.learn(Transition(zeros, zeros, 1.0, zeros, False)))
    assert is_off_policy == has("transitions of other policies, logs")
    is_exported = works(lambda: export_c_header(agent, tmp_path / "agent.h"))
    assert is_exported == has("export as a C header")
    assert has("vector environments")
    assert has("exact resume")


def test_results_on_agent_pages_equal_the_benchmarks():
    evidence = (DOCS / "evidence" / "benchmarks.md").read_text()
    at_the_end = evidence.split("<!-- table: at the end -->")[1].split("<!-- end of table -->")[0]
    measured = {row["task"]: row for row in rows_of(at_the_end, "task")}
    for agent_id in AGENTS:
        for row in rows_of(page_of(agent_id), "task"):
            for column, cell in row.items():
                assert cell == measured[row["task"]][column].replace("*", ""), (agent_id, row)
