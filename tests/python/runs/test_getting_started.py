"""What docs/getting-started.md shows works as it stands there."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from sdnn.cli import main

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "getting-started.md").read_text()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("code", blocks("python"))
def test_the_programs_run(code, tmp_path, monkeypatch, capsys):
    if "sklearn" in code:
        pytest.importorskip("sklearn")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "getting-started.md", "exec"), {})
    for line in capsys.readouterr().out.split():
        # Friedman's problem is mostly explained, the car reaches its hill.
        assert float(line) > (0.5 if "sklearn" in code else 85.0)
    assert list(tmp_path.glob("*.safetensors"))


def test_the_commands_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (study,) = blocks("toml")
    (tmp_path / "ties.toml").write_text(study)
    lines = [line.split("#")[0].split() for block in blocks("sh") for line in block.splitlines()]
    commands = [words[1:] for words in lines if words and words[0] == "sdnn"]
    assert [words[0] for words in commands] == [
        "--version", "reproduce", "sweep", "train", "plot", "record",
    ]  # fmt: skip
    for words in commands:
        if words[0] == "reproduce":
            words += ["--episodes", "20", "--trials", "1", "--jobs", "1"]
        if words[0] == "sweep":
            words += ["--trials", "1"]
        done = CliRunner().invoke(main, words)
        assert done.exit_code == 0, f"{words}: {done.output}"
    assert (tmp_path / "results" / "ties-report.html").exists()
    assert (tmp_path / "car.gif").stat().st_size > 1000
