"""The fuzz campaign counts what it has executed and found; test_bad_values tries its mutations."""

import json
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "fuzz"))

import campaign


def test_a_second_fuzz_campaign_continues_with_numbers_and_counts_of_the_first(
    tmp_path, monkeypatch
):
    def failures(_make_cells, target, first, n_mutations):
        """Mutation 0 has a fault, others have none."""
        faults = [f"{target}, mutation 0: was wrong"] if first == 0 else []
        return n_mutations, faults

    monkeypatch.setattr(campaign, "failures", failures)
    arguments = ["campaign.py", "run", "--executions", "12", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", arguments)
    assert campaign.main() == 1, "mutations 0 to 11, with a fault"
    assert campaign.main() == 0, "mutations 12 to 23"
    (counts_of_commit,) = json.loads((tmp_path / "counts.json").read_text()).values()
    counts = counts_of_commit["run"]
    assert (counts["executions"], counts["faults"]) == (24, 1)
    assert (tmp_path / "run" / "faults.txt").read_text() == "run, mutation 0: was wrong\n"


def test_readers_of_run_files_have_no_fault_in_20_mutations(tmp_path):
    n_executions, faults = campaign.run_python(
        "run", seconds=60, executions=20, out=tmp_path, first=5
    )
    assert (n_executions, faults) == (20, [])
