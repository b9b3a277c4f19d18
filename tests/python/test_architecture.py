"""The house: arrows point down only, and every thing is where its name says."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
INCLUDE = ROOT / "cpp" / "include" / "sdnn"
BINDINGS = ROOT / "cpp" / "bindings"
PACKAGE = ROOT / "python" / "sdnn"
CPP_TESTS = ROOT / "tests" / "cpp"

FLOORS = (
    ("core",),
    ("coding",),
    ("approximators",),
    ("agents", "environments", "estimators"),
    ("experiments",),
    ("benchmarks",),
    ("sdnn",),
)
"""Rooms of one floor do not know each other; the roof is the umbrella, the package, the command."""

WINGS = {"environments": {"core"}}
"""Rooms that stand on less than all the floors below them."""

PYTHON_MODULES = {
    "__init__": "sdnn",
    "__main__": "sdnn",
    "cli": "sdnn",
    "arguments": "core",
    "config": "core",
    "kernel": "coding",
    "instruction_sets": "core",
    "whole_files": "core",
}
"""The room of every module at the top of the Python package."""

SHARED_BINDINGS = {"core", "coding"}
"""Bound rooms without a Python room of their own: any room may use them."""

ON_REQUEST = {"benchmarks"}
"""Rooms that the umbrella leaves out: a controller has no use for them."""

FLOOR_OF = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}


def fault_of_arrow(room, target):
    """What is wrong with ``room`` using ``target``; None if nothing is."""
    for name in (room, target):
        if name not in FLOOR_OF:
            return f"{name} is not listed in FLOORS"
    if room == target:
        return None
    if FLOOR_OF[target] >= FLOOR_OF[room]:
        return f"{room} must not use {target}: arrows point down only"
    if target not in WINGS.get(room, {target}):
        return f"{room} may use {', '.join(sorted(WINGS[room]))} only, not {target}"
    return None


def faults(arrows):
    return [f"{place}: {fault}" for place, *arrow in arrows if (fault := fault_of_arrow(*arrow))]


def headers():
    return sorted(INCLUDE.rglob("*.hpp"))


def room_of_header(path):
    return path.relative_to(INCLUDE).parts[0] if path.parent != INCLUDE else "sdnn"


def includes(path):
    return re.findall(r'^\s*#\s*include\s*["<]([^">]+)[">]', path.read_text(), re.MULTILINE)


def cpp_arrows():
    for path in headers():
        for included in includes(path):
            parts = included.split("/")
            if parts[0] == "sdnn":
                target = parts[1] if len(parts) > 2 else "sdnn"
                yield path.relative_to(ROOT), room_of_header(path), target


def python_files():
    return sorted(PACKAGE.rglob("*.py"))


def room_of_module(path):
    relative = path.relative_to(PACKAGE)
    if len(relative.parts) > 1:
        return relative.parts[0]
    return PYTHON_MODULES.get(relative.stem, relative.stem)


def imported_modules(tree, path):
    """Dotted names below ``sdnn`` that a module imports, "" for the package itself."""
    here = path.relative_to(PACKAGE).parts[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for name in node.names:
                top, _, rest = name.name.partition(".")
                if top == "sdnn":
                    yield rest
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                base = ".".join(here[: len(here) - node.level + 1])
                module = ".".join(part for part in ("sdnn", base, module) if part)
            top, _, rest = module.partition(".")
            if top == "sdnn":
                yield from [rest] if rest else [name.name for name in node.names]


def python_arrows():
    known = {path.stem for path in PACKAGE.glob("*.py")} | {path.name for path in PACKAGE.iterdir()}
    for path in python_files():
        for module in imported_modules(ast.parse(path.read_text()), path):
            top = module.partition(".")[0]
            if top == "_core":
                continue
            target = PYTHON_MODULES.get(top, top) if top in known else "sdnn"
            yield path.relative_to(ROOT), room_of_module(path), target


def core_names():
    """The room that binds each name of ``_core``, read from bind_<room>.cpp."""
    pattern = re.compile(
        r'(?:(?:py::(?:class_|enum_)|bind_config)<[^;{}"]*?>\s*\w*\(\s*module|module\.(?:def|attr)\()'
        r'\s*,?\s*"(\w+)"'
    )
    rooms = {}
    for path in BINDINGS.glob("*.cpp"):
        room = path.stem.removeprefix("bind_")
        for name in pattern.findall(path.read_text()):
            rooms[name] = "sdnn" if room == "module" else room
    return rooms


def used_core_names(tree):
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.value.id == "_core"
        ):
            yield node.attr
        elif isinstance(node, ast.ImportFrom) and node.module in ("sdnn._core", "_core"):
            yield from (name.name for name in node.names)


def test_cpp_arrows_point_down():
    arrows = list(cpp_arrows())
    assert len(arrows) > 30
    assert faults(arrows) == []


def test_python_arrows_point_down():
    arrows = list(python_arrows())
    assert len(arrows) > 10
    assert faults(arrows) == []


@pytest.mark.parametrize(
    ("room", "target"),
    [
        ("core", "coding"),
        ("approximators", "agents"),
        ("agents", "environments"),
        ("environments", "agents"),
        ("environments", "approximators"),
        ("environments", "coding"),
        ("agents", "estimators"),
        ("estimators", "agents"),
        ("agents", "experiments"),
        ("experiments", "benchmarks"),
        ("agents", "sdnn"),
        ("helpers", "core"),
        ("agents", "helpers"),
    ],
)
def test_a_wrong_arrow_would_be_seen(room, target):
    assert fault_of_arrow(room, target) is not None


def test_every_folder_is_a_listed_room():
    rooms = {room for floor in FLOORS for room in floor}
    for folder in (INCLUDE, PACKAGE, CPP_TESTS):
        found = {p.name for p in folder.iterdir() if p.is_dir() and p.name != "__pycache__"}
        assert found <= rooms, folder
    assert {p.stem for p in PACKAGE.glob("*.py")} <= set(PYTHON_MODULES)
    assert {p.name for p in INCLUDE.glob("*.hpp")} <= {"sdnn.hpp", "fwd.hpp"}
    bound = {p.stem.removeprefix("bind_") for p in BINDINGS.glob("bind_*.cpp")}
    assert bound <= rooms


def test_cpp_sees_python_in_the_bindings_only():
    for path in headers():
        for included in includes(path):
            assert not included.startswith(("pybind11", "Python.h", "numpy")), path


def test_python_touches_the_core_only_in_the_room_that_wraps_it():
    owners = core_names()
    assert {"SDNNC", "SDNNQLearning", "Acrobot", "AcrobotTrial", "Stream"} <= set(owners)
    wrong = []
    for path in python_files():
        for name in used_core_names(ast.parse(path.read_text())):
            owner = owners.get(name, "a name that is not bound")
            if owner != room_of_module(path) and owner not in SHARED_BINDINGS:
                wrong.append(f"{path.relative_to(ROOT)} uses _core.{name} of {owner}")
    assert wrong == []


def is_public(path):
    """Whether a header belongs to the interface: parts of a room are in its folder detail/."""
    return path.parent != INCLUDE and path.parent.name != "detail"


def test_the_umbrella_includes_what_is_public():
    everything = {
        f"sdnn/{path.relative_to(INCLUDE).as_posix()}"
        for path in headers()
        if is_public(path) and room_of_header(path) not in ON_REQUEST
    } - {"sdnn/estimators/libsdnn.hpp"}
    umbrella = includes(INCLUDE / "sdnn.hpp")
    assert set(umbrella) == everything
    assert umbrella == sorted(umbrella)


def test_every_header_has_its_test_in_the_folder_of_its_room():
    missing = [
        str(test.relative_to(ROOT))
        for path in headers()
        if path.parent != INCLUDE
        and not (
            test := CPP_TESTS / path.relative_to(INCLUDE).with_name(f"{path.stem}_test.cpp")
        ).is_file()
    ]
    assert missing == []


def test_headers_live_in_the_namespace_of_their_room():
    for path in headers():
        if path.parent != INCLUDE:
            assert f"namespace sdnn::{room_of_header(path)} {{" in path.read_text(), path
        assert "#pragma once" in path.read_text(), path


def test_no_drawer_for_things_without_a_place():
    forbidden = {"utils", "util", "common", "helpers", "helper", "misc"}
    for folder in ("cpp", "python", "tests", "bench", "docs", "cmake"):
        for path in (ROOT / folder).rglob("*"):
            assert path.stem not in forbidden, path
