"""How the network's cost grows with the number of inputs: python bench/cost_of_inputs.py.

Measures, writes docs/cost-of-inputs.csv and draws docs/cost-of-inputs.png from it; with --redraw
only draws. The paper's claim is quadratic growth: the network has l (l - 1) groups of columns. The
fit leaves out the networks that are too large for their place in a shared last-level cache.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from sdnn import _core
from sdnn.approximators import SDNNCConfig
from sdnn.benchmarks.measurements import Effort, in_turns, measure_decisions, spread

DOCS = Path(__file__).parents[1] / "docs"
ROWS = DOCS / "cost-of-inputs.csv"
FIGURE = DOCS / "cost-of-inputs.png"

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


def measure():
    """Rows of (part, number of inputs, columns, quartiles in microseconds)."""
    rows = []
    for n_inputs in N_INPUTS:
        config = SDNNCConfig(n_inputs=n_inputs)
        rng = np.random.default_rng(SEED)
        network = _core.SDNNC(config, SEED)
        for _ in range(LEARNING_STEPS):
            target = float(rng.uniform(config.q_low, config.q_high))
            network.update(rng.random(n_inputs), int(rng.integers(network.n_actions)), target)
        parts = _core.NetworkParts(network, SEED)

        def decide(n, parts=parts):
            return parts.time_values(n) + parts.time_corrections(n, N_CORRECTED)

        times = in_turns({"values": parts.time_values, "decision": decide}, EFFORT)
        n_columns = config.n_pattern_units * n_inputs * (n_inputs - 1)
        rows += [
            (part, n_inputs, n_columns, *spread(taken).values()) for part, taken in times.items()
        ]
        print(*(f"{cell:.1f}" if isinstance(cell, float) else cell for cell in rows[-1]))
    for n_inputs in N_SENSORS:
        mean = measure_decisions(n_inputs, NOISE, EFFORT)["mean"]
        rows.append(("trial", n_inputs, 200 * n_inputs * (n_inputs - 1), mean, mean, mean))
    return rows


def write(rows):
    """Store the rows."""
    with ROWS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("part", "n_inputs", "n_columns", "lower_us", "median_us", "upper_us"))
        writer.writerows(
            [cell if not isinstance(cell, float) else f"{cell:.3f}" for cell in row] for row in rows
        )


def draw():
    """Draw the figure from the stored rows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with ROWS.open() as file:
        rows = list(csv.DictReader(file))
    figure = Figure(figsize=(7.2, 4.6), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for part, (title, color, marker) in PARTS.items():
        own = [row for row in rows if row["part"] == part]
        x = np.array([int(row["n_inputs"]) for row in own])
        lower, y, upper = (
            np.array([float(row[f"{quartile}_us"]) for row in own])
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
    figure.savefig(FIGURE)


def main():
    """Read the options."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--redraw", action="store_true", help="only draw, from the stored rows")
    if not parser.parse_args().redraw:
        write(measure())
    draw()
    print(f"wrote {ROWS} and {FIGURE}")


if __name__ == "__main__":
    main()
