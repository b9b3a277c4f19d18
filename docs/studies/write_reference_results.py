"""Write the measures of trials that were run into the reference results of the library.

    sdnn reproduce b --trials 100 --seed 1 --out results
    python docs/studies/write_reference_results.py --store results --trials 100 --seed 1

`sdnn reproduce` judges the paper's claims by these trials, too, where its ten leave one undecided.
Where a change gave configurations new hashes and left all rows as they are, ``--rekey`` writes the
new hashes and leaves the measures as they are.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from sdnn.reproduction import case_spec, plan_trials
from sdnn.reproduction.cases import PAPER_CASES, PAPER_EPISODES
from sdnn.reproduction.claims import FILE_NAME, HEADER, reference_results
from sdnn.runs import CaseResult, ResultStore, measure
from sdnn.runs.results import STEP_MEASURES
from sdnn.support.csv_files import csv_bytes

FILE = Path(__file__).parents[2] / "python" / "sdnn" / "reproduction" / FILE_NAME


def reference_csv(results: Iterable[CaseResult], root_seed: int) -> bytes:
    """Make the content of the file; a ValueError if trials have another length than the paper's."""
    rows = []
    for result in results:
        if result.last_episode != PAPER_EPISODES:
            raise ValueError(
                f"reference results have {PAPER_EPISODES} learning episodes, those of"
                f" {result.agent} in {result.case_id} have {result.last_episode}"
            )
        names = (result.case_id, result.agent, result.config_hash, root_seed)
        for number, record in enumerate(result.records):
            measures = (f"{result.values[name][number]:g}" for name in STEP_MEASURES)
            rows.append((*names, record.key.trial, record.rows.digest()[:16], *measures))
    return csv_bytes(HEADER, rows)


def rekey() -> None:
    """Replace the hashes of configurations."""
    text = FILE.read_text()
    for result in reference_results():
        new = case_spec(PAPER_CASES[result.case_id], result.agent).config_hash
        start = f"{result.case_id},{result.agent},"
        text = text.replace(f"{start}{result.config_hash},", f"{start}{new},")
    FILE.write_text(text)


def write(store_folder: Path, n_trials: int, seed: int) -> None:
    """Read the trials of a store and write their measures."""
    results = []
    with ResultStore(store_folder, read_only=True) as store:
        stored = store.keys()
        plan = plan_trials(PAPER_CASES.values(), n_trials, seed)
        for case in PAPER_CASES.values():
            for agent in case.agents:
                keys = [p.key for p in plan if p.key[:2] == (case.id, agent) and p.key in stored]
                if keys:
                    results.append(measure(case.title, store.load(keys)))
    FILE.write_bytes(reference_csv(results, seed))
    for result in results:
        print(f"{result.case_id} {result.agent}: {result.n_trials} trials")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--store", type=Path, default=Path("results"), help="folder of the store")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rekey", action="store_true", help="write hashes only")
    options = parser.parse_args()
    if options.rekey:
        rekey()
    else:
        write(options.store, options.trials, options.seed)
