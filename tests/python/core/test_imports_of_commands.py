"""Which modules a command imports: those that are named, never those that merely lie there."""

import json
from pathlib import Path

import gymnasium as gym
import pytest

import agent_files
from processes import python
from sdnn.agents import SDNNQLearning
from sdnn.runs import EnvironmentSpec, Run, RunSpec

LOUD = "open({path!r}, 'a').write(__name__ + '\\n')\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with modules that say so where they are imported, and what others left in it."""
    names = ("loud", "tensorboardX", "imageio_ffmpeg", "distributed", "jinja2", "yaml", "click")
    for name in names:
        (tmp_path / f"{name}.py").write_text(LOUD.format(path=str(tmp_path / "imported")))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments):
    """Run a command in the present folder; give the modules that it imported from there."""
    python(*arguments)
    imported = Path("imported")
    return imported.read_text().split() if imported.exists() else []


def make_run(folder, **changes):
    spec = RunSpec(environment=EnvironmentSpec(id="Pendulum-v1"), budget={"steps": 10})
    Run.create(folder, spec)
    config = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps(config | changes))


def test_export_does_not_import_modules_named_in_a_configuration(folder):
    make_run(folder / "run", environment={"id": "loud:Loud-v0"}, agent={"name": "nobody"})
    env = gym.make("Pendulum-v1")
    agent = SDNNQLearning(env.observation_space, env.action_space, approximator=agent_files.SMALL)
    agent.save(folder / "run" / "agent.safetensors")
    for source in ("run", "run/agent.safetensors"):
        assert run("-m", "sdnn", "export", source, "--c-header", "policy.h") == []
        assert Path("policy.h").exists()
        Path("policy.h").unlink()


def test_optional_packages_are_not_imported_from_the_current_folder(folder):
    make_run(folder / "run", output={"tensorboard": True})
    for arguments in (("resume", "run"), ("plot", "run"), ("--version",)):
        assert run("-m", "sdnn", *arguments) == []


def test_a_module_named_in_an_environment_id_is_imported_from_the_current_folder(folder):
    assert run("-m", "sdnn", "train", "loud:Loud-v0", "--dry-run") == ["loud"]


def test_modules_imported_by_a_study_are_found_beside_its_file(folder):
    (folder / "studies").mkdir()
    (folder / "loud.py").rename(folder / "studies" / "loud.py")
    study = '[study]\nimports = ["loud"]\n[base]\nenvironment = "Pendulum-v1"\n'
    (folder / "studies" / "mine.toml").write_text(study)
    assert run("-m", "sdnn", "sweep", "studies/mine.toml", "--dry-run") == ["loud"]
