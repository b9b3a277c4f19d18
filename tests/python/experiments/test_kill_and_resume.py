import importlib.util
from pathlib import Path


def test_a_killed_command_resumes_to_the_same_rows(monkeypatch):
    path = Path(__file__).with_name("kill_and_resume.py")
    spec = importlib.util.spec_from_file_location("kill_and_resume", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    line = module.kill_and_resume(["a", "--trials", "3", "--episodes", "40"], 5, seed=1)
    assert "the same rows" in line
