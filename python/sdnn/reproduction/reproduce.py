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
from sdnn.reproduction.cases import (
    EXPERIMENTS,
    MOST_EPISODES,
    PAPER_EPISODES,
    PAPER_TRIALS,
    Experiment,
)
from sdnn.reproduction.cost import QUICK_COST, CostConfig, cost_keys, measure_costs
from sdnn.reproduction.figures import draw_cost, draw_experiment
from sdnn.reproduction.plan import plan_trials
from sdnn.reproduction.reference_results import reference_results
from sdnn.reproduction.report import ExperimentReport, Report
from sdnn.runs.engine import Observer, RunOutcome, run_trials
from sdnn.runs.executor import Executor
from sdnn.runs.figures import figure_bytes, require_matplotlib
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
from sdnn.runs.report import Call, require_jinja
from sdnn.runs.results import CaseResult, measure
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
    require_matplotlib()
    require_jinja()
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
    call = Call(
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
    experiments = tuple(ExperimentReport(e, collect(e, records)) for e, _ in complete)
    n_run = {
        (r.case_id, r.agent, r.config_hash): r.n_trials for one in experiments for r in one.results
    }
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
        reference=tuple(
            one
            for one in reference_results()
            if one.n_trials > n_run.get((one.case_id, one.agent, one.config_hash), math.inf)
        ),
    )
    return report, records


def collect(experiment: Experiment, records: Iterable[TrialRecord]) -> tuple[CaseResult, ...]:
    """Measure the trials of each case and agent of an experiment.

    Parameters
    ----------
    experiment
        Its cases and agents.
    records
        Trials of the plan, in the order in which they are to be shown; those of other experiments
        are passed over.
    """
    by_pair: dict[tuple[str, str], list[TrialRecord]] = {}
    for record in records:
        by_pair.setdefault((record.key.case_id, record.key.agent), []).append(record)
    return tuple(
        measure(case.title, by_pair.get((case.id, agent), ()))
        for case in experiment.cases
        for agent in case.agents
    )


def _write(
    request: ReproduceRequest, report: Report, records: tuple[TrialRecord, ...], call: Call
) -> tuple[tuple[Path, ...], dict[str, Any]]:
    """Draw and write everything; returns the files and the content of the JSON file."""
    drawn = {
        f"experiment-{one.experiment.id}": draw_experiment(
            one.experiment, one.results, quick=request.quick
        )
        for one in report.experiments
    }
    if report.costs:
        drawn["cost"] = draw_cost(report.costs, quick=request.quick)
    contents: dict[str, bytes] = {}
    for name, figure in drawn.items():
        contents[f"{name}.png"], contents[f"{name}.svg"] = figure_bytes(figure)
    pictures = {name: contents[f"{name}.svg"] for name in drawn}
    table = report.to_json()
    contents["results.md"] = report.to_markdown().encode()
    contents["table.json"] = (json.dumps(table, indent=2, allow_nan=False) + "\n").encode()
    contents["results.csv"] = csv_bytes(ROW_HEADER, trial_rows(records))
    if report.costs:
        contents["cost.csv"] = csv_bytes(COST_ROW_HEADER, round_rows(report.costs))
    contents["report.html"] = report.to_html(pictures, call).encode()
    files = {request.out / request.file_name(name): text for name, text in contents.items()}
    for path, content in files.items():
        write_whole(path, content)
    return tuple(files), table
