"""A page about what the agent of a run has learned."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from sdnn._core import __version__
from sdnn.agents import UnusableStepError
from sdnn.agents.agent import AnyAgent
from sdnn.agents.inspection import (
    SHARE_RANDOM,
    AgentInput,
    Floats,
    Influence,
    Reader,
    influences,
    inputs_of,
    meet_states,
    named_inputs,
)
from sdnn.agents.inspection_figures import axis_label, draw_influences, draw_map, draw_replay, plain
from sdnn.agents.q_learning import ValueAgent
from sdnn.agents.schedules import schedule_of
from sdnn.agents.state_maps import Replay, StateMap, map_of, replay
from sdnn.environments.types import Data
from sdnn.reports import plots
from sdnn.reports.pages import Page, Section, Table
from sdnn.runs.errors import ConfigError, RunError
from sdnn.runs.report import require_matplotlib
from sdnn.runs.run import Run, agent_of
from sdnn.support import machine
from sdnn.support.files import write_whole
from sdnn.training.loop import Row

FILE_NAME = "inspect.html"
FEW_UNITS = 1_000  # number of value units in a reward below which rewards are rounded noticeably
LITTLE_USED, OFTEN_OUTSIDE = 0.1, 0.1
"""Share of a range below which it is hardly used, and share of states outside that is large."""
N_POINTS = 60  # points of a curve of scheduled settings


class RangeUse(NamedTuple):
    """An input's range from `low` to `high`, and how visited states use it.

    `within` is the share of the range that the middle nine tenths of the states span, `outside`
    the share of states beyond the range.
    """

    low: float
    high: float
    within: float
    outside: float


@dataclass(frozen=True, kw_only=True)
class Inspection:
    """All that a page shows of an agent: influences, a map, a greedy episode, and its learning."""

    run: Run
    agent: AnyAgent
    value_name: str
    states: Floats
    has_masks: bool
    inputs: Sequence[AgentInput]
    influences: Sequence[Influence]
    state_map: StateMap
    episode: Replay
    rows: Sequence[Row]
    report: Data

    def page(self) -> Page:
        """Return the page."""
        spec = self.run.spec
        n_steps = max((row["step"] for row in self.rows), default=0)
        return Page(
            title=f"What {spec.label} has learned in {spec.task}",
            intro=f"After {n_steps:,} steps, seed {spec.seed}. Values and greedy actions are read"
            f" from the agent in {len(self.states):,} states that it met in greedy episodes with"
            f" {SHARE_RANDOM:.0%} random actions.",
            warnings=self.warnings(),
            sections=[*self._sections()],
            source=f"Run {self.run.folder.name}; configuration {spec.config_hash}; sdnn"
            f" {__version__}.",
        )

    def _sections(self) -> Iterator[Section]:
        """Yield the sections of the page, from the map of values to the learning curves."""
        names = " and ".join(axis_label(i) for i in self.state_map.inputs)
        others = ", ".join(f"{n} = {x:.4g}" for n, x in self.state_map.typical.items())
        notes = [f"Other inputs are at their median: {others}."] if others else []
        notes.append("Dots and ticks are states that were met; values elsewhere are extrapolated.")
        if self.has_masks:
            notes.append(
                "Values and actions are those of actions that a mask allowed in the nearest state"
                " that was met."
            )
        if self.agent.history != "none":
            notes.append(
                f"States have a history ({self.agent.history}): each state counts as the first"
                " observation of an episode."
            )
        yield _drawn_section(
            partial(draw_map, self.agent, self.value_name, self.state_map, self.states),
            title=f"Values and actions over {names}",
            alt=f"Value and greedy action over {names}",
            notes=notes,
        )
        yield _drawn_section(
            partial(draw_influences, self.influences),
            title="Influence of each input",
            alt="Change of values and actions where an input is shuffled",
            is_narrow=True,
            table=self.input_table(),
            notes=[
                "Each input is shuffled among the states. Change of values: root mean square, 100 %"
                " as far as the values of two states are apart. Change of actions: states with"
                " another greedy action, of continuous actions the mean change as a share of their"
                " range. Inputs that carry the same information share their influence."
            ],
        )
        episode, order = self.episode, [i.input for i in self.influences]
        end = "terminated" if episode.terminated else "not terminated"
        yield _drawn_section(
            partial(draw_replay, self.agent, self.value_name, episode, order),
            title="A greedy episode",
            alt="Inputs, values and actions over the steps of a greedy episode",
            is_narrow=True,
            notes=[
                f"{len(episode.values):,} steps, return {episode.total_reward:.6g}, {end}: the"
                " first episode of sdnn evaluate."
            ],
        )
        yield _drawn_section(
            self.draw_learning,
            title="Learning",
            alt="Returns, epsilon and alpha over the steps",
            is_narrow=True,
            table=Table("Numbers", ("quantity", "value"), self.numbers()),
        )

    def input_table(self) -> Table:
        """Return the table of inputs: ranges, what was met of them, and influences."""
        rows = []
        for influence in self.influences:
            agent_input = influence.input
            low, high = agent_input.limits(self.states)
            numbers = agent_input.numbers(self.states)
            if agent_input.has_symbols:
                met = f"{len(np.unique(numbers))} of {len(agent_input.columns)} symbols"
            elif self._is_constant(agent_input):
                met = f"{numbers[0]:.4g}"
            else:
                met = f"{low:.4g} to {high:.4g}"
            use = self.range_use(agent_input)
            rows.append(
                (
                    agent_input.name,
                    agent_input.type,
                    "" if use is None else f"{use.low:.4g} to {use.high:.4g}",
                    met,
                    "" if use is None else f"{use.within:.0%}",
                    "" if use is None else f"{use.outside:.0%}",
                    f"{influence.on_values:.1%}",
                    f"{influence.on_actions:.1%}",
                    self._why_left_out(agent_input),
                )
            )
        header = ("input", "type", "range", "met", "used", "outside", "values", "actions", "note")
        columns = [i for i in range(len(header)) if any(row[i] for row in rows)]  # with any text
        return Table(
            "Inputs",
            tuple(header[i] for i in columns),
            [tuple(row[i] for i in columns) for row in rows],
            brief=("input", "met", "values", "actions", "note"),
        )

    def range_use(self, agent_input: AgentInput) -> RangeUse | None:
        """Return how states use the range of an input; None for angles, symbols and unused ones."""
        if not agent_input.is_used or agent_input.type != "variable":
            return None
        column = agent_input.columns[0]
        low, high = (float(bounds[column]) for bounds in self.agent.observation_range)
        numbers = agent_input.numbers(self.states)
        # Percentiles 5 and 95 enclose nine tenths, so that rare extremes do not count as use.
        first, last = np.clip(np.percentile(numbers, (5, 95)), low, high).tolist()
        outside = float(((numbers < low) | (numbers > high)).mean())
        return RangeUse(low, high, (last - first) / (high - low), outside)

    def _is_constant(self, agent_input: AgentInput) -> bool:
        """Return whether an input has the same value in all states."""
        return bool(np.ptp(agent_input.numbers(self.states)) == 0.0)

    def _why_left_out(self, agent_input: AgentInput) -> str:
        """Return why the agent does not read an input; empty for an input that it reads."""
        if agent_input.is_used:
            return ""
        if self._is_constant(agent_input):
            return "left out: constant"
        return "left out: neither rewards nor actions had to do with it"

    def numbers(self) -> list[tuple[str, str]]:
        """Return quantities of learning with their values as text."""
        rows, report, agent = self.rows, self.report, self.agent
        numbers = [("episodes", f"{sum(row['kind'] == 'episode' for row in rows):,}")]
        evaluations = [row for row in rows if row["kind"] == "evaluation"]
        if evaluations:
            best = max(evaluations, key=lambda row: float(row["mean_return"]))
            for name, row in (("last evaluation", evaluations[-1]), ("best evaluation", best)):
                numbers.append((name, f"{row['mean_return']:.6g} after {row['step']:,} steps"))
        threshold = self.threshold()
        if threshold is not None:
            numbers.append(("return that counts as solved", f"{threshold:g}"))
        if isinstance(agent, ValueAgent):
            numbers.append(("epsilon now", f"{agent.epsilon:.4g}"))
            numbers.append(("alpha now", f"{agent.learning_rate:.4g}"))
        titles = {
            "value_unit": "unit of values", "recent_reward": "size of recent rewards",
            "value_step": "step of values", "mean_error": "mean size of corrections",
            "n_corrections": "corrections",
        }  # fmt: skip
        for name, title in titles.items():
            if report.get(name):
                numbers.append((title, f"{report[name]:.4g}"))
        if report.get("n_corrections"):
            for name in ("share_changed", "share_rounded_away", "share_out_of_range"):
                numbers.append((name.replace("_", " "), f"{report[name]:.1%}"))
        numbers.append(("history of observations in states", agent.history))
        return numbers

    def threshold(self) -> float | None:
        """Return the mean return that solves the task, by its registration; None without one."""
        registered = gym.registry.get(self.run.spec.task.rpartition(":")[2])
        return None if registered is None else registered.reward_threshold

    def warnings(self) -> list[str]:
        """Return what may be wrong, a sentence each."""
        texts = [*self._warnings_of_values(), *self._warnings_of_ranges()]
        evaluations = [row["mean_return"] for row in self.rows if row["kind"] == "evaluation"]
        if len(evaluations) > 2:
            last, best, worst = evaluations[-1], max(evaluations), min(evaluations)
            improvement = best - worst
            if improvement > 0.0 and best - last > 0.5 * improvement:
                texts.append(
                    f"The last evaluation ({last:.5g}) is far below the best one ({best:.5g}):"
                    " --keep-best keeps that agent."
                )
        actions = np.unique(np.round(self.episode.actions, 9), axis=0)
        if len(actions) == 1 and len(self.episode.actions) > 1:
            texts.append("The greedy episode has a single action throughout.")
        if not any(i.on_actions for i in self.influences):
            texts.append("No input changes the greedy action.")
        return texts

    def _warnings_of_values(self) -> Iterator[str]:
        """Warn of rewards or corrections too small for the resolution of the values."""
        report = self.report
        unit, reward = report.get("value_unit"), report.get("recent_reward")
        if unit and reward and reward < FEW_UNITS * unit:
            yield (
                f"Recent rewards are only {reward / unit:,.0f} units of values in size: smaller"
                " ones are rounded."
            )
        is_rounded = report.get("share_rounded_away", 0.0) > 0.5
        if is_rounded and report["mean_error"] < report["value_step"]:
            yield (
                f"Most corrections are rounded away: values come in steps of"
                f" {report['value_step']:.3g}, and targets differ by {report['mean_error']:.3g}."
            )

    def _warnings_of_ranges(self) -> Iterator[str]:
        """Warn of inputs that are constant, or whose range is too wide or too narrow."""
        for agent_input in self.inputs:
            use = self.range_use(agent_input)
            if agent_input.is_used and self._is_constant(agent_input):
                yield f"{agent_input.name} is constant: the agent can do without it."
            elif use is not None and use.within < LITTLE_USED:
                share = f"{use.within:.0%}"
                yield f"{agent_input.name} uses only {share} of its range: --range narrows it."
            if use is not None and use.outside > OFTEN_OUTSIDE:
                yield f"{agent_input.name} is outside its range in {use.outside:.0%} of the states."

    def draw_learning(self, *, narrow: bool = False) -> plots.Figure:
        """Draw returns, and below them epsilon and alpha; `narrow` is a figure for telephones."""
        agent = self.agent if isinstance(self.agent, ValueAgent) and self.rows else None
        width = plots.NARROW_WIDTH if narrow else plots.WIDTH
        figure = plots.new_figure(width, 2.6 if agent is None else 3.8)
        n_panels = 1 if agent is None else 2
        panels = figure.subplots(n_panels, 1, sharex=True, squeeze=False)[:, 0]
        self._draw_returns(panels[0])
        if agent is not None:
            self._draw_schedule(panels[1], agent)
        panels[-1].set_xlabel("step", fontsize=9, color=plots.INK)
        return plain(figure)

    def _draw_returns(self, axes: plots.Axes) -> None:
        """Draw the returns of episodes as dots, and the means of evaluations as a line."""
        episodes = [row for row in self.rows if row["kind"] == "episode"]
        evaluations = [row for row in self.rows if row["kind"] == "evaluation"]
        axes.plot(
            [row["step"] for row in episodes], [row["return"] for row in episodes], ".",
            color=plots.FAINT, alpha=0.5, markersize=3, rasterized=True, label="episode",
        )  # fmt: skip
        if evaluations:
            axes.plot(
                [row["step"] for row in evaluations], [row["mean_return"] for row in evaluations],
                "o-", color=plots.color_of(0), markersize=3.5, label="evaluation, mean",
            )  # fmt: skip
        axes.set_ylabel("return", fontsize=9, color=plots.INK)
        axes.legend(fontsize=8, frameon=False)
        plots.style(axes)

    def _draw_schedule(self, axes: plots.Axes, agent: ValueAgent[Any, Any]) -> None:
        """Draw epsilon and alpha, which are scheduled over the training."""
        steps = np.linspace(0, max(row["step"] for row in self.rows), N_POINTS).round()
        schedule = schedule_of(agent, steps, self._progress_at(steps))
        for values, name, color in (
            (schedule.epsilon, "epsilon", plots.color_of(1)),
            (schedule.learning_rate, "alpha", plots.color_of(2)),
        ):
            axes.plot(steps, values, color=color, linewidth=1.4, label=name)
        axes.set_ylim(bottom=0)
        axes.legend(fontsize=8, frameon=False)
        plots.style(axes)

    def _progress_at(self, steps: Floats) -> Floats:
        """Return the share of the goal that was reached at `steps`, in [0, 1]."""
        goal = self.run.goal
        if goal.steps is not None:
            return steps / goal.steps
        ends = [row["step"] for row in self.rows if row["kind"] == "episode"]
        return np.searchsorted(ends, steps, side="right") / (goal.episodes or 1)

    def to_json(self) -> dict[str, object]:
        """Return influences, warnings and the episode as values that JSON can hold."""
        return {
            "folder": str(self.run.folder),
            "inputs": [
                {
                    "name": i.input.name,
                    "type": i.input.type,
                    "variables": list(i.input.columns),
                    "is_used": i.input.is_used,
                    "on_values": i.on_values,
                    "on_actions": i.on_actions,
                }
                for i in self.influences
            ],
            "map_of": [i.name for i in self.state_map.inputs],
            "episode": {
                "n_steps": len(self.episode.values),
                "return": self.episode.total_reward,
                "terminated": self.episode.terminated,
            },
            "warnings": self.warnings(),
        }


def _drawn_section(draw: Callable[..., plots.Figure], **fields: Any) -> Section:
    """Make a section with the figure that `draw` returns, and its narrow form for telephones."""
    narrow = plots.png_bytes(draw(narrow=True), plots.NARROW_DPI)
    return Section(picture=plots.svg_bytes(draw()), narrow_picture=narrow, **fields)


def inspect_run(
    run: Run, *, names: Sequence[str] = (), seed: int | None = None, best: bool = False
) -> Inspection:
    """Read what the agent of a run has learned; nothing is learned or written.

    ``names`` are one or two inputs of the map, by default the most influential ones; ``seed`` is
    the root of the episodes' seeds, by default that of `Run.evaluate`; with ``best`` the agent is
    that of the best evaluation.

    ConfigError if an input is not known. RunError if there is no checkpoint yet, the agent is
    warming up, or the environment has changed or gives what cannot be evaluated.
    """
    require_matplotlib()
    agent = agent_of(run.folder, best=best)
    root = run.fresh_seed if seed is None else seed
    try:
        reader, inputs = Reader(agent), inputs_of(agent)
    except RuntimeError as error:
        raise RunError(str(error)) from error
    try:
        chosen = named_inputs(names, inputs) if names else []
    except ValueError as error:
        raise ConfigError("inputs", str(error).removeprefix("inputs: ")) from error
    with closing(run.spec.make_env("evaluation_sensor_noise")) as env:
        run.check_spaces(agent, env)
        options = run.reset_options(env)
        try:
            states = meet_states(agent, env, root % 2**32, options)
        except ValueError as error:
            raise RunError(f"no states were met: {error}") from error
        try:
            measured = influences(reader, states, inputs, root % 2**32)
            chosen = chosen or [i.input for i in measured if i.input.is_used][:2]
            state_map = map_of(reader, states, chosen, inputs)
            episode = replay(reader, env, root, options)
        except UnusableStepError as error:
            raise RunError(f"{run.spec.task}: {error}") from error
    return Inspection(
        run=run,
        agent=agent,
        value_name=reader.value_name,
        states=states.rows,
        has_masks=states.allowed is not None,
        inputs=inputs,
        influences=measured,
        state_map=state_map,
        episode=episode,
        rows=run.rows(),
        report=agent.learning_report() if isinstance(agent, ValueAgent) else {},
    )


def write_inspection(inspection: Inspection, path: Path) -> None:
    """Write the page as self-contained HTML; OSError if that is impossible."""
    write_whole(path, inspection.page().to_html(f"Made on {machine.description()}.").encode())
