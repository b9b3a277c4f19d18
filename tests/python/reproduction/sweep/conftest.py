import sys

import pytest

from sdnn.reproduction.sweep.reading import read_study


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Write a study file and read it; the folder stays importable for the test only."""
    monkeypatch.setattr(sys, "path", [*sys.path])

    def _study(text, name="mine.toml", **options):
        path = tmp_path / name
        path.write_text(text)
        return read_study(path, **options)

    return _study
