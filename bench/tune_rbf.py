"""How Q-learning with the RBF network was tuned on the noise-free acrobot with 4 inputs.

python bench/tune_rbf.py [stage ...], all stages without names; trials go to the store
docs/benchmarks.sqlite.xz, and what is there is not run again. Trials of 15,000 learning episodes.

The criterion was fixed before any trial of this file was run: a trial's score is the mean of two
shares of solved test episodes, EARLY and END, and a setting's is the median over its trials. The
settings of all stages but the last are compared on the seeds 100 to 103. The best of "grid" is
chosen; "fine", "ties" and "bases" show how much it matters to move away from it. What is reported
of it and of the setting before (stage "report") comes from ten other seeds.

The learning rate alpha is not varied: it only ever multiplies the gradient rate.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from measured import DOCS, Trials, Work, measure_missing, measured
from page import markdown

from sdnn.agents import QLearningConfig
from sdnn.approximators import RBFNetworkConfig
from sdnn.runs import AgentSpec, BudgetSpec, ProtocolSpec, RunSpec
from sdnn.runs.engine import trial_seed

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


@dataclass(frozen=True)
class Setting:
    """What is varied."""

    width: float
    gradient_rate: float
    tie_rule: str = "uniform"
    n_bases: int = 4


def stability_limit(setting: Setting) -> float:
    """The gradient rate from which a correction overshoots by more than the error it corrects.

    That is 2 / (alpha |phi|^2) where |phi|^2 is largest, at a corner of all 5 dimensions.
    """
    gaussians = np.exp(-0.5 * (np.arange(setting.n_bases) / setting.width) ** 2)
    squares = (gaussians**2).sum() / gaussians.sum() ** 2
    return float(2 / (QLearningConfig().learning_rate * squares**5))


GRID = [
    setting
    for width, rate in itertools.product((0.25, 0.35, 0.5, 0.7, 1.0), (1.0, 3.0, 10.0, 30.0, 100.0))
    if rate < stability_limit(setting := Setting(width, rate))
]
FINE_WIDTHS = (0.4, 0.45, 0.55, 0.6)
FINE_RATES = (2.0, 5.0)
BEFORE = Setting(1.0, 3.0)


def measure(work: Work) -> dict[str, Any]:
    """One trial."""
    setting, seed = setting_of(work), work[-1]
    spec = RunSpec(
        agent=AgentSpec(name="rbf"),
        approximator=RBFNetworkConfig(
            n_bases=setting.n_bases, width=setting.width, gradient_rate=setting.gradient_rate
        ),
        learning=QLearningConfig(tie_rule=setting.tie_rule),
        protocol=ProtocolSpec(evaluate_every_episodes=TEST_INTERVAL),
        budget=BudgetSpec(episodes=N_EPISODES),
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


def setting_of(work: Work) -> Setting:
    _, n_bases, width, gradient_rate, tie_rule, _ = work
    return Setting(float(width), float(gradient_rate), tie_rule, int(n_bases))


def work_of(stage: str, setting: Setting, seed: int) -> Work:
    numbers = setting.n_bases, setting.width, setting.gradient_rate
    return (stage, *map(str, numbers), setting.tie_rule, seed)


def medians(trials: Trials, stage: str) -> dict[Setting, dict[str, float]]:
    """Per setting the medians over trials, the best score first."""
    groups = defaultdict(list)
    for work, found in trials.items():
        if work[0] == stage:
            groups[setting_of(work)].append(found)
    found = {
        setting: {name: float(np.median([one[name] for one in of])) for name in (*WINDOWS, "score")}
        for setting, of in groups.items()
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]["score"]))


def chosen(trials: Trials) -> Setting:
    """The best of the grid; the paper's 4 bases."""
    return next(iter(medians(trials, "grid")))


def asked(stage: str, trials: Trials) -> list[Work]:
    if stage == "grid":
        settings, seeds = GRID, SEARCH_SEEDS
    elif stage == "fine":
        best = chosen(trials)
        settings = [Setting(width, best.gradient_rate) for width in FINE_WIDTHS]
        settings += [Setting(best.width, rate) for rate in FINE_RATES]
        seeds = SEARCH_SEEDS
    elif stage == "ties":
        best = chosen(trials)
        settings, seeds = (
            [Setting(best.width, best.gradient_rate, rule) for rule in ("lowest", "middle")],
            SEARCH_SEEDS,
        )
    elif stage == "bases":
        best = chosen(trials)
        settings, seeds = (
            [Setting(best.width, best.gradient_rate, n_bases=n) for n in (3, 5, 6, 8)],
            SEARCH_SEEDS,
        )
    elif stage == "report":
        settings, seeds = list(dict.fromkeys((BEFORE, chosen(trials)))), REPORT_SEEDS
    else:
        raise SystemExit(f"no stage {stage}: it is one of {', '.join(STAGES)}")
    return [work_of(stage, setting, seed) for setting in settings for seed in seeds]


def main(stages: list[str]) -> None:
    for stage in stages or STAGES:
        measure_missing(KIND, measure, asked(stage, measured(KIND, DOCS)), DOCS, 2)
        rows = [
            (
                *map(str, (setting.n_bases, setting.width, setting.gradient_rate)),
                setting.tie_rule,
                *(f"{100 * share:.1f} %" for share in of.values()),
            )
            for setting, of in medians(measured(KIND, DOCS), stage).items()
        ]
        print(markdown((f"{stage}: bases", "width", "rate", "ties", *WINDOWS, "score"), rows))


if __name__ == "__main__":
    main(sys.argv[1:])
