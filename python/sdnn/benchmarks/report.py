"""The results as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from sdnn.reports.pages import Table

Results: TypeAlias = Mapping[str, Any]
"""The results of `sdnn.benchmarks.run_benchmarks`."""

QUICK_WARNING = "QUICK LOOK: too few repetitions to mean anything."

_OF_THREADS = (("alone_s", 3), ("together_s", 3), ("speedup", 2))  # columns and decimals


def describe_run(results: Results) -> list[str]:
    """Describe machine, version and date in a few lines."""
    machine = results["machine"]
    in_use, best = results["instruction_set"], results["best_instruction_set"]
    return [
        *([QUICK_WARNING] if results["quick"] else []),
        f"{machine['processor']}, {machine['n_cores']} cores",
        f"instruction set in use: {in_use}; best available: {best}",
        f"{machine['system']}, Python {machine['python']}, NumPy {machine['numpy']}",
        f"sdnn {results['sdnn']}, {results['date']}",
    ]


def tables(results: Results) -> list[Table]:
    """Make all tables, from the parts of a decision to whole trials."""
    decisions, threads = results["decisions"], results["threads"]
    return [
        _parts_table(results),
        Table(
            f"Whole decisions in the first {decisions[0]['n_episodes']} learning episodes (us):"
            " acting, acrobot, sensors, learning; each the median of"
            f" {decisions[0]['n_runs']} runs",
            ("inputs, noise", "decisions", "mean", "p50", "p99", "max", "max / p50"),
            [
                (f"{times['n_inputs']}, {times['noise']:g}", f"{times['n_decisions']:,}",
                 *(f"{times[name]:.1f}" for name in ("mean", "p50", "p99", "max", "max_over_p50")))
                for times in decisions
            ],
        ),
        Table(
            f"Trials at once ({threads['n_inputs']} inputs, noise {threads['noise']:g},"
            f" {threads['n_episodes']} episodes each)",
            ("trials", "one alone, s", "all at once, s", "speedup", "core seconds each"),
            [(f"{threads['n_threads']} on {threads['n_threads']} threads",
              *(f"{threads[name]:.{n}f}" for name, n in _OF_THREADS),
              f"{threads['processor_alone_s']:.3f} alone,"
              f" {threads['processor_together_s']:.3f} at once")],
        ),
    ]  # fmt: skip


def _parts_table(results: Results) -> Table:
    """Return the table of the times of each part of a decision, with a column for each network."""
    networks, acrobot = results["networks"], results["acrobot"]
    n_actions, n_corrected = networks[0]["n_actions"], networks[0]["n_corrected"]
    levels = results["instruction_sets"]
    times: dict[str, list[Mapping[str, float]]] = {
        **{
            f"all {n_actions} values of a new state, {level}": [
                n["values"][level] for n in networks
            ]
            for level in levels
        },
        "values of a remembered state": [n["remembered_values"] for n in networks],
        f"learning step, {n_corrected} units": [n["correction"] for n in networks],
        f"selecting {n_corrected} units, in it": [n["selection"] for n in networks],
        f"acrobot, {acrobot['n_integration_steps']} Runge-Kutta steps"
        f" of {acrobot['integration_step_ns']:.0f} ns": [acrobot["decision"]],
    }
    return Table(
        "The parts of a decision (us: median, quartiles)",
        ("part", *(f"{network['n_inputs']} inputs" for network in networks)),
        [
            (part, *map(time_words, row), *[""] * (len(networks) - len(row)))
            for part, row in times.items()
        ],
    )


def time_words(times: Mapping[str, float]) -> str:
    """Write a median with its quartiles."""
    digits = 1 if times["median"] >= 10 else 2
    lower, median, upper = (f"{times[q]:.{digits}f}" for q in ("lower", "median", "upper"))
    return f"{median} ({lower} - {upper})"
