"""What docs/how-to/agents.md shows works as it stands there."""

import re
from pathlib import Path

import gymnasium as gym

from sdnn.agents import PRESETS
from sdnn.cli import main
from sdnn.runs.config_file import read_spec

TEXT = (Path(__file__).parents[2] / "docs" / "how-to" / "agents.md").read_text()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def test_the_python_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = "\n".join(blocks("python"))
    assert code.count("gym.register(") == 1
    names = {"__name__": "docking"}
    monkeypatch.delitem(gym.registry, "mine/Docking-v0", raising=False)
    try:
        exec(compile(code, "agents.md", "exec"), names)
    finally:
        gym.registry.pop("mine/Docking-v0", None)
    assert names["result"].evaluations.shape == (2, 2)
    assert names["training"].n_steps == 4000


def test_the_commands_and_options_exist():
    shell = "\n".join(blocks("sh"))
    words = set(re.findall(r"sdnn (\w+)", shell))
    assert words == {"train", "resume", "evaluate", "plot", "record", "export"}
    options = {o for c in main.commands.values() for p in c.params for o in p.opts}
    assert set(re.findall(r"--[a-z][a-z-]*", TEXT)) <= options


def test_the_configuration_file_is_one(tmp_path):
    (text,) = blocks("toml")
    (tmp_path / "mine.toml").write_text(text)
    spec = read_spec(tmp_path / "mine.toml")
    assert spec.make_agent(spec.make_env()).approximator.rounding == "random"


def test_the_table_of_presets_is_right():
    name, cell = r"`(\w+)\.(\w+)`(?:, `q_high`)?", r"(.*?)"
    rows = re.findall(rf"^\| {name} \| {cell} \| {cell} \| {cell} \|", TEXT, re.MULTILINE)
    assert len(rows) == 13
    for section, name, *cells in rows:
        for preset, cell in zip(("general", "robust", "paper"), cells, strict=True):
            chosen = PRESETS[preset]
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
