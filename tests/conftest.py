"""Fixtures for tests of all folders: tools that may be missing, commands, stores and studies."""

import functools
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from click.testing import CliRunner

# Small matrix products are slower on several threads than on one, far slower on a busy machine.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_configure():
    """Handle Ctrl-C, which tests send: shells let processes in the background ignore it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def skip_unless_ci():
    """Skips for a missing tool; where everything has to be tested (CI is set), fails instead."""

    def _skip(reason):
        if os.environ.get("CI"):
            pytest.fail(f"{reason} (CI is set, so nothing may be skipped)")
        pytest.skip(reason)

    return _skip


@pytest.fixture(scope="module")  # its event loop ends with the module
def chromium(skip_unless_ci):
    """Chromium, without a window, as a browser of playwright."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        skip_unless_ci("needs playwright: pip install playwright")
    names = ("chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        skip_unless_ci("needs Chromium: apt install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


PACKAGES = {
    "clang": "clang libclang-rt-dev",
    "clang++": "clang libclang-rt-dev",
    "nm": "binutils",
    "objdump": "binutils",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi picolibc-arm-none-eabi",
    "riscv64-unknown-elf-gcc": "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf",
    "qemu-system-riscv32": "qemu-system-misc",
}
"""The packages to install for a tool, where they have other names."""


@functools.cache
def _links(compiler, options):
    """Return whether a compiler makes a program with these options."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "main.c")
        source.write_text("int main(void) { return 0; }\n")
        command = [compiler, *options, source, "-o", Path(folder, "main")]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.fixture(scope="session")
def needs(skip_unless_ci):
    """Skips where a tool is missing, or a compiler makes no program with the options."""

    def _needs(*tools, options=()):
        for tool in tools:
            is_compiler = re.search(r"(cc|clang|\+\+)$", tool)
            if shutil.which(tool) is None or (is_compiler and not _links(tool, tuple(options))):
                command = " ".join((tool, *options))
                skip_unless_ci(f"needs {command}: apt install {PACKAGES.get(tool, tool)}")

    return _needs


def _tool(name):
    """Return the path of a program on the path or beside this Python, or None."""
    beside = Path(sys.executable).with_name(name)
    return shutil.which(name) or (str(beside) if beside.exists() else None)


@pytest.fixture(scope="session")
def cmake(skip_unless_ci):
    """Runs cmake, or with ``tool="ctest"`` its test driver; returns the finished process."""
    if _tool("cmake") is None or _tool("ctest") is None:
        skip_unless_ci("needs cmake: pip install cmake")
    if all(_tool(compiler) is None for compiler in (os.environ.get("CXX", "c++"), "g++")):
        skip_unless_ci("needs a C++ compiler")
    # Extend the path like an activated environment: ninja and the Python that knows where Eigen is.
    beside = str(Path(sys.executable).parent)

    def _run(*arguments, tool="cmake"):
        path = os.pathsep.join((beside, os.environ.get("PATH", "")))
        command = [_tool(tool), *map(str, arguments)]
        return subprocess.run(
            command, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False
        )

    return _run


@pytest.fixture(scope="session")
def configure(cmake):
    """Configures a source folder into a build folder; returns the finished process."""

    def _configure(source, build, *options):
        generator = ["-G", "Ninja"] if _tool("ninja") else []
        return cmake("-S", source, "-B", build, *generator, *options)

    return _configure


@pytest.fixture
def use_trial(monkeypatch):
    """Let all agents run their trials in another class, such as `fake_trial.FakeTrial`."""
    from fake_trial import agents_with
    from sdnn.runs import AGENTS

    def _use(core_trial):
        for name, entry in agents_with(core_trial).items():
            monkeypatch.setitem(AGENTS, name, entry)

    return _use


@pytest.fixture
def invoke(monkeypatch, tmp_path, use_trial):
    """Calls `sdnn` in an empty folder; returns click's result.

    ``trial`` is a class of trials for all agents (see `use_trial`). Exceptions are not caught.
    """
    from sdnn.cli import main

    monkeypatch.chdir(tmp_path)

    def _invoke(*arguments, trial=None, **options):
        if trial is not None:
            use_trial(trial)
        options = {"catch_exceptions": False} | options
        return CliRunner().invoke(main, [str(argument) for argument in arguments], **options)

    return _invoke


@pytest.fixture
def output_of(invoke):
    """Call a command that must succeed; return what it prints."""

    def _output_of(*arguments):
        result = invoke(*arguments)
        assert result.exit_code == 0, result.output
        return result.stdout

    return _output_of


@pytest.fixture
def refused(invoke):
    """Calls a command that must fail with an exit code and print no result; returns its error."""

    def _refused(*arguments, code):
        result = invoke(*arguments)
        assert (result.exit_code, result.stdout) == (code, ""), result.output
        assert code == 2 or result.stderr.count("\n") == 1, "only errors of usage have more lines"
        return result.stderr

    return _refused


@pytest.fixture
def run(use_trial):
    """Runs a plan into the store of a folder, with fake trials.

    Returns the outcome, and the digest of all rows in the store.
    """
    from fake_trial import FakeTrial, make_plan
    from sdnn.runs import ResultStore, run_trials
    from sdnn.runs.trial import records_digest

    def _run(folder, plan=None, trial=FakeTrial, **options):
        use_trial(trial)
        with ResultStore(folder) as store:
            outcome = run_trials(make_plan() if plan is None else plan, store, **options)
            return outcome, records_digest(store.load())

    return _run


@pytest.fixture
def collected():
    """Measures the stored trials of an experiment in a folder; returns its results."""
    from sdnn.reproduction import plan_trials
    from sdnn.reproduction.reproduce import collect, specs_of
    from sdnn.runs import ResultStore
    from sdnn.runs.study import Study, compare

    def _collected(experiment, folder, n_trials, n_episodes=15_000):
        study = Study("", specs_of(experiment.cases, n_episodes), n_trials=n_trials, seed=0)
        keys = [planned.key for planned in plan_trials(experiment.cases, n_trials, 0, n_episodes)]
        with ResultStore(folder) as store:
            return collect(experiment, compare(study, store.load(keys)))

    return _collected


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Writes a study file and reads it; modules beside it can be imported in the test only."""
    from sdnn.reproduction.reproduce import ClaimStudy

    monkeypatch.setattr(sys, "path", [*sys.path])

    def _study(text, name="mine.toml", **options):
        path = tmp_path / name
        path.write_text(text)
        return ClaimStudy(path, **options)

    return _study
