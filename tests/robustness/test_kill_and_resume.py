import importlib.util
import resource
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
    path = Path(__file__).with_name("kill_and_resume.py")
    spec = importlib.util.spec_from_file_location("kill_and_resume", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_killed_reproduction_resumes_to_the_same_rows(module):
    line = module.kill_and_resume(["reproduce", "a", "--trials", "2", "--episodes", "30"], 4, 1)
    assert "the same rows" in line


def test_a_killed_sweep_resumes_to_the_same_rows(module, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    line = module.kill_and_resume(["sweep", str(tmp_path / "study.toml")], 2, 2)
    assert "the same rows" in line


def test_a_full_disk_is_reported_without_traceback_and_the_command_resumes(module, tmp_path):
    arguments = ["reproduce", "a", "--trials", "1", "--episodes", "20"]
    whole, full = tmp_path / "whole", tmp_path / "full"
    module.run(whole, arguments)
    for size in (2**12, 2**15):  # bytes of a file
        ended = module.ended(full, arguments, limit=(resource.RLIMIT_FSIZE, size))
        assert ended.returncode == 1, ended.stdout
        assert "Error" in ended.stdout
        assert "Traceback" not in ended.stdout
    module.run(full, arguments)
    assert module.content(full) == module.content(whole)
