"""Put the tables of benchmark runs into docs/evidence/performance.md.

    python bench/yardsticks.py > docs/evidence/performance.json
    python bench/performance_tables.py

Passes and profile in docs/evidence/ are those that bench/profile_trial.py measured.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from page import markdown, show

from sdnn.benchmarks.report import describe_run, tables, time_words
from sdnn.reports.pages import Table

EVIDENCE = Path(__file__).parents[1] / "docs" / "evidence"
PAGE = EVIDENCE / "performance.md"
PEERS = {
    "q-lambda": "SDNNQLambda", "actor-critic": "SDNNActorCritic", "sdnn-c": "SDNN-C",
    "rbf": "RBFN", "tiles": "tile coding", "tiles-pairs": "tiles of pairs",
    "swift-sarsa": "Swift-Sarsa", "stream-ac": "stream AC", "stream-q": "stream Q",
}  # fmt: skip
DENSE_TITLES = {"numpy": "NumPy, 1 thread", "core": "sdnn's own kernel"}


def stored(name: str) -> dict[str, Any]:
    """Read what a command printed."""
    measured: dict[str, Any] = json.loads((EVIDENCE / f"{name}.json").read_text())
    return measured


def to_markdown(results: dict[str, Any]) -> str:
    """Return the tables of a run, after the lines that say on what was measured."""
    machine = results["machine"]
    caches = ", ".join(f"{name} {_size(size)}" for name, size in machine["caches"].items())
    lines = [*describe_run(results), f"caches: {caches}; NumPy's products by {machine['blas']}"]
    about = "".join(f"- {line}\n" for line in lines)
    parts, *others = tables(results)
    # The first table has the passes, "all ... values".
    parts = replace(parts, rows=[row for row in parts.rows if not row[0].startswith("all ")])
    return "\n".join([about, *map(_titled, [dense_table(results), parts, *others])])


def dense_table(results: Mapping[str, Any]) -> Table:
    """Return new states beside dense products of their size."""
    networks = results["networks"]
    return Table(
        f"All {networks[0]['n_actions']} action values of a new state in one hidden pass, and a"
        " dense matrix-vector product of its size (us: median, quartiles)",
        ("inputs, weights", "computed by", "us", "against the quickest dense"),
        [row for network in networks for row in _pass_rows(network)],
    )


def passes_table(passes: list[dict[str, Any]]) -> Table:
    """Return passes of networks that learned for a while beside loads of the lines they read."""
    rows = [
        (f"{times['inputs']}", f"{times['episodes']:,}", times["level"],
         *(f"{times[name]:.1f}" for name in ("pass", "plain_loads")),
         f"{times['plain_loads'] / times['pass']:.0%}")
        for times in passes
        if times["level"] != "portable"
    ]  # fmt: skip
    return Table(
        "A pass beside plain loads of the lines that it reads (us, median)",
        ("inputs", "noisy episodes", "by", "pass", "loads", "loads / pass"),
        rows,
    )


def _pass_rows(network: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for level, ratio in network["ratio_to_dense"].items():
        quicker = f"{1 / ratio:.1f} x quicker" if ratio < 1 else f"{ratio:.1f} x slower"
        yield (_size_of(network), level, time_words(network["values"][level]), quicker)
    for name, product in network["dense"].items():
        yield (
            _size_of(network),
            f"dense float32: {DENSE_TITLES[name]}",
            time_words(product),
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
        {name for shares in profile.values() for name, share in shares.items() if share >= 3},
        key=lambda name: (-sum(shares.get(name, 0.0) for shares in profile.values()), name),
    )
    rows = [
        (f"`{name}`", *(f"{of[name]:.1f}" if name in of else "" for of in profile.values()))
        for name in functions
    ]
    title = "Where a trial's time goes (per cent of samples; functions of at least 3)"
    return Table(title, ("function", *profile), rows)


def peers_tables(peers: Mapping[str, Any]) -> list[Table]:
    """Return steps of agents and environments, and estimators, measured in one run."""
    tasks = peers["steps"]
    rows = [
        (PEERS.get(name, f"{name} at once"), *(f"{of[name]:.1f}" for of in tasks.values()))
        for name in next(iter(tasks.values()))
    ]
    about = f"{peers['machine']}, load {peers['load']}, {peers['date']}"
    title = f"A step (us; agents without the environment; {about})"
    models = [
        (name, f"{of['fit_s']:.3g}", f"{of['one_us']:.0f}", f"{of['many_us']:.2g}",
         f"{of['r2']:.3f}")
        for name, of in peers["estimators"].items()
    ]  # fmt: skip
    header = ("model", "fit, s", "one row, us", "a row of many, us", "R2")
    return [
        Table(title, ("by", *tasks), rows),
        Table("Estimators, 1,000 rows of Friedman's problem", header, models),
    ]


def page_tables() -> dict[str, str]:
    """Return each table of stored runs by its name in the page."""
    shown = (passes_table(stored("passes")), profile_table(stored("profile")))
    return {
        "performance": to_markdown(stored("performance")),
        "passes and profile": "\n".join(map(_titled, shown)),
        "peers": "\n".join(map(_titled, peers_tables(stored("peers")))),
    }


if __name__ == "__main__":
    show(page_tables(), PAGE)
