"""How the network's cost grows with the number of inputs.

    python bench/cost_of_inputs.py [--only WORD] [--redraw]

Measures what the store lacks and draws docs/evidence/cost-of-inputs.png. The paper's claim is
quadratic growth: the network has l (l - 1) groups of columns. The fit leaves out the networks that
are too large for their place in a shared last-level cache.
"""

from __future__ import annotations

import numpy as np
from measured import measure_missing, measured, options

from sdnn import _core
from sdnn.approximators import SDNNCConfig
from sdnn.benchmarks.measurements import Effort, in_turns, measure_decisions, spread
from sdnn.reports.plots import png_bytes
from sdnn.support.files import write_whole

KIND = "cost of inputs"
N_INPUTS = range(2, 11)
N_CORRECTED = 5
LARGEST_FITTED = 7
"""Inputs up to which a quadratic is fitted: 8 MB of weights."""

LEARNING_STEPS = 500
EFFORT = Effort(n_rounds=40, n_repetitions=10, n_episodes=300, n_runs=5)
NOISE = 0.02
SEED = 1

PARTS = {
    "values": ("all action values of a new state", "#1f5a96", "o"),
    "decision": ("the same and a learning step", "#c2542d", "s"),
    "trial": ("a whole decision in a noisy trial", "#3c7d4b", "D"),
}
N_SENSORS = (4, 5, 6)
"""Inputs of the trials."""


def measure(part, n_inputs):
    """Return the network's columns and the quartiles of its time; of trials, three equal means."""
    n_columns = SDNNCConfig().n_pattern_units * n_inputs * (n_inputs - 1)
    if part == "trial":
        times = [measure_decisions(n_inputs, NOISE, EFFORT)["mean"]] * 3
    else:
        times = spread(in_turns({part: timer(part, n_inputs)}, EFFORT)[part]).values()
    quartiles = zip(("lower_us", "median_us", "upper_us"), times, strict=True)
    return {"n_columns": n_columns, **{name: round(us, 3) for name, us in quartiles}}


def timer(part, n_inputs):
    """Return a function that times a part of a network that has learned a little."""
    config = SDNNCConfig(n_inputs=n_inputs)
    rng = np.random.default_rng(SEED)
    network = _core.SDNNC(config, SEED)
    for _ in range(LEARNING_STEPS):
        target = float(rng.uniform(config.q_low, config.q_high))
        network.update(rng.random(n_inputs), int(rng.integers(network.n_actions)), target)
    parts = _core.NetworkParts(network, SEED)
    if part == "values":
        return parts.time_values
    return lambda n: parts.time_values(n) + parts.time_corrections(n, N_CORRECTED)


def draw(results, path):
    """Draw the figure from the measurements."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.6), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for part, (title, color, marker) in PARTS.items():
        rows = {n_inputs: row for (name, n_inputs), row in results.items() if name == part}
        x = np.array(list(rows))
        lower, y, upper = (
            np.array([row[f"{quartile}_us"] for row in rows.values()])
            for quartile in ("lower", "median", "upper")
        )
        if len(x) > 3:
            fitted = x <= LARGEST_FITTED
            square, line, constant = coefficients = np.polyfit(x[fitted], y[fitted], 2)
            residual = y[fitted] - np.polyval(coefficients, x[fitted])
            explained = 1 - residual.var() / y[fitted].var()
            title += (
                f"\n   {square:.2f} l² {line:+.1f} l {constant:+.1f}"
                f"  (fit to l ≤ {LARGEST_FITTED}, R² = {explained:.4f})"
            )
            for ends, style in (((x[0], LARGEST_FITTED), "-"), ((LARGEST_FITTED, x[-1]), ":")):
                fine = np.linspace(*ends, 100)
                axes.plot(fine, np.polyval(coefficients, fine), style, color=color, linewidth=1.2)
            axes.errorbar(
                x, y, (y - lower, upper - y), color=color, fmt=marker, capsize=3, label=title
            )
        else:
            axes.plot(x, y, color=color, marker=marker, linestyle="none", label=title)
    axes.set_xlabel("number of inputs l")
    axes.set_ylabel("µs (median, quartiles)")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="upper left", fontsize=9)
    axes.set_title(
        "Cost against the number of inputs, 200 (l² - l) columns x 900 units", fontsize=10
    )
    write_whole(path, png_bytes(figure))


def main():
    arguments = options(__doc__, seeds=1).parse_args()
    keys = [(part, n) for part in ("values", "decision") for n in N_INPUTS]
    measure_missing(KIND, measure, [*keys, *(("trial", n) for n in N_SENSORS)], arguments)
    if not arguments.only:
        draw(measured(KIND, arguments.folder), arguments.folder / "cost-of-inputs.png")


if __name__ == "__main__":
    main()
