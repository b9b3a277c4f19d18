"""Run experiments and write what they gave: the body of ``sdnn reproduce``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sdnn.experiments import figures, report
from sdnn.experiments.cases import PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.experiments.config import ProtocolConfig
from sdnn.experiments.engine import Observer, RunOutcome, run_trials
from sdnn.experiments.plan import PlannedTrial, plan_trials
from sdnn.experiments.results import collect, summarize
from sdnn.experiments.store import STORE_NAME, ResultStore
from sdnn.experiments.trial import MakeTrial

QUICK_TRIALS = 2
QUICK_EPISODES = 300


@dataclass(frozen=True, kw_only=True)
class ReproduceRequest:
    """What to run and where to put it.

    Parameters
    ----------
    experiments
        Experiments to run.
    out
        Folder of the result file, figures and tables.
    n_trials
        Trials per case and agent; default the paper's, or `QUICK_TRIALS`.
    n_episodes
        Learning episodes per trial; default the paper's, or `QUICK_EPISODES`.
    seed
        Root of all seeds.
    jobs
        Trials at the same time; default one for each core.
    quick
        Whether this is a look at a fraction; its files are named and marked so.
    """

    experiments: tuple[Experiment, ...]
    out: Path
    n_trials: int | None = None
    n_episodes: int | None = None
    seed: int = 0
    jobs: int | None = None
    quick: bool = False

    def plan(self) -> tuple[PlannedTrial, ...]:
        """List the trials needed.

        Raises
        ------
        ValueError
            If the trials would be too short to hold a test episode.
        """
        n_trials = self.n_trials or (QUICK_TRIALS if self.quick else PAPER_TRIALS)
        n_episodes = self.n_episodes or (QUICK_EPISODES if self.quick else PAPER_EPISODES)
        protocol = ProtocolConfig(n_learning_episodes=n_episodes)
        if n_episodes < protocol.test_interval:
            raise ValueError(
                f"episodes must be at least {protocol.test_interval}, the distance of test"
                f" episodes, got {n_episodes}"
            )
        cases = [case for experiment in self.experiments for case in experiment.cases]
        return plan_trials(cases, n_trials, self.seed, protocol)


@dataclass(frozen=True)
class Reproduction:
    """What a run gave.

    Parameters
    ----------
    outcome
        What became of the trials.
    reports
        One for each experiment; empty unless every trial is there.
    files
        Files written; empty unless every trial is there.
    table
        Content of the JSON file; empty unless every trial is there.
    """

    outcome: RunOutcome
    reports: tuple[report.ExperimentReport, ...] = ()
    files: tuple[Path, ...] = ()
    table: dict[str, Any] | None = None


def count_stored(request: ReproduceRequest) -> dict[tuple[str, str], tuple[int, int]]:
    """Count planned and stored trials for each case and agent, without making any file."""
    stored = set()
    if (request.out / STORE_NAME).exists() or request.out.is_file():
        with ResultStore(request.out) as store:
            stored = store.keys()
    counts: dict[tuple[str, str], tuple[int, int]] = {}
    for planned in request.plan():
        pair = (planned.key.case_id, planned.key.agent)
        n_planned, n_stored = counts.get(pair, (0, 0))
        counts[pair] = (n_planned + 1, n_stored + (planned.key in stored))
    return counts


def reproduce(
    request: ReproduceRequest,
    make_trial: MakeTrial,
    *,
    version: str,
    observer: Observer | None = None,
) -> Reproduction:
    """Run the missing trials; when all are there, draw the figures and write the tables.

    Parameters
    ----------
    request
        What to run.
    make_trial
        Makes a trial from its configuration and seed.
    version
        Version of the library, stored with each trial.
    observer
        Told how the run goes.

    Raises
    ------
    PlotUnavailableError
        If matplotlib is not installed; no trial is run then.
    StoreError
        If the result file cannot be used.
    """
    figures.require_matplotlib()
    plan = request.plan()
    keys = [planned.key for planned in plan]
    suffix = "-quick" if request.quick else ""
    with ResultStore(request.out) as store:
        outcome = run_trials(
            plan, store, make_trial, version=version, jobs=request.jobs, observer=observer
        )
        if outcome.failures or outcome.interrupted:
            return Reproduction(outcome)
        reports: list[report.ExperimentReport] = []
        files: list[Path] = []
        for experiment in request.experiments:
            results = collect(experiment, keys, store)
            summaries = tuple(summarize(result) for result in results)
            reports.append(report.ExperimentReport(experiment, summaries))
            figure = figures.draw_experiment(experiment, results, quick=request.quick)
            files += figures.save_figure(
                figure, request.out / f"experiment-{experiment.id}{suffix}"
            )
        digest = store.content_digest(keys)
    table = report.to_json(reports, quick=request.quick)
    table |= {"seed": request.seed, "digest": digest, "version": version}
    footer = f"Root seed {request.seed}; digest of the rows {digest[:16]}; sdnn {version}."
    markdown = report.to_markdown(reports, quick=request.quick, footer=footer)
    for name, text in (
        (f"results{suffix}.md", markdown),
        (f"table{suffix}.json", json.dumps(table, indent=2, allow_nan=False) + "\n"),
    ):
        (request.out / name).write_text(text, encoding="utf-8")
        files.append(request.out / name)
    return Reproduction(outcome, tuple(reports), tuple(files), table)
