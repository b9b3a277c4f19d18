"""Modules that a command imports from the current folder: only those that a user names."""

import json
from pathlib import Path

import gymnasium as gym
import pytest

import agent_files
from processes import python
from sdnn.agents import SDNNQLearning
from sdnn.runs import EnvironmentSpec, Run, RunSpec

NOTE_IMPORT = "open({path!r}, 'a').write(__name__ + '\\n')\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with modules that write their names to a file when they are imported."""
    names = ("mine", "tensorboardX", "imageio_ffmpeg", "distributed", "jinja2", "yaml", "click")
    for name in names:
        (tmp_path / f"{name}.py").write_text(NOTE_IMPORT.format(path=str(tmp_path / "imported")))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def modules_imported_by(*arguments):
    """Run a command of sdnn in the current folder; return the modules imported from there."""
    python("-m", "sdnn", *arguments)
    imported = Path("imported")
    return imported.read_text().split() if imported.exists() else []


def make_run(folder, **changes):
    """Make a run with changed keys of its configuration file."""
    spec = RunSpec(environment=EnvironmentSpec(id="Pendulum-v1"), budget={"steps": 10})
    Run.create(folder, spec)
    config = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps(config | changes))


def test_export_does_not_import_modules_named_in_a_configuration(folder):
    make_run(folder / "run", environment={"id": "mine:Mine-v0"}, agent={"name": "nobody"})
    env = gym.make("Pendulum-v1")
    agent = SDNNQLearning(env, approximator=agent_files.SMALL)
    agent.save(folder / "run" / "agent.safetensors")
    for source in ("run", "run/agent.safetensors"):
        assert modules_imported_by("export", source, "--c-header", "policy.h") == []
        assert Path("policy.h").exists()
        Path("policy.h").unlink()


def test_optional_packages_are_not_imported_from_the_current_folder(folder):
    make_run(folder / "run", output={"tensorboard": True})
    for arguments in (("resume", "run"), ("plot", "run"), ("--version",)):
        assert modules_imported_by(*arguments) == []


def test_a_module_named_in_an_environment_id_is_imported_from_the_current_folder(folder):
    assert modules_imported_by("train", "mine:Mine-v0", "--dry-run") == ["mine"]


def test_modules_imported_by_a_study_are_found_beside_its_file(folder):
    (folder / "studies").mkdir()
    (folder / "mine.py").rename(folder / "studies" / "mine.py")
    study = '[study]\nimports = ["mine"]\n[base]\nenvironment = "Pendulum-v1"\n'
    (folder / "studies" / "study.toml").write_text(study)
    assert modules_imported_by("sweep", "studies/study.toml", "--dry-run") == ["mine"]
