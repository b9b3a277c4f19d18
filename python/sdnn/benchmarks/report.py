"""The results as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from sdnn.benchmarks.results import DecisionsResult, NetworkResult, Results, Spread

QUICK_WARNING = "QUICK LOOK: too few repetitions to mean anything."

_CACHE_UNITS = ((2**20, "MiB"), (2**10, "KiB"))
_DENSE_TITLES = {"numpy": "NumPy, 1 thread", "core": "sdnn's own kernel"}


@dataclass(frozen=True)
class Table:
    """A table as text.

    Parameters
    ----------
    title
        What it shows.
    header
        One word per column; the first column names the row.
    rows
        Cells.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def describe_run(results: Results) -> list[str]:
    """Say on what was measured, and when: a few lines."""
    machine = results["machine"]
    caches = ", ".join(f"{name} {_size(size)}" for name, size in machine["caches"].items())
    in_use, best = results["instruction_set"], results["best_instruction_set"]
    lines = [
        f"{machine['processor']}, {machine['n_cores']} cores, {caches or 'caches unknown'}",
        f"instruction set in use: {in_use}; best available: {best}",
        f"{machine['system']}, Python {machine['python']}, NumPy {machine['numpy']}"
        f" with {machine['blas']}",
        f"sdnn {results['sdnn']}, {results['date']}",
    ]
    return [QUICK_WARNING, *lines] if results["quick"] else lines


def tables(results: Results) -> list[Table]:
    """Make all tables, from what the machine allows to whole trials."""
    return [
        _pass_table(results["networks"]),
        _limit_table(results["networks"], results["best_instruction_set"]),
        _parts_table(results),
        _decisions_table(results["decisions"]),
        _threads_table(results),
    ]


def print_results(results: Results, console: Console) -> None:
    """Print all tables."""
    from rich.table import Table as RichTable

    for line in describe_run(results):
        console.print(line, highlight=False)
    for table in tables(results):
        shown = RichTable(title=table.title, title_justify="left")
        for number, word in enumerate(table.header):
            shown.add_column(word, justify="right" if number else "left")
        for row in table.rows:
            shown.add_row(*row)
        console.print()
        console.print(shown)


def _pass_table(networks: Sequence[NetworkResult]) -> Table:
    rows = []
    for network in networks:
        for level, ratio in network["ratio_to_dense"].items():
            share = network["share_of_limit"][level]
            values = network["values"][level]
            quicker = f"{1 / ratio:.1f} x quicker" if ratio < 1 else f"{ratio:.1f} x slower"
            rows.append((_size_of(network), level, _time(values), quicker, f"{share:.0%}"))
        for name, product in network["dense"].items():
            title = f"dense float32: {_DENSE_TITLES[name]}"
            rows.append((_size_of(network), title, _time(product), "", ""))
    return Table(
        f"All {networks[0]['n_actions']} action values of a new state in one hidden pass, and a"
        " dense matrix-vector product of its size (us: median, quartiles)",
        ("inputs, weights", "computed by", "us", "against the quickest dense", "of the limit"),
        tuple(rows),
    )


def _limit_table(networks: Sequence[NetworkResult], best: str) -> Table:
    return Table(
        "What the machine allows: the bytes a pass has to read, at the rate at which a buffer of"
        " the weights' size is read",
        ("inputs, weights", "MB weights", "MB read by a pass", "GB/s", "least us", f"us ({best})"),
        tuple(
            (
                _size_of(network),
                f"{network['weight_bytes'] / 1e6:.2f}",
                f"{network['pass_bytes'] / 1e6:.2f}",
                f"{network['gigabytes_per_second']:.0f}",
                f"{network['least_time']:.1f}",
                f"{network['values'][best]['median']:.1f}",
            )
            for network in networks
        ),
    )


def _parts_table(results: Results) -> Table:
    networks, acrobot = results["networks"], results["acrobot"]
    in_use = results["instruction_set"]
    n_corrected = networks[0]["n_corrected"]
    shared = ("",) * (len(networks) - 1)
    rows = (
        ("values of a new state", *(_time(n["values"][in_use]) for n in networks)),
        ("values of a remembered state", *(_time(n["remembered_values"]) for n in networks)),
        (f"learning step, {n_corrected} units", *(_time(n["correction"]) for n in networks)),
        (f"selecting {n_corrected} units, in it", *(_time(n["selection"]) for n in networks)),
        (
            f"acrobot, {acrobot['n_integration_steps']} Runge-Kutta steps"
            f" of {acrobot['integration_step_ns']:.0f} ns",
            _time(acrobot["decision"]),
            *shared,
        ),
    )
    return Table(
        "The parts of a decision (us: median, quartiles)",
        ("part", *(f"{network['n_inputs']} inputs" for network in networks)),
        rows,
    )


def _decisions_table(decisions: Sequence[DecisionsResult]) -> Table:
    first = decisions[0]
    return Table(
        f"Whole decisions in the first {first['n_episodes']} learning episodes (us): acting,"
        f" acrobot, sensors, learning; each the median of {first['n_runs']} runs",
        ("inputs, noise", "decisions", "mean", "p50", "p99", "max", "max / p50"),
        tuple(
            (
                f"{case['n_inputs']}, {case['noise']:g}",
                f"{case['n_decisions']:,}",
                *(f"{case[name]:.1f}" for name in ("mean", "p50", "p99", "max", "max_over_p50")),
            )
            for case in decisions
        ),
    )


def _threads_table(results: Results) -> Table:
    threads = results["threads"]
    return Table(
        f"Trials at once ({threads['n_inputs']} inputs, noise {threads['noise']:g},"
        f" {threads['n_episodes']} episodes each)",
        ("trials", "one alone, s", "all at once, s", "speedup", "core seconds each"),
        (
            (
                f"{threads['n_threads']} on {threads['n_threads']} threads",
                f"{threads['alone_s']:.3f}",
                f"{threads['together_s']:.3f}",
                f"{threads['speedup']:.2f}",
                f"{threads['processor_alone_s']:.3f} alone,"
                f" {threads['processor_together_s']:.3f} at once",
            ),
        ),
    )


def _size_of(network: NetworkResult) -> str:
    return f"{network['n_inputs']}, {network['n_hidden_units']} x {network['n_columns']}"


def _time(times: Spread) -> str:
    digits = 1 if times["median"] >= 10 else 2
    lower, median, upper = (f"{times[q]:.{digits}f}" for q in ("lower", "median", "upper"))
    return f"{median} ({lower} - {upper})"


def _size(n_bytes: int) -> str:
    for unit, name in _CACHE_UNITS:
        if n_bytes >= unit:
            return f"{n_bytes / unit:g} {name}"
    return f"{n_bytes} B"
