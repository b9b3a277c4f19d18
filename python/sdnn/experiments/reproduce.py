"""Run experiments and write what they gave: the body of ``sdnn reproduce``."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sdnn.experiments import cost_figure, figures, page, report
from sdnn.experiments.cases import EXPERIMENTS, PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.experiments.config import ProtocolConfig
from sdnn.experiments.cost import (
    QUICK_COST,
    CostConfig,
    CostKey,
    MeasureSteps,
    cost_keys,
    measure_costs,
)
from sdnn.experiments.engine import Observer, RunOutcome, run_trials
from sdnn.experiments.plan import PlannedTrial, plan_trials
from sdnn.experiments.records import TrialKey, TrialRecord
from sdnn.experiments.results import collect, summarize
from sdnn.experiments.store import STORE_NAME, ResultStore
from sdnn.experiments.trial import MakeTrial
from sdnn.whole_files import csv_bytes, remove_partial_files, write_whole

QUICK_TRIALS = 2
QUICK_EPISODES = 300


@dataclass(frozen=True, kw_only=True)
class ReproduceRequest:
    """What to run and where to put it.

    Parameters
    ----------
    experiments
        Experiments to run.
    cost
        Whether to measure costs too.
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
    cost: bool = False
    out: Path
    n_trials: int | None = None
    n_episodes: int | None = None
    seed: int = 0
    jobs: int | None = None
    quick: bool = False

    def protocol(self) -> ProtocolConfig:
        """How long a trial is.

        Raises
        ------
        ValueError
            If the trials would be too short to hold a test episode.
        """
        n_episodes = self.n_episodes or (QUICK_EPISODES if self.quick else PAPER_EPISODES)
        protocol = ProtocolConfig(n_learning_episodes=n_episodes)
        if n_episodes < protocol.test_interval:
            raise ValueError(
                f"episodes must be at least {protocol.test_interval}, the distance of test"
                f" episodes, got {n_episodes}"
            )
        return protocol

    def plan(self) -> tuple[PlannedTrial, ...]:
        """List the trials needed.

        Raises
        ------
        ValueError
            If the trials would be too short to hold a test episode.
        """
        return self.plan_of(self.experiments)

    def plan_of(self, experiments: tuple[Experiment, ...]) -> tuple[PlannedTrial, ...]:
        """List the trials that other experiments would need under the same settings."""
        n_trials = self.n_trials or (QUICK_TRIALS if self.quick else PAPER_TRIALS)
        cases = [case for experiment in experiments for case in experiment.cases]
        return plan_trials(cases, n_trials, self.seed, self.protocol())

    @property
    def cost_config(self) -> CostConfig:
        """How thoroughly costs are measured."""
        return QUICK_COST if self.quick else CostConfig()


@dataclass(frozen=True)
class Reproduction:
    """What a run gave.

    Parameters
    ----------
    outcome
        What became of the trials.
    report
        The results; none unless every trial is there.
    files
        Files written; empty unless every trial is there.
    table
        Content of the JSON file; empty unless every trial is there.
    """

    outcome: RunOutcome
    report: report.Report | None = None
    files: tuple[Path, ...] = ()
    table: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class StoredCounts:
    """How much a request needs and how much of it is stored: pairs (planned, stored).

    Parameters
    ----------
    trials
        Of each case and agent.
    costs
        Of measurements of costs.
    """

    trials: dict[tuple[str, str], tuple[int, int]]
    costs: tuple[int, int]


def count_stored(request: ReproduceRequest) -> StoredCounts:
    """Count what is planned and what of it is stored, without making any file."""
    trial_keys: set[TrialKey] = set()
    known_costs: set[CostKey] = set()
    if (request.out / STORE_NAME).exists() or request.out.is_file():
        with ResultStore(request.out) as store:
            trial_keys = store.keys()
            found = store.load_costs(request.cost_config.config_hash)
            known_costs = {record.key for record in found}
    trials: dict[tuple[str, str], tuple[int, int]] = {}
    for planned in request.plan():
        pair = (planned.key.case_id, planned.key.agent)
        n_planned, n_stored = trials.get(pair, (0, 0))
        trials[pair] = (n_planned + 1, n_stored + (planned.key in trial_keys))
    wanted = set(cost_keys(request.cost_config)) if request.cost else set()
    return StoredCounts(trials=trials, costs=(len(wanted), len(wanted & known_costs)))


def reproduce(
    request: ReproduceRequest,
    make_trial: MakeTrial,
    measure_steps: MeasureSteps,
    *,
    version: str,
    machine: str,
    observer: Observer | None = None,
) -> Reproduction:
    """Run what is missing; when all is there, draw the figures and write tables and page.

    The files cover every experiment whose trials are all stored under the request's settings, not
    only those that were asked for now.

    Parameters
    ----------
    request
        What to run.
    make_trial
        Makes a trial from its configuration and seed.
    measure_steps
        Measures the time of an agent's steps.
    version
        Version of the library, stored with each trial.
    machine
        Processor and instruction set, stored with costs and written on the page.
    observer
        Told how the run goes.

    Raises
    ------
    PlotUnavailableError
        If matplotlib or Jinja is not installed; no trial is run then.
    StoreError
        If the result file cannot be used.
    """
    figures.require_matplotlib()
    page.require_jinja()
    begin = time.monotonic()
    watcher = Observer() if observer is None else observer
    with ResultStore(request.out) as store:
        remove_partial_files(request.out)
        outcome = run_trials(
            request.plan(), store, make_trial, version=version, jobs=request.jobs, observer=watcher
        )
        if outcome.failures or outcome.interrupted:
            return Reproduction(outcome)
        if request.cost:
            measure_costs(
                request.cost_config, store, measure_steps,
                version=version, machine=machine, observer=watcher,
            )  # fmt: skip
        results, records = _results(request, store, version)
    call = page.Call(
        machine=machine,
        seconds=time.monotonic() - begin,
        n_run=outcome.n_run,
        n_planned=outcome.n_planned,
        processor_seconds=sum(record.seconds for record in records),
    )
    return Reproduction(outcome, results, *_write(request, results, records, call))


def _results(
    request: ReproduceRequest, store: ResultStore, version: str
) -> tuple[report.Report, tuple[TrialRecord, ...]]:
    """Read everything that is complete under the request's settings, and the trials it is from."""
    stored = store.keys()
    reports: list[report.ExperimentReport] = []
    keys: list[TrialKey] = []
    for experiment in EXPERIMENTS:
        wanted = [planned.key for planned in request.plan_of((experiment,))]
        if stored.issuperset(wanted):
            summaries = tuple(summarize(r) for r in collect(experiment, wanted, store))
            reports.append(report.ExperimentReport(experiment, summaries))
            keys += wanted
    results = report.Report(
        experiments=tuple(reports),
        costs=store.load_costs(request.cost_config.config_hash),
        quick=request.quick,
        seed=request.seed,
        version=version,
        digest=store.content_digest(keys),
    )
    return results, store.load(keys)


def _write(
    request: ReproduceRequest,
    results: report.Report,
    records: tuple[TrialRecord, ...],
    call: page.Call,
) -> tuple[tuple[Path, ...], dict[str, Any]]:
    """Draw and write everything; returns the files and the content of the JSON file."""
    suffix = "-quick" if request.quick else ""
    files: list[Path] = []
    pictures: dict[str, bytes] = {}

    def write(name: str, content: bytes) -> None:
        stem, _, kind = name.rpartition(".")
        path = request.out / f"{stem}{suffix}.{kind}"
        write_whole(path, content)
        files.append(path)

    drawn = {
        f"experiment-{one.experiment.id}": figures.draw_experiment(
            one.experiment, [summary.result for summary in one.summaries], quick=request.quick
        )
        for one in results.experiments
    }
    if results.costs:
        drawn["cost"] = cost_figure.draw_cost(results.costs, quick=request.quick)
    for name, figure in drawn.items():
        png, pictures[name] = figures.figure_bytes(figure)
        write(f"{name}.png", png)
        write(f"{name}.svg", pictures[name])
    table = report.to_json(results)
    write("results.md", report.to_markdown(results).encode())
    write("table.json", (json.dumps(table, indent=2, allow_nan=False) + "\n").encode())
    write("results.csv", csv_bytes(report.ROW_HEADER, report.trial_rows(records)))
    if results.costs:
        write("cost.csv", csv_bytes(report.COST_ROW_HEADER, report.round_rows(results.costs)))
    write("report.html", page.to_html(results, pictures, call).encode())
    return tuple(files), table
