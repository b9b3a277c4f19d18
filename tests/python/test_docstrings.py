"""The examples in docstrings of the package."""

import doctest
import importlib
import re
import sys
from pathlib import Path

import gymnasium as gym
import pytest

import sdnn

FOLDER = Path(sdnn.__file__).parent
EXAMPLE = re.compile(r"^ *>>> ", re.MULTILINE)
FILES = [path for path in sorted(FOLDER.rglob("*.py")) if EXAMPLE.search(path.read_text("utf-8"))]
MODULES = [
    ".".join(path.relative_to(FOLDER.parent).with_suffix("").parts).removesuffix(".__init__")
    for path in FILES
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_are_correct(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    importlib.import_module(name)
    if name == "sdnn.environments.masks" and "Taxi-v4" not in gym.registry:
        pytest.skip("Gymnasium before 1.3 has no Taxi-v4")
    result = doctest.testmod(sys.modules[name], optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0
    assert result.attempted > 0
