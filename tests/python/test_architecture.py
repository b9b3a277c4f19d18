"""The C++ headers and Python packages: dependencies point down and are few.

The layers of the Python package are contracts in pyproject.toml (``nox -s style``); cycles and
missing includes of headers are found by clang-tidy (``nox -s tidy``).
"""

import graphlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
INCLUDE = ROOT / "cpp" / "include" / "sdnn"
LAYERS = {
    "core": 0, "coding": 1, "approximators": 2, "agents": 3, "estimators": 3, "environments": 3,
}  # fmt: skip
"""Packages may include those of smaller numbers, and environments core only."""

NOT_IN_UMBRELLA = {
    "agents/agent_file.hpp", "agents/compiled_controller.hpp", "core/safetensors.hpp",
    "estimators/libsdnn.hpp",
}  # fmt: skip
"""The reader of LIBSDNN's files, and what needs a library for JSON, or one to link to."""


def headers():
    return sorted(path.relative_to(INCLUDE) for path in INCLUDE.glob("*/**/*.hpp"))


def includes(header):
    """Return the headers of the library that a header includes, by their paths below it."""
    text = (INCLUDE / header).read_text("utf-8")
    return [Path(name) for name in re.findall(r'^#include "sdnn/(.+)"', text, re.MULTILINE)]


def test_headers_include_lower_layers_only():
    wrong = []
    for header in headers():
        for included in includes(header):
            package, other = header.parts[0], included.parts[0]
            is_allowed = package == other or LAYERS[other] < LAYERS[package]
            if not is_allowed or (package == "environments" and other not in (package, "core")):
                wrong.append(f"{header} includes {included}")
    assert len(headers()) > 80
    assert wrong == []


def test_the_umbrella_header_includes_every_public_header():
    public = {header.as_posix() for header in headers() if "detail" not in header.parts}
    assert {path.as_posix() for path in includes("sdnn.hpp")} == public - NOT_IN_UMBRELLA


def test_headers_with_floating_point_include_the_check_of_compiler_options():
    guard = Path("core/detail/floating_point.hpp")

    def reached(header, visited):
        """Return all headers that a header includes, directly or by others."""
        for included in includes(header):
            if included not in visited:
                visited.add(included)
                reached(included, visited)
        return visited

    unguarded = [
        header
        for header in headers()
        if re.search(r"\b(double|float)\b", (INCLUDE / header).read_text("utf-8"))
        if header != guard and guard not in reached(header, set())
    ]
    assert unguarded == []


@pytest.fixture(scope="module")
def imports():
    """Return the graph of all imports, those for types too."""
    grimp = pytest.importorskip("grimp", reason="pip install import-linter")
    return grimp.build_graph("sdnn", cache_dir=None)


def arrows_between_children(graph, package):
    """Return which children of a package import which others, ``{child: {child, ...}}``."""
    children = graph.find_children(package)
    arrows = {child: set() for child in children}

    def child_of(module):
        return next((c for c in children if f"{module}.".startswith(f"{c}.")), None)

    for module in graph.modules:
        for imported in graph.find_modules_directly_imported_by(module):
            importer, target = child_of(module), child_of(imported)
            if importer and target and importer != target:
                arrows[importer].add(target)
    return arrows


def test_the_package_graph_has_few_packages_and_imports(imports):
    arrows = arrows_between_children(imports, "sdnn")  # lower the limits where they can be lower
    assert len(arrows) <= 18
    assert sum(map(len, arrows.values())) <= 55


def test_packages_do_not_import_each_other_in_circles(imports):
    packages = [module for module in imports.modules if imports.find_children(module)]
    assert len(packages) > 10
    for package in packages:
        arrows = arrows_between_children(imports, package)
        graphlib.TopologicalSorter(arrows).prepare()  # raises CycleError with the circle


@pytest.mark.parametrize("pattern", ["python/sdnn/**/*.py", "cpp/**/*.[ch]pp"])
def test_source_files_have_at_most_450_lines(pattern):
    lengths = {path: len(path.read_text("utf-8").splitlines()) for path in ROOT.glob(pattern)}
    assert len(lengths) > 50
    assert {path.name for path, n_lines in lengths.items() if n_lines > 450} == set()
