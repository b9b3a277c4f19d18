"""Commands that were killed, or met a full disk, resume to the rows of an uninterrupted run."""

import importlib.util
from pathlib import Path

import pytest

STUDY = """
[study]
title = "Ties"
trials = 2
cases = ["s4"]

[base]
budget.episodes = 20

[axes]
learning.tie_rule = ["lowest", "uniform"]
"""


@pytest.fixture
def module():
    """The script kill_and_resume.py as a module."""
    path = Path(__file__).with_name("kill_and_resume.py")
    spec = importlib.util.spec_from_file_location("kill_and_resume", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_killed_reproduction_resumes_to_the_same_rows(module):
    arguments = ["reproduce", "a", "--trials", "2", "--episodes", "30"]
    report = module.kill_and_resume(arguments, n_kills=4, seed=1)
    assert "the same rows" in report


def test_a_killed_sweep_resumes_to_the_same_rows(module, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    arguments = ["sweep", str(tmp_path / "study.toml")]
    report = module.kill_and_resume(arguments, n_kills=2, seed=2)
    assert "the same rows" in report


def test_a_full_disk_is_reported_without_traceback_and_the_command_resumes(module, tmp_path):
    arguments = ["reproduce", "a", "--trials", "1", "--episodes", "20"]
    whole, full = tmp_path / "whole", tmp_path / "full"
    module.run(whole, arguments)
    for max_bytes in (2**12, 2**15):
        process = module.run_with_small_files(full, arguments, max_bytes)
        assert process.returncode == 1, process.stdout
        assert "Error" in process.stdout
        assert "Traceback" not in process.stdout
    module.run(full, arguments)
    assert module.content(full) == module.content(whole)
