"""The readers of the fuzz campaign take some inputs; the campaign finds every kind of fault."""

import json
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "fuzz"
sys.path.append(str(FOLDER))

import campaign  # noqa: E402
import python_readers  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")  # about what a small or changed file says


@pytest.fixture(autouse=True)
def in_own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", python_readers.TARGETS)
def test_good_files_are_read(name):
    reader = python_readers.TARGETS[name]
    for content in python_readers.good_files(name):
        path = Path(reader.name).absolute()
        path.write_bytes(content)
        reader.read(path)


@pytest.mark.parametrize("name", python_readers.NAMES)
def test_changed_files_are_refused_or_read(name):
    for number in range(300):
        assert not python_readers.execute(name, number), number


def test_every_kind_of_fault_is_found_and_counted(tmp_path, monkeypatch, capfd):
    arguments = [python_readers.FAULTY, "--executions", "12", "--out", str(tmp_path)]
    for n_runs in (1, 2):
        monkeypatch.setattr(sys, "argv", ["campaign.py", *arguments])
        assert campaign.main() == (n_runs == 1)  # the second has other numbers
    (of_commit,) = json.loads((tmp_path / "counts.json").read_text()).values()
    assert of_commit[python_readers.FAULTY]["executions"] == 24
    assert of_commit[python_readers.FAULTY]["faults"] == len(python_readers.WRONG)
    found = (tmp_path / python_readers.FAULTY / "faults.txt").read_text()
    for number, words in {
        2: "was wrong", 4: "Traceback", 6: "took too long", 8: "ended the process", 10: "took ",
    }.items():  # fmt: skip
        assert f"{number}: {words}" in found
    capfd.readouterr()
