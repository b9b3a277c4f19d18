"""The results as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sdnn.runs.report import Table

if TYPE_CHECKING:
    from rich.console import Console

QUICK_WARNING = "QUICK LOOK: too few repetitions to mean anything."

_OF_THREADS = (("alone_s", 3), ("together_s", 3), ("speedup", 2))  # with their decimals
_DENSE_TITLES = {"numpy": "NumPy, 1 thread", "core": "sdnn's own kernel"}


def describe_run(results: Mapping[str, Any]) -> list[str]:
    """Describe machine, version and date in a few lines."""
    machine = results["machine"]
    caches = ", ".join(f"{name} {_size(size)}" for name, size in machine["caches"].items())
    in_use, best = results["instruction_set"], results["best_instruction_set"]
    return [
        *([QUICK_WARNING] if results["quick"] else []),
        f"{machine['processor']}, {machine['n_cores']} cores, {caches or 'caches unknown'}",
        f"instruction set in use: {in_use}; best available: {best}",
        f"{machine['system']}, Python {machine['python']}, NumPy {machine['numpy']}"
        f" with {machine['blas']}",
        f"sdnn {results['sdnn']}, {results['date']}",
    ]


def tables(results: Mapping[str, Any]) -> list[Table]:
    """Make all tables, from what the machine allows to whole trials."""
    networks, decisions, threads = results["networks"], results["decisions"], results["threads"]
    best = results["best_instruction_set"]
    return [
        Table(
            f"All {networks[0]['n_actions']} action values of a new state in one hidden pass, and a"
            " dense matrix-vector product of its size (us: median, quartiles)",
            ("inputs, weights", "computed by", "us", "against the quickest dense", "of the limit"),
            [row for network in networks for row in _pass_rows(network)],
        ),
        Table(
            "What the machine allows: the bytes a pass has to read, at the rate at which a buffer"
            " of the weights' size is read",
            ("inputs, weights", "MB weights", "MB read by a pass", "GB/s", "least us",
             f"us ({best})"),
            [
                (_size_of(one), f"{one['weight_bytes'] / 1e6:.2f}",
                 f"{one['pass_bytes'] / 1e6:.2f}", f"{one['gigabytes_per_second']:.0f}",
                 f"{one['least_time']:.1f}", f"{one['values'][best]['median']:.1f}")
                for one in networks
            ],
        ),
        _parts_table(results),
        Table(
            f"Whole decisions in the first {decisions[0]['n_episodes']} learning episodes (us):"
            " acting, acrobot, sensors, learning; each the median of"
            f" {decisions[0]['n_runs']} runs",
            ("inputs, noise", "decisions", "mean", "p50", "p99", "max", "max / p50"),
            [
                (f"{one['n_inputs']}, {one['noise']:g}", f"{one['n_decisions']:,}",
                 *(f"{one[name]:.1f}" for name in ("mean", "p50", "p99", "max", "max_over_p50")))
                for one in decisions
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


def print_results(results: Mapping[str, Any], console: Console) -> None:
    """Print all tables."""
    for line in describe_run(results):
        console.print(line, highlight=False)
    for table in tables(results):
        table.print(console)


def _pass_rows(network: Mapping[str, Any]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for level, ratio in network["ratio_to_dense"].items():
        quicker = f"{1 / ratio:.1f} x quicker" if ratio < 1 else f"{ratio:.1f} x slower"
        share = f"{network['share_of_limit'][level]:.0%}"
        rows.append((_size_of(network), level, _time(network["values"][level]), quicker, share))
    for name, product in network["dense"].items():
        title = f"dense float32: {_DENSE_TITLES[name]}"
        rows.append((_size_of(network), title, _time(product), "", ""))
    return rows


def _parts_table(results: Mapping[str, Any]) -> Table:
    networks, acrobot = results["networks"], results["acrobot"]
    in_use, n_corrected = results["instruction_set"], networks[0]["n_corrected"]
    physics = (
        f"acrobot, {acrobot['n_integration_steps']} Runge-Kutta steps"
        f" of {acrobot['integration_step_ns']:.0f} ns"
    )
    return Table(
        "The parts of a decision (us: median, quartiles)",
        ("part", *(f"{network['n_inputs']} inputs" for network in networks)),
        [
            ("values of a new state", *(_time(n["values"][in_use]) for n in networks)),
            ("values of a remembered state", *(_time(n["remembered_values"]) for n in networks)),
            (f"learning step, {n_corrected} units", *(_time(n["correction"]) for n in networks)),
            (f"selecting {n_corrected} units, in it", *(_time(n["selection"]) for n in networks)),
            (physics, _time(acrobot["decision"]), *("",) * (len(networks) - 1)),
        ],
    )


def _size_of(network: Mapping[str, Any]) -> str:
    return f"{network['n_inputs']}, {network['n_hidden_units']} x {network['n_columns']}"


def _time(times: Mapping[str, float]) -> str:
    digits = 1 if times["median"] >= 10 else 2
    lower, median, upper = (f"{times[q]:.{digits}f}" for q in ("lower", "median", "upper"))
    return f"{median} ({lower} - {upper})"


def _size(n_bytes: int) -> str:
    for unit, name in ((2**20, "MiB"), (2**10, "KiB")):
        if n_bytes >= unit:
            return f"{n_bytes / unit:g} {name}"
    return f"{n_bytes} B"
