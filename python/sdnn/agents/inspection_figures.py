"""Figures of what an agent has learned: maps, influences and a greedy episode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import gymnasium as gym
import numpy as np

from sdnn.agents.inspection import (
    AgentInput,
    AnyAgent,
    Floats,
    Influence,
    Reader,
    States,
    influences,
    inputs_of,
    meet_states,
    named_inputs,
)
from sdnn.agents.state_maps import Replay, StateMap, map_of
from sdnn.environments.space_kinds import require_same_kind
from sdnn.environments.types import Elements, Env
from sdnn.reports import plots
from sdnn.support.arguments import require, seed_of

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

MOST_COLORS = len(plots.COLORS)
MOST_DIMENSIONS = 3  # largest number of action dimensions that are drawn
MOST_STRIPS = 6  # largest number of inputs in the strips of an episode
MOST_BARS = 30  # largest number of inputs whose influence is drawn
MOST_DOTS = 400


def is_discrete(agent: AnyAgent) -> bool:
    """Return whether an agent's actions are numbers without an order."""
    return not isinstance(agent.action_space, gym.spaces.Box)


def draw_map(
    agent: AnyAgent, value_name: str, state_map: StateMap, states: Floats, *, narrow: bool = False
) -> plots.Figure:
    """Draw values and greedy actions over one or two inputs, and the states that were met.

    With `narrow` panels are below each other, for telephones; in the other figures, too.
    """
    n_dimensions = min(state_map.actions.shape[-1], MOST_DIMENSIONS)
    n_panels = 1 + n_dimensions
    inches = (plots.NARROW_WIDTH, 3.7 * n_panels) if narrow else (min(4.6 * n_panels, 14.0), 3.7)
    figure = plots.new_figure(*inches)
    panels = figure.subplots(*((n_panels, 1) if narrow else (1, n_panels)), squeeze=False).ravel()
    draw_values(panels[0], value_name, state_map, states)
    for d in range(n_dimensions):
        draw_policy(panels[1 + d], agent, state_map, states, d)
    return plain(figure)


def draw_values(axes: plots.Axes, value_name: str, state_map: StateMap, states: Floats) -> None:
    """Draw the values of states over one input as a curve, over two as a map."""
    axes.set_title(f"value: {value_name}", loc="left", fontsize=9.5, color=plots.INK)
    if len(state_map.axes) == 1:
        x, agent_input = state_map.axes[0], state_map.inputs[0]
        line = "." if agent_input.has_symbols else "-"
        axes.plot(x, state_map.values, line, color=plots.color_of(0), linewidth=1.5, markersize=4)
        _finish_curve(axes, state_map, states)
        return
    _colorbar(axes, _draw_mesh(axes, state_map, state_map.values, "viridis"))
    _draw_states(axes, state_map, states)


def draw_policy(
    axes: plots.Axes, agent: AnyAgent, state_map: StateMap, states: Floats, dimension: int = 0
) -> None:
    """Draw the greedy action over one input as a curve, over two as a map."""
    name = "action" if state_map.actions.shape[-1] == 1 else f"action, dimension {dimension}"
    axes.set_title(f"greedy {name}", loc="left", fontsize=9.5, color=plots.INK)
    actions = state_map.actions[..., dimension]
    if len(state_map.axes) == 1:
        is_symbol = state_map.inputs[0].has_symbols
        line = "." if is_symbol else "-"
        steps = "steps-mid" if is_discrete(agent) and not is_symbol else "default"
        axes.plot(
            state_map.axes[0], actions, line, color=plots.color_of(1), drawstyle=steps, markersize=4
        )
        if is_discrete(agent):
            _whole_ticks(axes, actions)
        _finish_curve(axes, state_map, states)
        return
    distinct = np.unique(actions)
    if is_discrete(agent) and len(distinct) <= MOST_COLORS:
        from matplotlib.colors import ListedColormap
        from matplotlib.patches import Patch

        chosen = [plots.color_of(i) for i in range(len(distinct))]
        numbers = np.searchsorted(distinct, actions).astype(np.float64)
        _draw_mesh(axes, state_map, numbers, ListedColormap(chosen), (-0.5, len(distinct) - 0.5))
        patches = [
            Patch(color=c, label=f"{number:g}") for c, number in zip(chosen, distinct, strict=True)
        ]
        axes.legend(
            handles=patches, fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0),
            handlelength=1.0,
        )  # fmt: skip
    else:
        space = agent.action_space
        limits = None
        if isinstance(space, gym.spaces.Box):
            limits = float(np.ravel(space.low)[dimension]), float(np.ravel(space.high)[dimension])
        _colorbar(axes, _draw_mesh(axes, state_map, actions, "RdBu_r", limits))
    _draw_states(axes, state_map, states)


def _draw_mesh(
    axes: plots.Axes, state_map: StateMap, numbers: Floats, colors: str | Colormap,
    limits: tuple[float, float] | None = None,
) -> object:  # fmt: skip
    """Draw numbers over two inputs as colors; return what a color bar needs."""
    from matplotlib.ticker import MaxNLocator

    low, high = limits or (None, None)
    x, y = (
        np.arange(len(axis)) if agent_input.has_symbols else axis
        for axis, agent_input in zip(state_map.axes, state_map.inputs, strict=True)
    )
    mesh = axes.pcolormesh(
        x, y, numbers, cmap=colors, vmin=low, vmax=high, shading="nearest", rasterized=True
    )
    for axis, label, numbers_of, agent_input in (
        (axes.xaxis, axes.set_xlabel, state_map.axes[0], state_map.inputs[0]),
        (axes.yaxis, axes.set_ylabel, state_map.axes[1], state_map.inputs[1]),
    ):
        label(axis_label(agent_input), fontsize=9, color=plots.INK)
        if agent_input.has_symbols:
            every = max(1, len(numbers_of) // 12)  # about a dozen labels have room
            axis.set_ticks(np.arange(len(numbers_of))[::every])
            axis.set_ticklabels([f"{number:g}" for number in numbers_of[::every]])
        else:
            axis.set_major_locator(MaxNLocator(6))
    axes.tick_params(colors=plots.INK, labelsize=8)
    return mesh


def axis_label(agent_input: AgentInput) -> str:
    """Return the label of an input's axis, with the unit of angles."""
    return f"{agent_input.name} (degrees)" if agent_input.type == "angle" else agent_input.name


def _colorbar(axes: plots.Axes, mesh: object) -> None:
    """Add a color bar beside the panel of `mesh`, in the style of all figures."""
    figure = axes.figure
    assert figure is not None
    bar = figure.colorbar(mesh, ax=axes, pad=0.02)  # type: ignore[arg-type]
    bar.ax.tick_params(labelsize=8, colors=plots.INK)
    bar.outline.set_visible(False)


def _draw_states(axes: plots.Axes, state_map: StateMap, states: Floats) -> None:
    """Draw the states met as dots, beside symbols at random within their cell."""
    generator = np.random.default_rng(0)
    chosen = states[np.linspace(0, len(states) - 1, min(len(states), MOST_DOTS)).astype(np.int64)]
    coordinates = []
    for agent_input, axis in zip(state_map.inputs, state_map.axes, strict=True):
        numbers = agent_input.numbers(chosen)
        if agent_input.has_symbols:
            numbers = np.searchsorted(axis, numbers) + generator.uniform(-0.3, 0.3, len(numbers))
        coordinates.append(numbers)
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot(*coordinates, ".", color="black", alpha=0.35, markersize=1.6, rasterized=True)
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _finish_curve(axes: plots.Axes, state_map: StateMap, states: Floats) -> None:
    """Label the axis of a curve over one input; mark the states met along it."""
    agent_input = state_map.inputs[0]
    axes.set_xlabel(axis_label(agent_input), fontsize=9, color=plots.INK)
    plots.style(axes)
    if not agent_input.has_symbols:
        met = agent_input.numbers(states)
        axes.plot(met, np.zeros(len(met)), "|", color=plots.FAINT, alpha=0.3, markersize=5,
                  transform=axes.get_xaxis_transform(), rasterized=True)  # fmt: skip
        axes.set_xlim(state_map.axes[0][0], state_map.axes[0][-1])


def _whole_ticks(axes: plots.Axes, actions: Floats) -> None:
    """Put a tick at each discrete action, if there are not too many of them."""
    numbers = np.unique(actions)
    if len(numbers) <= MOST_COLORS:
        axes.set_yticks(numbers)


def draw_influences(measured: Sequence[Influence], *, narrow: bool = False) -> plots.Figure:
    """Draw the influence of each input on values and on actions as bars.

    ``measured`` is in the order of `influences`, the largest first; the first ones are drawn. With
    `narrow` the panels are below each other.
    """
    bars = list(measured)[:MOST_BARS]
    height = 1.0 + 0.27 * len(bars)  # in inches: title and axis, and a bar for each input
    figure = plots.new_figure(
        *((plots.NARROW_WIDTH, 2.0 * height) if narrow else (plots.WIDTH, height))
    )
    panels = figure.subplots(*((2, 1) if narrow else (1, 2)), sharey=not narrow)
    heights = np.arange(len(bars))
    for panel, name, title, color in (
        (panels[0], "on_values", "change of values", plots.color_of(0)),
        (panels[1], "on_actions", "change of greedy actions", plots.color_of(1)),
    ):
        panel.barh(heights, [100 * getattr(i, name) for i in bars], color=color, height=0.62)
        panel.set_title(title, loc="left", fontsize=9.5, color=plots.INK)
        panel.set_xlabel("%", fontsize=9, color=plots.INK)
        panel.set_xlim(left=0)
        plots.style(panel, "x")
    for panel in panels if narrow else panels[:1]:
        panel.set_yticks(heights, [i.input.name for i in bars])
        panel.invert_yaxis()
    return plain(figure)


def draw_replay(
    agent: AnyAgent,
    value_name: str,
    episode: Replay,
    inputs: Sequence[AgentInput],
    *,
    narrow: bool = False,
) -> plots.Figure:
    """Draw inputs, values and actions over the steps of an episode; `narrow` fits telephones."""
    drawn_inputs = [agent_input for agent_input in inputs if agent_input.is_used][:MOST_STRIPS]
    n_dimensions = min(episode.actions.shape[1], MOST_DIMENSIONS)
    n_strips = len(drawn_inputs) + 1 + n_dimensions  # inputs, the value, actions
    figure = plots.new_figure(plots.NARROW_WIDTH if narrow else plots.WIDTH, 0.6 + 0.85 * n_strips)
    panels = figure.subplots(n_strips, 1, sharex=True, squeeze=False)[:, 0]
    steps = np.arange(len(episode.values))
    line = "-" if len(steps) > 1 else "."
    for panel, agent_input in zip(panels, drawn_inputs, strict=False):
        numbers = agent_input.numbers(episode.states)
        drawn = "steps-post" if agent_input.has_symbols else "default"
        panel.plot(steps, numbers, line, color=plots.color_of(5), linewidth=1.0, drawstyle=drawn)
        _name_strip(panel, agent_input.name)
    values = panels[len(drawn_inputs)]
    values.plot(steps, episode.values, line, color=plots.color_of(0), linewidth=1.2)
    _name_strip(values, value_name)
    for d in range(n_dimensions):
        panel = panels[len(drawn_inputs) + 1 + d]
        drawn = "steps-post" if is_discrete(agent) else "default"
        actions = episode.actions[:, d]
        panel.plot(steps, actions, line, color=plots.color_of(1), linewidth=1.0, drawstyle=drawn)
        if is_discrete(agent):
            _whole_ticks(panel, actions)
        _name_strip(panel, "action" if n_dimensions == 1 else f"action {d}")
    panels[-1].set_xlabel("step", fontsize=9, color=plots.INK)
    return plain(figure)


def _name_strip(panel: plots.Axes, name: str) -> None:
    """Write what a panel of an episode shows above it, in small letters."""
    plots.style(panel)
    panel.tick_params(labelsize=7.5)
    panel.set_title(name, loc="left", fontsize=8.5, color=plots.FAINT, pad=2)


def plain(figure: plots.Figure) -> plots.Figure:
    """Return the figure with all texts as they are: dollar signs in names make no formulas."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_parse_math(False)
    return figure


# The functions behind `Agent.plot_values`, `plot_policy` and `plot_inputs`.


def states_of(agent: AnyAgent, source: Env | Elements, seed: int) -> States:
    """Return states met in an environment, or the observed variables of given observations."""
    seed_of(seed)
    if isinstance(source, gym.Env):
        require_same_kind(agent, source, "source")
        return meet_states(agent, source, seed)
    is_list = isinstance(source, Sequence | np.ndarray) and not isinstance(source, str | bytes)
    require(is_list, "source", "be an environment or a list of observations", source, TypeError)
    try:
        rows = np.array([agent.flat_observation(observation) for observation in source])
    except (TypeError, ValueError) as error:
        raise type(error)(f"source: {error}") from error
    require(len(rows) > 1, "source", "be an environment or at least two observations", source)
    return States(rows)


def map_for(
    agent: AnyAgent, source: Env | Elements, names: Sequence[str | int] | None, seed: int
) -> tuple[Reader, StateMap, Floats]:
    """Return the map over named inputs, by default over the two most influential ones."""
    reader = Reader(agent)
    inputs = inputs_of(agent)
    chosen = None if names is None else named_inputs(names, inputs)
    states = states_of(agent, source, seed)
    if chosen is None:
        chosen = [i.input for i in influences(reader, states, inputs, seed) if i.input.is_used][:2]
    return reader, map_of(reader, states, chosen, inputs), states.rows


def plot_values(
    agent: AnyAgent, source: Env | Elements, names: Sequence[str | int] | None, seed: int
) -> plots.Figure:
    """Draw the values of states; see `Agent.plot_values`."""
    reader, state_map, states = map_for(agent, source, names, seed)
    figure = plots.new_figure(5.0, 3.7)
    draw_values(figure.subplots(), reader.value_name, state_map, states)
    return plain(figure)


def plot_policy(
    agent: AnyAgent, source: Env | Elements, names: Sequence[str | int] | None, seed: int
) -> plots.Figure:
    """Draw greedy actions; see `Agent.plot_policy`."""
    _, state_map, states = map_for(agent, source, names, seed)
    n_dimensions = min(state_map.actions.shape[-1], MOST_DIMENSIONS)
    figure = plots.new_figure(5.0 * n_dimensions, 3.7)
    for d, panel in enumerate(figure.subplots(1, n_dimensions, squeeze=False)[0]):
        draw_policy(panel, agent, state_map, states, d)
    return plain(figure)


def plot_inputs(agent: AnyAgent, source: Env | Elements, seed: int) -> plots.Figure:
    """Draw the influence of each input; see `Agent.plot_inputs`."""
    inputs = inputs_of(agent)
    return draw_influences(influences(Reader(agent), states_of(agent, source, seed), inputs, seed))
