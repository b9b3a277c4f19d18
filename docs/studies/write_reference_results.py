"""Write the measures of trials that were run into the reference results of the library.

    sdnn reproduce b --trials 100 --seed 1 --out results
    python docs/studies/write_reference_results.py --store results --trials 100 --seed 1

`sdnn reproduce` judges the paper's claims by these trials, too, where its ten leave one undecided.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from sdnn.reproduction import ProtocolConfig, ResultStore, measure, plan_trials
from sdnn.reproduction.cases import PAPER_CASES
from sdnn.reproduction.reference_results import FILE_NAME, reference_csv

FILE = Path(__file__).parents[2] / "python" / "sdnn" / "reproduction" / FILE_NAME


def main() -> None:
    """Read the trials and write their measures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--store", type=Path, default=Path("results"), help="folder of the store")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    results = []
    with ResultStore(options.store, read_only=True) as store:
        stored = store.keys()
        plan = plan_trials(PAPER_CASES.values(), options.trials, options.seed, ProtocolConfig())
        for case in PAPER_CASES.values():
            for agent in case.agents:
                keys = [p.key for p in plan if p.key[:2] == (case.id, agent) and p.key in stored]
                if keys:
                    results.append(measure(case.title, store.load(keys)))
    FILE.write_bytes(reference_csv(results, options.seed))
    for result in results:
        print(f"{result.case_id} {result.agent}: {result.n_trials} trials")


if __name__ == "__main__":
    main()
