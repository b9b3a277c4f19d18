"""Statements of the pages on agents hold."""

import re
from pathlib import Path

from sdnn.agents import SDNNQLearning
from sdnn.cli import main

FOLDER = Path(__file__).parents[2] / "docs" / "how-to"


def test_the_options_exist():
    options = {o for c in main.commands.values() for p in c.params for o in p.opts}
    for page in ("agents", "choosing-settings", "command-line", "robots", "training"):
        text = (FOLDER / f"{page}.md").read_text()
        assert set(re.findall(r"--[a-z][a-z-]*", text)) <= options | {"--help"}, page


def test_the_table_of_presets_is_right():
    text = (FOLDER / "choosing-settings.md").read_text()
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
