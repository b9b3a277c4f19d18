"""Style and types of the code, by the tools' own judgement."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import sdnn

ROOT = Path(__file__).parents[2]
CPP_FILES = sorted(
    path
    for folder in ("cpp", "tests/cpp", "bench", "docs/examples/cpp")
    for path in (ROOT / folder).rglob("*.[ch]pp")
)


@pytest.mark.parametrize(
    "command",
    [
        ("ruff", "check", "--no-cache", "."),
        ("ruff", "format", "--check", "--no-cache", "."),
        ("mypy", "--strict", "-p", "sdnn"),
    ],
    ids=["lint", "format", "types"],
)
def test_tools_find_nothing(command, tmp_path):
    environment = os.environ | {"MYPY_CACHE_DIR": str(tmp_path)}
    folder = Path(sdnn.__file__).parents[1]
    if folder.name != "site-packages":  # there mypy finds the package by itself
        environment["MYPYPATH"] = str(folder)
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def pinned(skip_unless_ci):
    """A tool of this environment, in the version of the `test` extra: others judge otherwise."""

    def _pinned(name):
        tool = Path(sys.executable).with_name(name)
        if not tool.exists():
            skip_unless_ci(f'needs {name}: pip install ".[test]"')
        return tool

    return _pinned


def test_clang_format_changes_nothing(pinned):
    assert len(CPP_FILES) > 100
    done = subprocess.run(
        [pinned("clang-format"), "--dry-run", "-Werror", *CPP_FILES], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-8000:]


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_clang_tidy_finds_nothing(pinned, configure, skip_unless_ci, tmp_path):
    configured = configure(ROOT, tmp_path, "--preset", "tidy")
    if "the C++ tests need" in configured.stderr:
        skip_unless_ci("needs GoogleTest and JSON: apt install libgtest-dev nlohmann-json3-dev")
    assert configured.returncode == 0, configured.stdout + configured.stderr
    command = [sys.executable, pinned("run-clang-tidy.py"), "-quiet", "-p", tmp_path]
    options = [
        f"-clang-tidy-binary={pinned('clang-tidy')}",
        f"-config-file={ROOT / '.clang-tidy'}",
    ]
    done = subprocess.run([*command, *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-8000:]
