"""The C++ headers: includes point down, and the umbrella has what is public.

The layers of the Python package are contracts in pyproject.toml (``nox -s style``); cycles and
missing includes of headers are found by clang-tidy (``nox -s tidy``).
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
INCLUDE = ROOT / "cpp" / "include" / "sdnn"
LAYERS = {
    "core": 0, "coding": 1, "approximators": 2, "agents": 3, "estimators": 3, "environments": 3,
}  # fmt: skip
"""Packages may include those of smaller numbers, and environments core only."""

NOT_IN_UMBRELLA = {
    "agents/agent_file.hpp", "agents/saved_agent.hpp", "core/safetensors.hpp",
    "estimators/libsdnn.hpp",
}  # fmt: skip
"""The reader of LIBSDNN's files, and what needs a library for JSON, or one to link to."""


def headers():
    return sorted(path.relative_to(INCLUDE) for path in INCLUDE.glob("*/**/*.hpp"))


def includes(header):
    text = (INCLUDE / header).read_text("utf-8")
    return [Path(name) for name in re.findall(r'^#include "sdnn/(.+)"', text, re.MULTILINE)]


def test_includes_point_down():
    wrong = [
        f"{header} includes {included}"
        for header in headers()
        for included in includes(header)
        if (here := header.parts[0]) != (there := included.parts[0])
        if LAYERS[there] >= LAYERS[here] or (here == "environments" and there != "core")
    ]
    assert len(headers()) > 80
    assert wrong == []


def test_the_umbrella_includes_what_is_public():
    public = {header.as_posix() for header in headers() if "detail" not in header.parts}
    assert {path.as_posix() for path in includes("sdnn.hpp")} == public - NOT_IN_UMBRELLA


def test_headers_with_floating_point_refuse_options_that_change_results():
    guard = Path("core/detail/floating_point.hpp")

    def reached(header, seen):
        for included in includes(header):
            if included not in seen:
                seen.add(included)
                reached(included, seen)
        return seen

    unguarded = [
        header
        for header in headers()
        if re.search(r"\b(double|float)\b", (INCLUDE / header).read_text("utf-8"))
        if header != guard and guard not in reached(header, set())
    ]
    assert unguarded == []
