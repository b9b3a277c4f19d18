"""The studies of the repository and of its documents can be run."""

import doctest
import importlib
import re
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from sdnn.cli import main
from sdnn.reproduction.report import read_study
from sdnn.runs import AGENTS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "studies.md").read_text()
BLOCKS = re.findall(r"```(toml|python)\n(.*?)```", PAGE, re.DOTALL)
STUDIES = sorted((ROOT / "docs" / "studies").glob("*.toml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_the_studies_can_be_run(path):
    read_study(path).check()


@pytest.mark.parametrize("number", range(4))
def test_the_studies_of_the_page_can_be_run(study, number):
    texts = [text for kind, text in BLOCKS if kind == "toml" and "imports" not in text]
    assert len(texts) == 4
    study(texts[number]).check()


@pytest.mark.parametrize("name", ["tie-rules", "pendulum"])
def test_the_page_shows_the_studies_as_they_are(name):
    text = (ROOT / "docs" / "studies" / f"{name}.toml").read_text()
    assert text.partition("[study]")[2] in PAGE


def test_the_agent_of_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    agent = next(text for kind, text in BLOCKS if kind == "python" and "register" in text)
    study = next(text for _, text in BLOCKS if "imports" in text)
    (tmp_path / "my_agents.py").write_text(agent)
    (tmp_path / "own-agent.toml").write_text(study.replace("= 100", "= 20"))
    monkeypatch.setattr(sys, "path", [*sys.path])
    try:
        result = CliRunner().invoke(main, ["sweep", "own-agent.toml", "--trials", "1"])
    finally:
        AGENTS.pop("random", None)
        sys.modules.pop("my_agents", None)
    assert result.exit_code == 0, result.output
    assert "random actions" in result.stdout
    assert "3 of 3 trials are stored" in result.stdout


@pytest.mark.parametrize(
    "name",
    [
        "runs.config_file", "runs.engine", "runs.environment", "runs.registry", "runs.settings",
        "runs.spec",
        "runs.report", "runs.results", "reproduction.report",
    ],
)  # fmt: skip
def test_examples_in_docstrings(name):
    result = doctest.testmod(importlib.import_module(f"sdnn.{name}"))
    assert result.failed == 0
    assert result.attempted > 0
