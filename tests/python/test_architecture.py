"""The house: arrows point down only, and every thing is where its name says.

Rooms may use the rooms below them; the files of a room may use each other, but never in a circle.
An edge between two files is any import or include, wherever it stands: imports inside functions
count, and so do those for type checkers only, because a file cannot be read or moved without those
whose types it names.
"""

import ast
import re
from pathlib import Path

import pytest

from sdnn import _core

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
    ("experiments", "runs"),
    ("reproduction",),
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
    "bounds": "core",
    "config": "core",
    "kernel": "coding",
    "lazy": "core",
    "instruction_sets": "core",
    "interrupts": "core",
    "machine": "core",
    "palette": "core",
    "registration": "environments",
    "toml_lines": "core",
    "typed_values": "core",
    "whole_files": "core",
}
"""The room of every module at the top of the Python package, and of the package of the command."""

SHARED_BINDINGS = {"core", "coding", "experiments", "module"}
"""Bound rooms without a Python room of their own, and what belongs to no room, such as the version:
any room may use them."""

MACROS = {"floating_point.hpp", "kernel.hpp"}
"""Headers of macros and of what the preprocessor asks, which have no namespace."""

ON_REQUEST = {"benchmarks"}
"""Rooms that the umbrella leaves out: a controller has no use for them."""

LEFT_OUT = {
    "sdnn/agents/agent_file.hpp",
    "sdnn/agents/controller.hpp",
    "sdnn/core/safetensors.hpp",
    "sdnn/estimators/libsdnn.hpp",
}
"""Headers that the umbrella leaves out: the language of LIBSDNN's files, and what needs a library
for JSON."""

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
    top = relative.parts[0].removesuffix(".py")
    return PYTHON_MODULES.get(top, top)


def imports(tree, path):
    """What a module imports of ``sdnn``: dotted module below it ("" for the package), names."""
    here = path.relative_to(PACKAGE).parts[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for name in node.names:
                top, _, rest = name.name.partition(".")
                if top == "sdnn":
                    yield rest, ()
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                base = ".".join(here[: len(here) - node.level + 1])
                module = ".".join(part for part in ("sdnn", base, module) if part)
            top, _, rest = module.partition(".")
            if top == "sdnn":
                yield rest, tuple(name.name for name in node.names)


def imported_modules(tree, path):
    """Dotted names below ``sdnn`` that a module imports, "" for the package itself."""
    for module, names in imports(tree, path):
        yield from [module] if module or not names else names


def python_arrows():
    known = {path.stem for path in PACKAGE.glob("*.py")} | {path.name for path in PACKAGE.iterdir()}
    for path in python_files():
        for module in imported_modules(ast.parse(path.read_text()), path):
            top = module.partition(".")[0]
            if top == "_core":
                continue
            target = PYTHON_MODULES.get(top, top) if top in known else "sdnn"
            yield path.relative_to(ROOT), room_of_module(path), target


def python_edges():
    """Pairs of files of the package of which the first imports the second, by their paths."""
    files = {path.relative_to(PACKAGE).as_posix() for path in python_files()}

    def file_of(module):
        path = module.replace(".", "/")
        return next(
            (p for p in (f"{path}.py", f"{path}/__init__.py".lstrip("/")) if p in files), None
        )

    for path in python_files():
        name = path.relative_to(PACKAGE).as_posix()
        for module, words in imports(ast.parse(path.read_text()), path):
            # A word that is no module of its own comes out of the module before it.
            found = [
                file_of(f"{module}.{word}".lstrip(".")) or file_of(module)
                for word in words
                if word != "_core"
            ]
            yield from ((name, target) for target in found if words and target)
            if not words and file_of(module):
                yield name, file_of(module)


def cpp_edges():
    """Pairs of headers of which the first includes the second, by their paths."""
    for path in headers():
        for included in includes(path):
            if included.startswith("sdnn/"):
                yield path.relative_to(INCLUDE).as_posix(), included.removeprefix("sdnn/")


def circles(edges):
    """Groups of files of which each one reaches all others of its group, sorted."""
    reached = {}
    for source, target in edges:
        reached.setdefault(source, set()).add(target)
        reached.setdefault(target, set())
    for middle in reached:
        for targets in reached.values():
            if middle in targets:
                targets |= reached[middle]
    groups = {
        tuple(sorted(other for other in reached[file] if file in reached[other]))
        for file in reached
        if file in reached[file]
    }
    return sorted(groups)


def core_names():
    """The room that binds each name of ``_core``, read from bind_<room>.cpp.

    A name is the first text that a call is given together with the module, whatever the call.
    """
    pattern = re.compile(r'(?:\(\s*module\s*,|module\.(?:def|attr)\()\s*"(\w+)"')
    return {
        name: path.stem.removeprefix("bind_")
        for path in BINDINGS.glob("*.cpp")
        for name in pattern.findall(path.read_text())
    }


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
        ("agents", "runs"),
        ("runs", "reproduction"),
        ("reproduction", "benchmarks"),
        ("agents", "sdnn"),
        ("helpers", "core"),
        ("agents", "helpers"),
    ],
)
def test_a_wrong_arrow_would_be_seen(room, target):
    assert fault_of_arrow(room, target) is not None


def test_files_do_not_know_each_other_in_circles():
    edges = list(python_edges())
    assert len(edges) > 100
    assert ("cli/reproduce.py", "reproduction/reproduce.py") in edges  # in a function
    assert ("reproduction/__init__.py", "reproduction/cases.py") in edges  # for type checkers
    assert ("reproduction/reproduce.py", "runs/store.py") in edges  # out of its package
    assert circles(edges) == []
    edges = list(cpp_edges())
    assert len(edges) > 100
    assert circles(edges) == []


@pytest.mark.parametrize(
    ("edges", "found"),
    [
        ("ab bc ac", []),
        ("ab ba", [("a", "b")]),
        ("ab bc cd db", [("b", "c", "d")]),
        ("ab ba bc cd dc", [("a", "b"), ("c", "d")]),
        ("aa ab", [("a",)]),
    ],
)
def test_circles_are_found(edges, found):
    assert circles([tuple(edge) for edge in edges.split()]) == found


def test_every_folder_is_a_listed_room():
    rooms = {room for floor in FLOORS for room in floor}
    for folder in (INCLUDE, PACKAGE, CPP_TESTS):
        found = {p.name for p in folder.iterdir() if p.is_dir() and p.name != "__pycache__"}
        assert {PYTHON_MODULES.get(name, name) for name in found} <= rooms, folder
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
    bound = {name for name in vars(_core) if not name.startswith("_")} | {"__version__"}
    assert bound == set(owners)
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
    } - LEFT_OUT
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
        if path.parent != INCLUDE and path.name not in MACROS:
            assert f"namespace sdnn::{room_of_header(path)} {{" in path.read_text(), path
        assert "#pragma once" in path.read_text(), path


STANDARD_HEADERS = {
    "algorithm": "(sort|nth_element|shuffle|transform|copy(_n)?|fill(_n)?|equal|find_if|all_of|"
    "any_of|count_if|for_each|adjacent_find|partition_point|swap_ranges|minmax_element|min|max|clamp|"
    r"ranges::(all_of|copy|equal|find_if|transform|stable_sort|sort|fill|any_of))\(",
    "array": r"array\b",
    "atomic": r"(atomic\b|memory_order)",
    "bit": r"(bit_cast|popcount|countr_zero|rotl|bit_width|endian)\b",
    "bitset": r"bitset\b",
    "chrono": "chrono::",
    "cmath": r"(isfinite|isnan|floor|ceil|sqrt|sin|log|lround|llround|nearbyint|remainder|copysign|"
    r"signbit)\(",
    "concepts": r"convertible_to\b",
    "cstddef": r"(size_t|ptrdiff_t|byte)\b",
    "cstdint": r"u?int(8|16|32|64)_t\b",
    "cstdlib": r"(getenv|calloc|free|abort|llabs)\(",
    "cstring": r"memcpy\(",
    "exception": r"exception\b",
    "filesystem": "filesystem::",
    "fstream": r"(ifstream|ofstream)\b",
    "functional": r"function\b",
    "iomanip": r"(setprecision)\b",
    "limits": r"numeric_limits\b",
    "map": r"map\b",
    "memory": r"(shared_ptr|unique_ptr|make_shared|make_unique)\b",
    "new": r"bad_alloc\b",
    "numeric": r"iota\b",
    "optional": r"(optional|nullopt)\b",
    "random": r"(mt19937|seed_seq|normal_distribution)\b",
    "set": r"set\b",
    "span": r"(span|as_bytes)\b",
    "sstream": r"ostringstream\b",
    "stdexcept": r"(invalid_argument|runtime_error|overflow_error|length_error|out_of_range|"
    r"logic_error)\b",
    "string": r"(string|to_string)\b",
    "string_view": r"string_view\b",
    "system_error": r"(error_code|generic_category)\b",
    "thread": r"(jthread|this_thread)\b",
    "tuple": r"(tuple|tuple_cat|apply)\b",
    "type_traits": r"(is_\w+_v|remove_cvref_t|conditional_t|true_type|false_type|make_unsigned_t|"
    r"integral_constant|type_identity_t)\b",
    "utility": r"(move|swap|pair|exchange|index_sequence|make_index_sequence|declval|"
    r"in_place_type)\b",
    "variant": r"(variant|visit|get_if)\b",
    "vector": r"(vector|erase_if)\b",
}
"""What of the standard library's namespace is in which of its headers."""


def test_headers_include_what_they_use_of_the_standard_library():
    missing = []
    for path in headers():
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        missing += [
            f"{path.relative_to(INCLUDE)}: <{name}>"
            for name, used in STANDARD_HEADERS.items()
            if name not in includes(path) and re.search(r"\bstd::" + used, code)
        ]
    assert missing == []


def test_headers_with_floating_point_refuse_options_that_change_results():
    includes = {
        path: {
            INCLUDE.parent / name
            for name in re.findall(r'#include "(sdnn/[^"]+)"', path.read_text(encoding="utf-8"))
        }
        for path in INCLUDE.rglob("*.hpp")
    }

    def reached(path, seen):
        for included in includes.get(path, ()):
            if included not in seen:
                seen.add(included)
                reached(included, seen)
        return seen

    guard = INCLUDE / "core" / "detail" / "floating_point.hpp"
    assert guard in includes
    unguarded = [
        path
        for path in includes
        if re.search(r"\b(double|float)\b", path.read_text(encoding="utf-8"))
        if path != guard and guard not in reached(path, set())
    ]
    assert unguarded == []


def test_no_drawer_for_things_without_a_place():
    forbidden = {"utils", "util", "common", "helpers", "helper", "misc"}
    for folder in ("cpp", "python", "tests", "bench", "docs", "cmake"):
        for path in (ROOT / folder).rglob("*"):
            assert path.stem not in forbidden, path


def test_the_documents_name_files_that_are_there():
    rooms = (ROOT / name for name in ("cpp", "python", "bench", "tests", "docs"))
    there = {f"/{path.as_posix()}" for room in rooms for path in room.rglob("*.*")}
    pages = [ROOT / "README.md", ROOT / "REPRODUCTION.md", ROOT / "CONTRIBUTING.md"]
    named = [
        (page.name, name)
        for page in (*pages, *(ROOT / "docs").rglob("*.md"))
        for name in re.findall(r"`(\w+(?:/\w+)+\.(?:hpp|cpp|py))`", page.read_text("utf-8"))
    ]
    assert len(named) > 50
    for page, name in named:
        assert any(path.endswith(f"/{name}") for path in there), f"{page}: {name}"
