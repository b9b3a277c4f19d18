"""The studies of the repository and of its documents can be run."""

from pathlib import Path

import pytest

from sdnn.reproduction.reproduce import ClaimStudy

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "studies.md").read_text()
STUDIES = sorted((ROOT / "docs" / "studies").glob("*.toml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_documented_studies_have_valid_settings(path):
    ClaimStudy(path).check()


@pytest.mark.parametrize("name", ["tie-rules", "pendulum"])
def test_the_page_shows_the_study_files_unchanged(name):
    text = (ROOT / "docs" / "studies" / f"{name}.toml").read_text()
    assert text.partition("[study]")[2] in PAGE
