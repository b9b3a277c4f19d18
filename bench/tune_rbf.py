"""How Q-learning with the RBF network was tuned on the noise-free acrobot with 4 inputs.

    python bench/tune_rbf.py [--only WORD] [--jobs 2] [--redraw]

Runs the trials of 15,000 learning episodes that the store lacks and prints a table for each stage,
which docs/evidence/assumptions.md quotes.

The criterion was fixed before any trial of this file was run: a trial's score is the mean of two
shares of solved test episodes, EARLY and END, and a setting's is the median over its trials. The
settings of all stages but the last are compared on the seeds 100 to 103. The best of "grid" is
chosen; "fine", "ties" and "bases" show how much it matters to move away from it. What is reported
of it and of the setting before (stage "report") comes from ten other seeds.

The learning rate alpha is not varied: it only ever multiplies the gradient rate.
"""

from __future__ import annotations

import itertools
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from measured import grouped, measure_missing, options
from page import markdown

from sdnn.agents import QLearningConfig
from sdnn.approximators import RBFNetworkConfig
from sdnn.reproduction import paper_spec
from sdnn.runs.trial import trial_seed

KIND = "rbf tuning"
STAGES = ("grid", "fine", "ties", "bases", "report")
N_EPISODES = 15_000
TEST_INTERVAL = 10
EARLY = (1_000, 3_000)
"""Test episodes after these learning episodes, the first one excluded, the last one included."""
END = (14_000, 15_000)
WINDOWS = {
    "first": (0, 1_000),
    "early": EARLY,
    "middle": (3_000, 8_000),
    "late": (8_000, 14_000),
    "end": END,
}
SEARCH_SEEDS = (100, 101, 102, 103)
REPORT_SEEDS = tuple(trial_seed(0, "rbf-4", number) for number in range(10))


class Setting(NamedTuple):
    """The settings that are varied."""

    n_bases: int = 4
    width: float = 0.5
    gradient_rate: float = 3.0
    tie_rule: str = "uniform"


def stability_limit(setting: Setting) -> float:
    """Return the gradient rate from which a correction overshoots by more than its error.

    That is 2 / (alpha |phi|^2) where |phi|^2 is largest, at a corner of all 5 dimensions.
    """
    gaussians = np.exp(-0.5 * (np.arange(setting.n_bases) / setting.width) ** 2)
    squares = (gaussians**2).sum() / gaussians.sum() ** 2
    return float(2 / (QLearningConfig().learning_rate * squares**5))


GRID = [
    setting
    for width, rate in itertools.product((0.25, 0.35, 0.5, 0.7, 1.0), (1.0, 3.0, 10.0, 30.0, 100.0))
    if rate < stability_limit(setting := Setting(4, width, rate))
]
BEFORE = Setting(4, 1.0, 3.0)


def settings_of(stage: str, best: Setting) -> list[Setting]:
    """List what a stage compares; ``best`` is the best of the grid, of the paper's 4 bases."""
    if stage == "grid":
        return GRID
    if stage == "fine":
        widths = [best._replace(width=width) for width in (0.4, 0.45, 0.55, 0.6)]
        return [*widths, *(best._replace(gradient_rate=rate) for rate in (2.0, 5.0))]
    if stage == "ties":
        return [best._replace(tie_rule=rule) for rule in ("lowest", "middle")]
    if stage == "bases":
        return [best._replace(n_bases=n) for n in (3, 5, 6, 8)]
    return [BEFORE, best]


def measure(stage: str, *key: Any) -> dict[str, Any]:
    """Run a trial."""
    *values, seed = key
    setting = Setting(*values)
    spec = paper_spec(
        agent="rbf",
        approximator=RBFNetworkConfig(
            n_bases=setting.n_bases, width=setting.width, gradient_rate=setting.gradient_rate
        ),
        learning=QLearningConfig(tie_rule=setting.tie_rule),
        protocol={"evaluate_every_episodes": TEST_INTERVAL},
        budget={"episodes": N_EPISODES},
    )
    trial = spec.make_trial(seed)
    start = time.thread_time()
    diverged = False
    try:
        trial.advance(N_EPISODES)
    except OverflowError:
        diverged = True
    tests = trial.test_rows()
    shares = {}
    # Tests that a diverged trial did not reach count as not solved.
    for name, (after, last) in WINDOWS.items():
        solved = tests["solved"][(tests["episode"] > after) & (tests["episode"] <= last)]
        shares[name] = round(int(solved.sum()) / ((last - after) // TEST_INTERVAL), 4)
    return {
        **shares,
        "score": round((shares["early"] + shares["end"]) / 2, 4),
        "diverged": int(diverged),
        "decisions": trial.n_decisions,
        "seconds": round(time.thread_time() - start, 1),
    }


def medians(folder: Path, stage: str) -> dict[Setting, dict[str, float]]:
    """Return the medians over trials of each setting, the best score first."""
    names = (*WINDOWS, "score")
    middles = {
        Setting(*values): {name: float(np.median([row[name] for row in rows])) for name in names}
        for (stage_of_rows, *values), rows in grouped(KIND, folder).items()
        if stage_of_rows == stage
    }
    return dict(sorted(middles.items(), key=lambda item: -item[1]["score"]))


def main() -> None:
    arguments = options(__doc__ or "", seeds=len(SEARCH_SEEDS), jobs=2).parse_args()
    for stage in STAGES:
        grid = medians(arguments.folder, "grid")
        seeds = REPORT_SEEDS if stage == "report" else SEARCH_SEEDS[: arguments.seeds]
        best = next(iter(grid), BEFORE)
        keys = [(stage, *setting, seed) for setting in settings_of(stage, best) for seed in seeds]
        measure_missing(KIND, measure, keys, arguments, apart=True)
        rows = [
            (*map(str, setting), *(f"{100 * share:.1f} %" for share in of.values()))
            for setting, of in medians(arguments.folder, stage).items()
        ]
        print(markdown((f"{stage}: bases", "width", "rate", "ties", *WINDOWS, "score"), rows))


if __name__ == "__main__":
    main()
