"""Run experiments and write what they gave: the body of ``sdnn reproduce``."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from sdnn import _core, machine
from sdnn.reproduction import figures, page
from sdnn.reproduction.cases import (
    EXPERIMENTS,
    MOST_EPISODES,
    PAPER_EPISODES,
    PAPER_TRIALS,
    Experiment,
)
from sdnn.reproduction.cost import QUICK_COST, CostConfig, cost_keys, measure_costs
from sdnn.reproduction.kept_trials import KeptTrials, kept_trials
from sdnn.reproduction.plan import plan_trials
from sdnn.reproduction.report import ExperimentReport, Report, to_json
from sdnn.reproduction.results import CaseSummary, collect, summarize
from sdnn.runs.engine import Observer, RunOutcome, run_trials
from sdnn.runs.executor import Executor
from sdnn.runs.records import (
    COST_ROW_HEADER,
    ROW_HEADER,
    CostKey,
    TrialKey,
    TrialRecord,
    records_digest,
    round_rows,
    trial_rows,
)
from sdnn.runs.registry import cost_series
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial import ProtocolConfig
from sdnn.runs.trial_config import PlannedTrial
from sdnn.whole_files import csv_bytes, remove_abandoned_files, write_whole

QUICK_TRIALS = 2
QUICK_EPISODES = 300


@dataclass(frozen=True)
class Plan:
    """What a request needs, and what its report may show.

    Parameters
    ----------
    trials
        Trials to run, in this order.
    costs
        Costs to measure, in this order.
    experiments
        Every experiment under the request's settings with the keys of its trials: the report shows
        those whose trials are all there, asked for or not.
    """

    trials: tuple[PlannedTrial, ...]
    costs: tuple[CostKey, ...]
    experiments: tuple[tuple[Experiment, tuple[TrialKey, ...]], ...]


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
        Trials per case and agent; default the paper's, or `QUICK_TRIALS`. Files of others are named
        so.
    n_episodes
        The same of learning episodes per trial; default the paper's, or `QUICK_EPISODES`.
    seed
        Root of all seeds; files of another than 0 are named so.
    jobs
        Trials at the same time; default one for each core.
    executor
        Where trials run; default threads of this process. Costs are always measured here.
    quick
        Whether this is a look at a fraction; its files are named and marked so.
    agents
        Ids of the agents to run in every case instead of the case's own; files are named so.
    presets
        Names of settings under which SDNN-C runs beside the agents of every case; files are named
        so.
    """

    experiments: tuple[Experiment, ...]
    cost: bool = False
    out: Path
    n_trials: int | None = None
    n_episodes: int | None = None
    seed: int = 0
    jobs: int | None = None
    executor: Executor | None = None
    quick: bool = False
    agents: tuple[str, ...] = ()
    presets: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "agents", tuple(dict.fromkeys(self.agents)))
        object.__setattr__(self, "presets", tuple(dict.fromkeys(self.presets)))

    @cached_property
    def protocol(self) -> ProtocolConfig:
        """How long a trial is.

        Raises
        ------
        ValueError
            If the trials would be too short to hold a test episode, or have more than
            `MOST_EPISODES`.
        """
        n_episodes = self.n_episodes or self._default_episodes
        protocol = ProtocolConfig(n_learning_episodes=n_episodes)
        if n_episodes < protocol.test_interval:
            raise ValueError(
                f"episodes must be at least {protocol.test_interval}, the distance of test"
                f" episodes, got {n_episodes}"
            )
        if n_episodes > MOST_EPISODES:
            raise ValueError(f"episodes must be at most {MOST_EPISODES}, got {n_episodes}")
        return protocol

    @cached_property
    def plan(self) -> Plan:
        """What is needed: made when first asked for, and once.

        Raises
        ------
        ValueError
            If the trials are too short or too long (see `protocol`), no agent has one of the ids,
            or only costs are asked for, of agents that have none.
        """
        n_trials = self.n_trials or self._default_trials
        by_id = {experiment.id: experiment for experiment in (*EXPERIMENTS, *self.experiments)}
        known = [
            experiment.with_agents(self.agents).with_presets(self.presets)
            for experiment in by_id.values()
        ]
        cases = [case for experiment in known for case in experiment.cases]
        planned = plan_trials(cases, n_trials, self.seed, self.protocol)
        asked = {experiment.id for experiment in self.experiments}
        wanted = {pair for e in known if e.id in asked for pair in e.pairs}
        costs = cost_keys(self.cost_config, self.agents or None) if self.cost else ()
        if self.cost and not (wanted or costs):
            measured = dict.fromkeys(entry.id for entry, _ in cost_series())
            raise ValueError(
                f"agents whose cost is measured are {', '.join(measured)},"
                f" got {', '.join(self.agents)}"
            )
        return Plan(
            trials=tuple(p for p in planned if p.key[:2] in wanted),
            costs=costs,
            experiments=tuple(
                (e, tuple(p.key for p in planned if p.key[:2] in e.pairs)) for e in known
            ),
        )

    @property
    def cost_config(self) -> CostConfig:
        """How thoroughly costs are measured."""
        return QUICK_COST if self.quick else CostConfig()

    def file_name(self, name: str) -> str:
        """Name of a file of this request, such as ``table-rbf-3-trials-quick.json``.

        Requests that give other results have other names.
        """
        stem, _, kind = name.rpartition(".")
        marks = list(self.agents)
        if self.agents and self.presets:
            marks.append("with")  # sdnn-c with robust is not the agent sdnn-c-robust
        marks += self.presets
        for word, given, default in (
            ("trials", self.n_trials, self._default_trials),
            ("episodes", self.n_episodes, self._default_episodes),
        ):
            if given and given != default:
                marks.append(f"{given}-{word}")
        if self.seed:
            marks.append(f"seed-{self.seed}")
        if self.quick:
            marks.append("quick")
        return "-".join([stem, *marks]) + f".{kind}"

    @property
    def _default_trials(self) -> int:
        return QUICK_TRIALS if self.quick else PAPER_TRIALS

    @property
    def _default_episodes(self) -> int:
        return QUICK_EPISODES if self.quick else PAPER_EPISODES


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
    report: Report | None = None
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
        with ResultStore(request.out, read_only=True) as store:
            trial_keys = store.keys()
            found = store.load_costs(request.cost_config.config_hash)
            known_costs = {record.key for record in found}
    trials: dict[tuple[str, str], tuple[int, int]] = {}
    for planned in request.plan.trials:
        pair = (planned.key.case_id, planned.key.agent)
        n_planned, n_stored = trials.get(pair, (0, 0))
        trials[pair] = (n_planned + 1, n_stored + (planned.key in trial_keys))
    wanted = set(request.plan.costs)
    return StoredCounts(trials=trials, costs=(len(wanted), len(wanted & known_costs)))


def reproduce(request: ReproduceRequest, *, observer: Observer | None = None) -> Reproduction:
    """Run what is missing; when all is there, draw the figures and write tables and page.

    The files cover every experiment whose trials are all stored under the request's settings, not
    only those that were asked for now.

    Parameters
    ----------
    request
        What to run.
    observer
        Told how the run goes.

    Raises
    ------
    ValueError
        If nothing can be run as the request says.
    PlotUnavailableError
        If matplotlib or Jinja is not installed; no trial is run then.
    StoreError
        If the result file cannot be used.
    ClusterError
        If the cluster cannot run trials any more; what was finished is stored.
    """
    figures.require_matplotlib()
    page.require_jinja()
    begin = time.monotonic()
    watcher = Observer() if observer is None else observer
    plan = request.plan
    with ResultStore(request.out) as store:
        remove_abandoned_files(request.out)
        outcome = run_trials(
            plan.trials, store, executor=request.executor, jobs=request.jobs, observer=watcher
        )
        if outcome.failures or outcome.interrupted:
            return Reproduction(outcome)
        measure_costs(plan.costs, request.cost_config, store, watcher)
        report, records = _read(request, store)
    call = page.Call(
        machine=machine.description(),
        seconds=time.monotonic() - begin,
        n_run=outcome.n_run,
        n_planned=outcome.n_planned,
        processor_seconds=sum(record.seconds for record in records),
    )
    return Reproduction(outcome, report, *_write(request, report, records, call))


def _read(request: ReproduceRequest, store: ResultStore) -> tuple[Report, tuple[TrialRecord, ...]]:
    """Read everything that is complete under the request's settings, and the trials it is from."""
    stored = store.keys()
    complete = [(e, keys) for e, keys in request.plan.experiments if stored.issuperset(keys)]
    records = store.load(key for _, keys in complete for key in keys)
    shown = {series.id for _, series in cost_series(request.agents or None)}
    experiments = tuple(
        ExperimentReport(experiment, tuple(map(summarize, collect(experiment, records))))
        for experiment, _ in complete
    )
    report = Report(
        experiments=experiments,
        costs=tuple(
            cost
            for cost in store.load_costs(request.cost_config.config_hash)
            if cost.key.series in shown
        ),
        quick=request.quick,
        seed=request.seed,
        version=_core.__version__,
        digest=records_digest(records),
        agents=request.agents,
        kept=_more_than(s for one in experiments for s in one.summaries),
    )
    return report, records


def _more_than(summaries: Iterable[CaseSummary]) -> tuple[KeptTrials, ...]:
    """Give the kept trials that are of these settings and more."""
    n_run = {(s.case_id, s.agent, s.result.config_hash): s.n_trials for s in summaries}
    return tuple(
        kept
        for kept in kept_trials()
        if kept.n_trials > n_run.get((kept.case_id, kept.agent, kept.config_hash), math.inf)
    )


def _write(
    request: ReproduceRequest,
    report: Report,
    records: tuple[TrialRecord, ...],
    call: page.Call,
) -> tuple[tuple[Path, ...], dict[str, Any]]:
    """Draw and write everything; returns the files and the content of the JSON file."""
    files: list[Path] = []
    pictures: dict[str, bytes] = {}

    def write(name: str, content: bytes) -> None:
        path = request.out / request.file_name(name)
        write_whole(path, content)
        files.append(path)

    drawn = {
        f"experiment-{one.experiment.id}": figures.draw_experiment(
            one.experiment, [summary.result for summary in one.summaries], quick=request.quick
        )
        for one in report.experiments
    }
    if report.costs:
        drawn["cost"] = figures.draw_cost(report.costs, quick=request.quick)
    for name, figure in drawn.items():
        png, pictures[name] = figures.figure_bytes(figure)
        write(f"{name}.png", png)
        write(f"{name}.svg", pictures[name])
    table = to_json(report)
    write("results.md", page.to_markdown(report).encode())
    write("table.json", (json.dumps(table, indent=2, allow_nan=False) + "\n").encode())
    write("results.csv", csv_bytes(ROW_HEADER, trial_rows(records)))
    if report.costs:
        write("cost.csv", csv_bytes(COST_ROW_HEADER, round_rows(report.costs)))
    write("report.html", page.to_html(report, pictures, call).encode())
    return tuple(files), table
