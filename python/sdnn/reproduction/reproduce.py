"""The paper's experiments as a study, and studies whose report judges the paper's claims."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import sdnn.reproduction.cost as cost
from sdnn.agents.registry import agent_entry, split_label, title_of
from sdnn.environments.paper_acrobot import PAPER_ACROBOT
from sdnn.reports.pages import Section, Table
from sdnn.reports.plots import NARROW_DPI, Figure, figure_bytes, png_bytes
from sdnn.reproduction.cases import (
    COST,
    EXPERIMENTS,
    MOST_EPISODES,
    PAPER_CASES,
    PAPER_EPISODES,
    PAPER_INTERVAL,
    PAPER_TRIALS,
    SENSOR_NOISE,
    Case,
    Experiment,
    case_of_sensors,
    select_experiments,
)
from sdnn.reproduction.claims import ClaimOutcome, TenTrials, judge_claims, more_trials
from sdnn.reproduction.cost import CostConfig
from sdnn.reproduction.figures import draw_cost, draw_experiment
from sdnn.reproduction.report import CHECKS_HEADER, RULE_NOTE, VERDICT_KINDS, Report, check_rows
from sdnn.runs.engine import Observer, PlannedTrial
from sdnn.runs.report import Content, format_estimate
from sdnn.runs.results import CaseResult
from sdnn.runs.settings import Values, overridden
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.study import Comparison, Layer, Setting, Study, StudyCase, StudyVariant
from sdnn.runs.study_file import StudyFile
from sdnn.runs.sweep import Addition
from sdnn.runs.trial import ROW_HEADER, trial_rows
from sdnn.support.arguments import argument_error, one_of, whole
from sdnn.support.csv_files import csv_bytes

QUICK_TRIALS = 2
QUICK_EPISODES = 300


class PaperStudy(Study):
    """The paper's experiments: agents as variants in its cases.

    Files of other agents, presets, trials, episodes or seeds than the default have these in their
    names, and those of a quick look are marked so. Costs are always measured in this process.

    ValueError if the trials are too short or too long, if an agent is not known, or if only costs
    are requested, of agents whose cost is not measured.

    Parameters
    ----------
    word
        The experiments to run: one of `WORDS`. Stored trials of the others are shown, too.
    n_trials, n_episodes
        Trials per case and agent, and learning episodes per trial, of which a test needs at least
        ten. By default the paper's, or with `quick` few.
    seed
        Root of all seeds.
    quick
        Whether only a fraction is run.
    agents
        Agents to run in every case instead of the case's own.
    presets
        Presets under which SDNN-C runs beside the agents of every case.
    sensors, noise
        If either is given, experiment B has a single case, with this number of sensors (4 by
        default) and this standard deviation of their noise (0.02 by default).
    """

    def __init__(
        self,
        word: str = "all",
        *,
        n_trials: int | None = None,
        n_episodes: int | None = None,
        seed: int = 0,
        quick: bool = False,
        agents: Iterable[str] = (),
        presets: Iterable[str] = (),
        sensors: int | None = None,
        noise: float | None = None,
    ) -> None:
        defaults = (QUICK_TRIALS, QUICK_EPISODES) if quick else (PAPER_TRIALS, PAPER_EPISODES)
        trials, episodes = n_trials or defaults[0], n_episodes or defaults[1]
        requested = {experiment.id for experiment in select_experiments(word)}
        self.quick, self.agents, presets = quick, dict.fromkeys(agents), dict.fromkeys(presets)
        experiments: tuple[Experiment, ...] = EXPERIMENTS
        has_sensors = sensors is not None or noise is not None
        if has_sensors:
            experiments = _experiment_with_sensors(word, sensors, noise)
        self.experiments = [e.with_agents(self.agents, presets) for e in experiments]
        cases = [case for experiment in self.experiments for case in experiment.cases]
        whole("episodes", episodes, PAPER_INTERVAL, MOST_EPISODES)
        super().__init__("", specs_of(cases, episodes), n_trials=trials, seed=seed)
        requested_pairs = {pair for e in self.experiments if e.id in requested for pair in e.pairs}
        # The case and agent of each requested trial; what is stored of others is only shown.
        self.pairs = tuple(pair for pair in self.combinations if pair in requested_pairs)
        self.cost_config = cost.QUICK_COST if quick else CostConfig()
        self.costs = {}
        if word in (COST, "all"):
            self.costs = cost.planned_costs(self.cost_config, self.agents or None)
        if not (self.pairs or self.costs):
            measured = dict.fromkeys(series.agent for series in cost.SERIES)
            raise ValueError(
                f"agents whose cost is measured are {', '.join(measured)},"
                f" got {', '.join(self.agents)}"
            )
        self._marks = [  # of the names of files: each setting that is not the default
            *self.agents,
            # Without "with", agent rbf and preset robust would look like rbf's preset robust.
            *(["with"] if self.agents and presets else []),
            *presets,
            *([self.experiments[0].cases[0].id] if has_sensors else []),
            *([f"{trials}-trials"] if trials != defaults[0] else []),
            *([f"{episodes}-episodes"] if episodes != defaults[1] else []),
            *([f"seed-{seed}"] if seed else []),
            *(["quick"] if quick else []),
        ]

    def measure(self, store: ResultStore, observe: Observer) -> None:
        """Measure the costs that are not stored."""
        cost.measure_costs(self.costs, self.cost_config, store, observe)

    def other_work(self, out: Path) -> dict[str, object]:
        """Count the costs to be measured, and those of them that are stored."""
        measured: dict[str, object] = {}
        if (out / STORE_NAME).exists():
            with ResultStore(out, read_only=True) as store:
                measured = store.measurements(cost.KIND)
        n_stored = len(self.costs.keys() & measured.keys())
        return {"costs": {"planned": len(self.costs), "stored": n_stored}}

    def file_name(self, name: str) -> str:
        """Return a file name with the settings that differ, such as ``table-rbf-quick.json``."""
        stem, _, suffix = name.rpartition(".")
        return "-".join([stem, *self._marks]) + f".{suffix}"

    def report(self, comparison: Comparison, store: ResultStore) -> Content | None:
        """Make the report of every experiment that is complete, and of costs.

        None where requested trials are missing.
        """
        stored = comparison.measured.keys()
        if not stored >= set(self.pairs):
            return None
        collected = [(e, collect(e, comparison)) for e in self.experiments if e.pairs <= stored]
        stored_costs = cost.load_costs(store, self.cost_config.config_hash)
        series_ids = {series.id for series in cost.cost_series(self.agents or None)}
        report = Report(
            experiments=tuple(collected),
            costs=tuple(cost for cost in stored_costs if cost.series in series_ids),
            quick=self.quick,
            seed=self.seed,
            agents=tuple(self.agents),
            reference=more_trials(result for _, results in collected for result in results),
        )
        figures, narrow_figures = (_figures(report, narrow=narrow) for narrow in (False, True))
        files: dict[str, bytes] = {}
        if report.costs:
            files["cost.csv"] = csv_bytes(cost.COST_ROW_HEADER, cost.round_rows(report.costs))
        for name, figure in figures.items():
            files[f"{name}.png"], files[f"{name}.svg"] = figure_bytes(figure)
        files["results.csv"] = csv_bytes(ROW_HEADER, trial_rows(report.records))
        page = report.page(
            {name: files[f"{name}.svg"] for name in figures},
            {name: png_bytes(figure, NARROW_DPI) for name, figure in narrow_figures.items()},
        )
        return Content(page=page, table=report.to_json(), files=files, shown=report.records)


def _figures(report: Report, *, narrow: bool) -> dict[str, Figure]:
    """Draw the figures of a report by their file names without suffix; `narrow` for telephones."""
    figures = {
        f"experiment-{experiment.id}": draw_experiment(
            experiment, results, quick=report.quick, narrow=narrow
        )
        for experiment, results in report.experiments
    }
    if report.costs:
        figures["cost"] = draw_cost(report.costs, quick=report.quick, narrow=narrow)
    return figures


def _experiment_with_sensors(
    word: str, sensors: int | None, noise: float | None
) -> tuple[Experiment, ...]:
    """Return experiment B with a single case; ValueError unless it alone is to be run."""
    if word != "b":
        name = "noise" if sensors is None else "sensors"
        raise argument_error(name, f"needs the experiment 'b' (sdnn reproduce b), got {word!r}")
    case = case_of_sensors(
        4 if sensors is None else whole("sensors", sensors, 4, 6),
        SENSOR_NOISE if noise is None else noise,
    )
    return tuple(replace(e, cases=(case,)) for e in EXPERIMENTS if e.id == "b")


def collect(experiment: Experiment, comparison: Comparison) -> tuple[CaseResult, ...]:
    """Return the results of each agent in each case, with the titles of this experiment."""
    return tuple(
        replace(comparison.measured[case.id, agent].result, title=case.title)
        for case in experiment.cases
        for agent in case.agents
    )


def with_paper_defaults(values: Values) -> Values:
    """Fill in the paper's values where the values of a specification are missing.

    The agent is SDNN-C, with the settings of the paper unless a preset is named; it learns 15,000
    episodes, with a test episode after every ten, and the noise runs on over episodes.
    """
    environment = {"id": PAPER_ACROBOT} | values.get("environment", {})
    agent = {"name": "sdnn-c", "angle_pairs": "none", "inputs": "all"} | values.get("agent", {})
    budget, protocol = dict(values.get("budget", {})), dict(values.get("protocol", {}))
    try:
        name, preset = split_label(agent["name"])
        if preset is None and "paper" in agent_entry(name).presets:
            agent.setdefault("preset", "paper")
    except ValueError:  # the specification raises the error
        pass
    if not budget.keys() & {"steps", "episodes"}:
        budget["episodes"] = PAPER_EPISODES
    if not protocol.keys() & {"evaluate_every", "evaluate_every_episodes"}:
        protocol["evaluate_every_episodes"] = PAPER_INTERVAL
    protocol = {"evaluation_episodes": 1, "seeded_episodes": False} | protocol
    tables = {"environment": environment, "agent": agent, "budget": budget, "protocol": protocol}
    return {**values, **tables}


def paper_spec(**tables: object) -> RunSpec:
    """Return a specification of the paper's task, with some tables, or values in them, replaced.

    Examples
    --------
    >>> spec = paper_spec(agent="fuzzy", budget={"episodes": 100})
    >>> spec.label, spec.task, spec.protocol.evaluate_every_episodes
    ('fuzzy', 'sdnn/PaperAcrobot-v0', 10)
    """
    return RunSpec.from_values(with_paper_defaults(overridden(tables, {})))


def case_spec(case: Case, agent: str, n_episodes: int = PAPER_EPISODES) -> RunSpec:
    """Return the specification of an agent in a case: its defaults, the case's sensors.

    Raises ValueError if the agent takes no part in the case, or if there is no such agent.
    """
    one_of("agent", agent, case.agents)
    split_label(agent)  # raises for an unknown agent
    episodes = whole("episodes", n_episodes, 1, 2**53)
    settings = {**case.settings, "agent.name": agent, "budget.episodes": episodes}
    return paper_spec(**overridden({}, settings))


def specs_of(
    cases: Iterable[Case], n_episodes: int = PAPER_EPISODES
) -> Iterator[tuple[StudyCase, StudyVariant, RunSpec, Layer]]:
    """Yield all agents in the given cases, as `Study` receives them.

    Experiments share the trials of cases that have the same id.
    """
    for case in cases:
        for agent in case.agents:
            variant = StudyVariant(agent, title_of(agent))
            yield StudyCase(case.id, case.title), variant, case_spec(case, agent, n_episodes), {}


def plan_trials(
    cases: Iterable[Case], n_trials: int, root_seed: int, n_episodes: int = PAPER_EPISODES
) -> tuple[PlannedTrial, ...]:
    """List the trials of all agents in the given cases."""
    return Study("", specs_of(cases, n_episodes), n_trials=n_trials, seed=root_seed).plan()


MIN_TRIALS_TO_DRAW = 2 * PAPER_TRIALS
"""Smallest number of trials from which draws of ten are made; chosen."""

CLAIMS_NOTE = "A claim is shown where the study has every case and agent that it speaks of."
CHANCES_NOTE = (
    f"In how many draws of {PAPER_TRIALS} of a variant's trials, as the paper's ten were one, the"
    " medians lie in all ranges of a claim; with intervals over the trials that are drawn from."
    f" Shown from {MIN_TRIALS_TO_DRAW} trials on."
)


def settings_of(case: Case) -> Layer:
    """Return the settings of a case, as if they were a case's table in a study's file."""
    settings = case.settings.items()
    return {tuple(key.split(".")): Setting(value, ("cases", case.id)) for key, value in settings}


class ClaimStudy(StudyFile):
    """A study that may name the paper's cases, and whose report has verdicts on its claims."""

    known_cases: ClassVar[dict[str, StudyCase]] = {
        case.id: StudyCase(case.id, case.title, settings_of(case)) for case in PAPER_CASES.values()
    }

    def completed(self, case: StudyCase, values: Values) -> Values:
        """Fill in the paper's defaults in the paper's cases."""
        return with_paper_defaults(values) if case.id in PAPER_CASES else values

    def additions(self, comparison: Comparison) -> Addition:
        """Make tables of verdicts on claims, of their chances in ten trials, and of quantities."""
        judged = judge_variants(comparison)
        values = [
            {
                "variant": variant,
                "ten_trials_show_it": outcome.chance and outcome.chance.to_json(PAPER_EPISODES),
                **outcome.to_json(),
            }
            for variant, claims in judged.items()
            for outcome in claims.values()
        ]
        numbers = sorted({number for claims in judged.values() for number in claims})
        if not numbers:
            return [], {"claims": values}
        titles = {variant.id: variant.title for variant in comparison.variants}
        header = ("variant", *(f"claim {number}" for number in numbers))

        def rows(cell: Callable[[ClaimOutcome], str]) -> list[tuple[str, ...]]:
            """Return a row for each variant: its title, and a cell for each claim."""
            return [
                (titles[variant], *(cell(claims[n]) if n in claims else "-" for n in numbers))
                for variant, claims in judged.items()
            ]

        verdicts = rows(lambda outcome: outcome.verdict.value)
        table = Table("The paper's claims", header, verdicts, {"-": "none", **VERDICT_KINDS})
        sections = [Section(table=table, notes=[CLAIMS_NOTE, RULE_NOTE])]
        if self.n_trials >= MIN_TRIALS_TO_DRAW:
            chances = rows(lambda outcome: format_estimate(outcome.chance))
            table = Table("How often ten trials show the claims", header, chances)
            sections.append(Section(level=3, table=table, notes=[CHANCES_NOTE]))
        checks = [
            (titles[variant], *row)
            for variant, claims in judged.items()
            for row in check_rows(claims.values())
        ]
        table = Table(
            "Each quantity of the claims", ("variant", *CHECKS_HEADER), checks, VERDICT_KINDS
        )
        return [*sections, Section(folded=[Section(table=table)])], {"claims": values}


def judge_variants(comparison: Comparison) -> dict[str, dict[int, ClaimOutcome]]:
    """Judge the paper's claims about each variant of a study, by its id and the claim's number.

    Cases and agents are those of the paper if they have their ids, whatever settings a variant
    changes: the effect of these changes is judged. Claims with a quantity that is not measured
    are left out.
    """
    judged = {}
    for variant in comparison.variants:
        results = [
            measured.result
            for (case, name), measured in comparison.measured.items()
            if name == variant.id and case in PAPER_CASES
            if measured.combination.spec.environment.is_paper_acrobot
        ]
        draws = TenTrials(results if comparison.study.n_trials >= MIN_TRIALS_TO_DRAW else ())
        judged[variant.id] = {
            outcome.claim.number: replace(outcome, chance=draws.chance(outcome.claim))
            for outcome in judge_claims(results)
            if all(checked.estimate is not None for checked in outcome.checks)
        }
    return judged
