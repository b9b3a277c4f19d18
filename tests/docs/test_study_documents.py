"""The studies of the repository and of its documents can be run."""

import doctest
import importlib
from pathlib import Path

import pytest

from sdnn.reproduction.claim_study import ClaimStudy

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "studies.md").read_text()
STUDIES = sorted((ROOT / "docs" / "studies").glob("*.toml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_the_studies_can_be_run(path):
    ClaimStudy(path).check()


@pytest.mark.parametrize("name", ["tie-rules", "pendulum"])
def test_the_page_shows_the_studies_as_they_are(name):
    text = (ROOT / "docs" / "studies" / f"{name}.toml").read_text()
    assert text.partition("[study]")[2] in PAGE


@pytest.mark.parametrize(
    "name",
    [
        "support.toml", "runs.engine", "runs.environment", "agents.registry", "support.arguments",
        "runs.spec", "runs.report", "runs.results", "reports.pages",
        "reports.statistics", "reproduction.reproduce", "environments.paper_acrobot",
    ],
)  # fmt: skip
def test_examples_in_docstrings(name):
    result = doctest.testmod(importlib.import_module(f"sdnn.{name}"))
    assert result.failed == 0
    assert result.attempted > 0
