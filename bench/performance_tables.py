"""Put the tables of benchmark runs into docs/evidence/performance.md.

    python bench/yardsticks.py > docs/evidence/performance.json
    python bench/performance_tables.py

The profile in docs/evidence/profile.json, made by bench/profile_trial.py, becomes the last table.
Of a run with AVX-512, docs/evidence/performance-avx512.json, the page has the passes only.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from page import markdown, show

from sdnn.benchmarks.report import describe_run, tables, time_words
from sdnn.runs.report import Table

EVIDENCE = Path(__file__).parents[1] / "docs" / "evidence"
PAGE = EVIDENCE / "performance.md"
DENSE_TITLES = {"numpy": "NumPy, 1 thread", "core": "sdnn's own kernel"}


def stored(name: str) -> dict[str, Any]:
    """Read what a command printed."""
    found: dict[str, Any] = json.loads((EVIDENCE / f"{name}.json").read_text())
    return found


def to_markdown(results: dict[str, Any], *, passes_only: bool = False) -> str:
    """Return the tables of a run, after the lines that say on what was measured."""
    machine = results["machine"]
    caches = ", ".join(f"{name} {_size(size)}" for name, size in machine["caches"].items())
    lines = [*describe_run(results), f"caches: {caches}; NumPy's products by {machine['blas']}"]
    about = "".join(f"- {line}\n" for line in lines)
    shown = [*yardstick_tables(results), *([] if passes_only else tables(results))]
    return "\n".join([about, *map(_titled, shown)])


def yardstick_tables(results: Mapping[str, Any]) -> Iterator[Table]:
    """Make the tables of passes beside what they are compared with."""
    networks, best = results["networks"], results["best_instruction_set"]
    yield Table(
        f"All {networks[0]['n_actions']} action values of a new state in one hidden pass, and a"
        " dense matrix-vector product of its size (us: median, quartiles)",
        ("inputs, weights", "computed by", "us", "against the quickest dense", "of the limit"),
        [row for network in networks for row in _pass_rows(network)],
    )
    yield Table(
        "What the machine allows: the bytes a pass has to read, at the rate at which a buffer"
        " of the weights' size is read",
        ("inputs, weights", "MB weights", "MB read by a pass", "GB/s", "least us", f"us ({best})"),
        [
            (_size_of(one), f"{one['weight_bytes'] / 1e6:.2f}",
             f"{one['pass_bytes'] / 1e6:.2f}", f"{one['gigabytes_per_second']:.0f}",
             f"{one['least_time']:.1f}", f"{one['values'][best]['median']:.1f}")
            for one in networks
        ],
    )  # fmt: skip


def _pass_rows(network: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for level, ratio in network["ratio_to_dense"].items():
        quicker = f"{1 / ratio:.1f} x quicker" if ratio < 1 else f"{ratio:.1f} x slower"
        share = f"{network['share_of_limit'][level]:.0%}"
        yield (_size_of(network), level, time_words(network["values"][level]), quicker, share)
    for name, product in network["dense"].items():
        yield (
            _size_of(network),
            f"dense float32: {DENSE_TITLES[name]}",
            time_words(product),
            "",
            "",
        )


def _size_of(network: Mapping[str, Any]) -> str:
    return f"{network['n_inputs']}, {network['n_hidden_units']} x {network['n_columns']}"


def _size(n_bytes: int) -> str:
    unit, name = (2**20, "MiB") if n_bytes >= 2**20 else (2**10, "KiB")
    return f"{n_bytes / unit:g} {name}"


def _titled(table: Table) -> str:
    return f"**{table.title}**\n\n{markdown(table.header, table.rows)}"


def profile_table(profile: dict[str, dict[str, float]]) -> Table:
    """Return functions by their share of the time, one column for each trial."""
    functions = sorted(
        {name for shares in profile.values() for name in shares},
        key=lambda name: -sum(shares.get(name, 0.0) for shares in profile.values()),
    )
    rows = [
        (f"`{name}`", *(f"{of[name]:.1f}" if name in of else "" for of in profile.values()))
        for name in functions
    ]
    title = "Where a trial's time goes (per cent of samples; below 1 left out)"
    return Table(title, ("function", *profile), rows)


def page_tables() -> dict[str, str]:
    """Return each table of stored runs by its name in the page."""
    profile = _titled(profile_table(stored("profile")))
    return {
        "performance": f"{to_markdown(stored('performance'))}\n{profile}",
        "performance-avx512": to_markdown(stored("performance-avx512"), passes_only=True),
    }


if __name__ == "__main__":
    show(page_tables(), PAGE)
