"""The fuzz campaign counts what it has executed and found; test_bad_values tries its mutations."""

import json
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "fuzz"))

import campaign


def test_the_fuzz_campaign_adds_executions_and_faults_of_its_runs(tmp_path, monkeypatch, capfd):
    def failures(_make_cells, name, first, n):
        return n, [f"{name}, mutation {first}: was wrong"] * (first == 0)

    monkeypatch.setattr(campaign, "failures", failures)
    arguments = ["run", "--executions", "12", "--out", str(tmp_path)]
    for n_runs in (1, 2):
        monkeypatch.setattr(sys, "argv", ["campaign.py", *arguments])
        assert campaign.main() == (n_runs == 1)  # the second has other numbers
    (of_commit,) = json.loads((tmp_path / "counts.json").read_text()).values()
    assert (of_commit["run"]["executions"], of_commit["run"]["faults"]) == (24, 1)
    assert (tmp_path / "run" / "faults.txt").read_text() == "run, mutation 0: was wrong\n"
    capfd.readouterr()


def test_the_fuzz_campaign_runs_20_mutations_without_faults(tmp_path, monkeypatch):
    assert campaign.run_python("run", 60, 20, tmp_path, 5) == (20, [])
