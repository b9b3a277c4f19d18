"""Run experiments and write their results: the body of ``sdnn reproduce``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from sdnn.arguments import one_of, whole
from sdnn.config import SensorConfig
from sdnn.files import csv_bytes, remove_abandoned_files
from sdnn.reproduction import cost
from sdnn.reproduction.cases import (
    EXPERIMENTS,
    MOST_EPISODES,
    PAPER_EPISODES,
    PAPER_TRIALS,
    Case,
    Experiment,
)
from sdnn.reproduction.claims import reference_results
from sdnn.reproduction.cost import CostConfig, CostKey, CostRecord
from sdnn.reproduction.figures import draw_cost, draw_experiment
from sdnn.reproduction.report import Report
from sdnn.runs.engine import Executor, Observer, PlannedTrial, ThreadExecutor, plan_of, run_trials
from sdnn.runs.figures import figure_bytes
from sdnn.runs.registry import split_label
from sdnn.runs.report import WrittenReport, describe_call, require_matplotlib
from sdnn.runs.results import CaseResult, measure
from sdnn.runs.settings import AgentSpec, BudgetSpec
from sdnn.runs.spec import PAPER_INTERVAL, RunSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial import ROW_HEADER, TrialKey, TrialRecord, records_digest, trial_rows

QUICK_TRIALS = 2
QUICK_EPISODES = 300


@dataclass(frozen=True)
class Plan:
    """Trials that a request needs, in order, and those that its report may show."""

    trials: tuple[PlannedTrial, ...]
    costs: tuple[CostKey, ...]
    # All of them: those are shown whose trials are all stored, asked for or not.
    experiments: tuple[tuple[Experiment, tuple[TrialKey, ...]], ...]


@dataclass(frozen=True, kw_only=True)
class ReproduceRequest:
    """Selection of what to run, and the folder for the results.

    Files of other agents, presets, trials, episodes or seeds than the default have these in their
    names, and those of a quick look are marked so. Costs are always measured in this process.
    """

    experiments: tuple[Experiment, ...]
    cost: bool = False  # whether to measure costs too
    out: Path  # folder of the result file, figures and tables
    n_trials: int | None = None  # per case and agent; default the paper's, or `QUICK_TRIALS`
    n_episodes: int | None = None  # per trial; default the paper's, or `QUICK_EPISODES`
    seed: int = 0  # root of all seeds
    executor: Executor = field(default_factory=ThreadExecutor)
    quick: bool = False  # whether only a fraction is run
    agents: tuple[str, ...] = ()  # to run in every case instead of the case's own
    presets: tuple[str, ...] = ()  # under which SDNN-C runs beside the agents of every case

    def __post_init__(self) -> None:
        object.__setattr__(self, "agents", tuple(dict.fromkeys(self.agents)))
        object.__setattr__(self, "presets", tuple(dict.fromkeys(self.presets)))

    @property
    def _defaults(self) -> tuple[int, int]:
        """Numbers of trials and episodes."""
        quick, paper = (QUICK_TRIALS, QUICK_EPISODES), (PAPER_TRIALS, PAPER_EPISODES)
        return quick if self.quick else paper

    @cached_property
    def episodes(self) -> int:
        """Learning episodes of a trial, of which a test needs at least ten; else a ValueError."""
        n_episodes = self.n_episodes or self._defaults[1]
        return whole("episodes", n_episodes, PAPER_INTERVAL, MOST_EPISODES)

    @cached_property
    def plan(self) -> Plan:
        """The plan of the request, made at the first use.

        Raises ValueError if the trials are too short or too long, no agent has one of the ids, or
        only costs are asked for, of agents that have none.
        """
        by_id = {experiment.id: experiment for experiment in (*EXPERIMENTS, *self.experiments)}
        known = [one.with_agents(self.agents, self.presets) for one in by_id.values()]
        planned = plan_trials(
            [case for experiment in known for case in experiment.cases],
            self.n_trials or self._defaults[0],
            self.seed,
            self.episodes,
        )
        asked = {experiment.id for experiment in self.experiments}
        wanted = {pair for e in known if e.id in asked for pair in e.pairs}
        costs = cost.cost_keys(self.cost_config, self.agents or None) if self.cost else ()
        if self.cost and not (wanted or costs):
            measured = dict.fromkeys(series.agent for series in cost.SERIES)
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
    def groups(self) -> dict[tuple[str, str], list[PlannedTrial]]:
        """The trials of each agent in each case, by their ids."""
        groups: dict[tuple[str, str], list[PlannedTrial]] = {}
        for planned in self.plan.trials:
            groups.setdefault(planned.key[:2], []).append(planned)
        return groups

    def count_costs(self) -> dict[str, int]:
        """Count the costs that are planned, and those that are stored, without making any file."""
        measured: set[CostKey] = set()
        if (self.out / STORE_NAME).exists():
            with ResultStore(self.out, read_only=True) as store:
                measured = {one.key for one in _costs(self, store)}
        costs = self.plan.costs
        return {"planned": len(costs), "stored": len(measured.intersection(costs))}

    @property
    def cost_config(self) -> CostConfig:
        """Effort of the measurement of costs."""
        return cost.QUICK_COST if self.quick else CostConfig()

    def file_name(self, name: str) -> str:
        """Name of a file of this request, such as ``table-rbf-3-trials-quick.json``.

        Requests that give other results have other names.
        """
        stem, _, kind = name.rpartition(".")
        marks = list(self.agents)
        if self.agents and self.presets:
            marks.append("with")  # sdnn-c with robust is not the agent sdnn-c-robust
        marks += self.presets
        given = {"trials": self.n_trials, "episodes": self.n_episodes}
        for (word, number), default in zip(given.items(), self._defaults, strict=True):
            if number and number != default:
                marks.append(f"{number}-{word}")
        marks += [f"seed-{self.seed}"] if self.seed else []
        marks += ["quick"] if self.quick else []
        return "-".join([stem, *marks]) + f".{kind}"


def reproduce(request: ReproduceRequest, *, observer: Observer | None = None) -> WrittenReport:
    """Run what is missing; when all is there, draw the figures and write tables and page.

    The files cover every experiment whose trials are all stored under the request's settings, not
    only those that were asked for now. None is written unless every trial is there.

    RunError before any trial if matplotlib is not installed or the result file cannot be
    used; later if the cluster cannot run trials any more: what was finished is stored. ValueError
    if nothing can be run as requested.
    """
    require_matplotlib()
    begin = time.monotonic()
    plan = request.plan
    with ResultStore(request.out) as store:
        remove_abandoned_files(request.out)
        outcome = run_trials(plan.trials, store, executor=request.executor, observer=observer)
        if outcome.failures or outcome.interrupted:
            return WrittenReport(outcome)
        cost.measure_costs(plan.costs, request.cost_config, store, observer or (lambda _: None))
        report, records = _read(request, store)
    drawn = {
        f"experiment-{experiment.id}": draw_experiment(experiment, results, quick=request.quick)
        for experiment, results in report.experiments
    }
    contents: dict[str, bytes] = {}
    if report.costs:
        drawn["cost"] = draw_cost(report.costs, quick=request.quick)
        contents["cost.csv"] = csv_bytes(cost.COST_ROW_HEADER, cost.round_rows(report.costs))
    for name, figure in drawn.items():
        contents[f"{name}.png"], contents[f"{name}.svg"] = figure_bytes(figure)
    contents["results.csv"] = csv_bytes(ROW_HEADER, trial_rows(records))
    page = report.page({name: contents[f"{name}.svg"] for name in drawn})
    return WrittenReport(outcome, page, table=report.to_json()).write(
        contents,
        lambda name: request.out / request.file_name(name),
        describe_call(outcome, time.monotonic() - begin, records),
    )


def _read(request: ReproduceRequest, store: ResultStore) -> tuple[Report, tuple[TrialRecord, ...]]:
    """Read everything that is complete under the request's settings, and the trials it is from."""
    stored = store.keys()
    complete = [(e, keys) for e, keys in request.plan.experiments if stored.issuperset(keys)]
    records = store.load(key for _, keys in complete for key in keys)
    shown = {series.id for series in cost.cost_series(request.agents or None)}
    experiments = tuple((e, collect(e, records)) for e, _ in complete)
    n_run = {
        (one.case_id, one.agent, one.config_hash): one.n_trials
        for _, results in experiments
        for one in results
    }
    report = Report(
        experiments=experiments,
        costs=tuple(one for one in _costs(request, store) if one.series in shown),
        quick=request.quick,
        seed=request.seed,
        digest=records_digest(records),
        agents=request.agents,
        reference=tuple(
            one
            for one in reference_results()
            if one.n_trials > n_run.get((one.case_id, one.agent, one.config_hash), math.inf)
        ),
    )
    return report, records


def _costs(request: ReproduceRequest, store: ResultStore) -> tuple[CostRecord, ...]:
    return cost.load_costs(store, request.cost_config.config_hash)


def collect(experiment: Experiment, records: Iterable[TrialRecord]) -> tuple[CaseResult, ...]:
    """Measure the trials of each case and agent of an experiment; others are passed over."""
    by_pair: dict[tuple[str, str], list[TrialRecord]] = {}
    for record in records:
        by_pair.setdefault(record.key[:2], []).append(record)
    return tuple(
        measure(case.title, by_pair.get((case.id, agent), ()))
        for case in experiment.cases
        for agent in case.agents
    )


def case_spec(case: Case, agent: str, n_episodes: int = PAPER_EPISODES) -> RunSpec:
    """Return the specification of an agent in a case: its defaults, the case's sensors.

    Raises ValueError if the agent takes no part in the case, or if there is no such agent.
    """
    one_of("agent", agent, case.agents)
    name, preset = split_label(agent)
    return RunSpec(
        agent=AgentSpec(name=name, preset=preset),
        sensors=SensorConfig(n_sensors=case.n_sensors, noise=case.noise),
        budget=BudgetSpec(episodes=n_episodes),
    )


def plan_trials(
    cases: Iterable[Case], n_trials: int, root_seed: int, n_episodes: int = PAPER_EPISODES
) -> tuple[PlannedTrial, ...]:
    """List the trials of all agents in the given cases; see `sdnn.runs.engine.plan_of`.

    Experiments share the trials of cases that have the same id.
    """
    specs = (
        (case.id, case_spec(case, agent, n_episodes)) for case in cases for agent in case.agents
    )
    return plan_of(specs, n_trials, root_seed)
