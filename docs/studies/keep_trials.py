"""Put the measures of trials that were run into the file that is kept with the library.

    sdnn reproduce b --trials 100 --seed 1 --out results
    python docs/studies/keep_trials.py --kept results --trials 100 --seed 1

`sdnn reproduce` judges the paper's claims by these trials, too, where its ten leave one undecided.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from sdnn.reproduction import (
    EXPERIMENTS,
    CaseResult,
    ProtocolConfig,
    ResultStore,
    plan_trials,
    summarize,
)
from sdnn.reproduction.kept_trials import FILE_NAME, kept_csv

KEPT = Path(__file__).parents[2] / "python" / "sdnn" / "reproduction" / FILE_NAME


def main() -> None:
    """Read the trials and write their measures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--kept", type=Path, default=Path("results"), help="folder of the store")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    cases = {case.id: case for experiment in EXPERIMENTS for case in experiment.cases}.values()
    summaries = []
    with ResultStore(options.kept, read_only=True) as store:
        stored = store.keys()
        plan = plan_trials(cases, options.trials, options.seed, ProtocolConfig())
        for case in cases:
            for agent in case.agents:
                keys = [p.key for p in plan if p.key[:2] == (case.id, agent) and p.key in stored]
                if keys:
                    result = CaseResult(case, agent, store.load(keys))
                    summaries.append(summarize(result))
    KEPT.write_bytes(kept_csv(summaries, options.seed))
    for summary in summaries:
        print(f"{summary.case_id} {summary.agent}: {summary.n_trials} trials")


if __name__ == "__main__":
    main()
