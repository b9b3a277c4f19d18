"""Checks beyond the tests of the Python package, each a session: ``nox -s style``, ``nox -l``.

Sessions run in the environment that nox itself runs in: ``pip install ".[dev]"`` first.
``nox`` alone runs the quick ones, as continuous integration does; ``nox -t weekly`` the others.
"""

import os
import re
import shutil
import sys
import sysconfig
from pathlib import Path

import nox

nox.options.default_venv_backend = "none"
nox.options.error_on_missing_interpreters = True

ROOT = Path(__file__).parent
JOBS = str(os.cpu_count() or 1)
if shutil.which("ccache"):
    os.environ.setdefault("CMAKE_CXX_COMPILER_LAUNCHER", "ccache")
CPP_PRESETS = ["gcc", "clang", "sanitize", "tsan", "assertions", "aarch64", "libcxx", "arm32"]


def quick(**options):
    """Mark a session that ``nox`` runs by default."""
    return nox.session(tags=["quick"], **options)


def weekly(**options):
    """Mark a session that is too long for every change."""
    return nox.session(tags=["weekly"], default=False, **options)


def python(session, *arguments, **options):
    """Run a module or a script with this Python."""
    session.run(sys.executable, *arguments, **options)


def pytest(session, *arguments):
    """Run tests with whatever the user adds after ``--``."""
    python(session, "-m", "pytest", "--durations=20", *arguments, *session.posargs)


def cmake_build(session, preset, *targets):
    """Configure and build a preset of CMakePresets.json."""
    session.run("cmake", "--preset", preset, external=True)
    session.run("cmake", "--build", "--preset", preset, "--parallel", JOBS, *targets, external=True)


def cpp_sources():
    """List all C++ files of our own, and the plain C files that `sdnn export` writes."""
    folders = ("cpp", "tests/cpp", "tests/fuzz", "bench", "docs/examples/cpp")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.[ch]pp")]
    return sorted(map(str, [*files, *(ROOT / "cpp" / "c").glob("*.h")]))


@quick()
def style(session):
    """Check format, lint, words and the direction of dependencies."""
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("clang-format", "--dry-run", "-Werror", *cpp_sources(), log=False)
    session.run("codespell", "python", "cpp/include", "docs", "bench", *(ROOT.glob("*.md")))
    pytest(session, "-q", "tests/docs/test_words.py", "tests/python/test_architecture.py")
    session.run("lint-imports", env={"PYTHONPATH": str(ROOT / "python")})


@quick()
def types(session):
    """Check types, strictly, and that the stub of the core is up to date."""
    python(session, "-m", "mypy", "--strict", "-p", "sdnn")
    stub = python_output(session, "tests/python/reference/core_stub.py")
    if stub != (ROOT / "python/sdnn/_core.pyi").read_text("utf-8"):
        session.error("python tests/python/reference/core_stub.py > python/sdnn/_core.pyi")


def python_output(session, *arguments):
    """Return what a Python program prints."""
    return session.run(sys.executable, *arguments, silent=True, log=False, stderr=None)


@quick()
def cpp(session):
    """Build and run the C++ tests, little optimized and with assertions."""
    run_cpp_tests(session, "dev")


@weekly(name="cpp-builds")
@nox.parametrize("preset", CPP_PRESETS)
def cpp_builds(session, preset):
    """Build and run the C++ tests as users compile them, under sanitizers, and for Arm."""
    run_cpp_tests(session, preset)


@weekly(name="cpp-wasm")
def cpp_wasm(session):
    """Compile every header alone for WebAssembly."""
    cmake_build(session, "wasm")


def run_cpp_tests(session, preset):
    """Build a preset's tests and run them."""
    cmake_build(session, preset)
    session.run("ctest", "--preset", preset, "--parallel", JOBS, external=True)


@quick()
def demonstration(session):
    """Compile cpp/wasm for the site's page on which agents learn in a browser."""
    folder = ROOT / "build" / "demonstration"
    headers = folder / "headers"
    headers.mkdir(parents=True, exist_ok=True)
    export_pole_headers(session, headers)
    eigen = (Path(path, "cmeel.prefix", "include", "eigen3") for path in sys.path)
    folders = (ROOT / "cpp" / "include", ROOT / "cpp", headers, *filter(Path.is_dir, eigen))
    flags = ["-target", "wasm32-wasi", "-mexec-model=reactor", "-msimd128", "-fno-exceptions", "-s"]
    flags += ["-std=c++20", "-ffp-contract=off", "-DSDNN_NO_CONTRACTION"]
    flags += ["-Wall", "-Wextra", "-Wconversion", "-Werror"]
    flags += [f"-isystem{path}" for path in (*folders, "/usr/include/eigen3")]
    for name, level in (("acrobot", "-O3"), ("pole", "-Os")):
        files = (ROOT / "cpp" / "wasm" / f"{name}.cpp", "-o", folder / f"{name}.wasm")
        python(session, "-m", "ziglang", "c++", level, *flags, *files)


def export_pole_headers(session, folder):
    """Write pole1.h to pole3.h: agents that balance a pole with 1 to 3 copies of each sensor."""
    # Cart position in m and speed in m/s, pole angle in rad and speed in rad/s.
    ranges = ("--range=-2.4:2.4", "--range=-3:3", "--range=-0.21:0.21", "--range=-3.5:3.5")
    for copies, ram_bytes in enumerate((20_000, 60_000, 120_000), 1):
        header = ("--actions=2", f"--ram={ram_bytes}", f"--c-header={folder}/pole{copies}.h")
        python(session, "-m", "sdnn", "export", "--new", *ranges * copies, *header)


@quick()
def browser(session):
    """Test the demonstration in Chromium; nox -s demonstration builds it."""
    pytest(session, "tests/browser")


@quick()
def docs(session):
    """Build the site and the C++ reference; run the examples and the documents' code."""
    pytest(session, "tests/docs")


@weekly(name="docs-weekly")
def docs_weekly(session):
    """Run the blocks of the documents that take more than a minute, an hour in all."""
    os.environ["SDNN_WEEKLY"] = "1"
    pytest(session, "tests/docs/test_pages.py::test_the_weekly_code_blocks_of_a_page_run")


SHORT_TESTS = [
    "tests/python/core/test_config.py",
    "tests/python/core/test_lazy.py",
    "tests/python/estimators/test_files.py",
    "tests/python/estimators/test_online.py",
    "tests/python/estimators/test_river.py",
    "tests/python/estimators/test_scikit_learn.py",
    "tests/python/agents/test_saving.py",
    "tests/python/agents/test_habits.py",
    "tests/python/runs/test_run.py",
    "tests/python/runs/test_spec.py",
]


@quick()
def newest(session):
    """Run some tests on the newest Python that is here, with the newest of all dependencies."""
    test_with(session, interpreters()[-1], "highest", *SHORT_TESTS)


@weekly()
@nox.parametrize("resolution", ["lowest-direct", "highest"])
def versions(session, resolution):
    """Run all tests on the oldest and the newest Python, with the oldest and newest packages."""
    interpreter = interpreters()[-1 if resolution == "highest" else 0]
    test_with(session, interpreter, resolution, "tests/python")


def interpreters():
    """Return the supported Pythons on the path and of pyenv, the oldest first."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    folders = [*map(str, pyenv.glob("versions/*/bin")), os.environ["PATH"]]
    names = (f"python3.{minor}" for minor in range(11, 15))  # 3.11 to 3.14
    paths = (shutil.which(name, path=os.pathsep.join(folders)) for name in names)
    return list(filter(None, paths))


def test_with(session, interpreter, resolution, *tests):
    """Run tests on another Python, with the lowest or highest versions that the package allows.

    The environment is made by uv. Its `resolution` is "lowest-direct" or "highest".
    """
    python_of = Path(session.create_tmp(), resolution, "bin", "python")
    uv = [sys.executable, "-m", "uv"]
    session.run(*uv, "venv", "--clear", f"--python={interpreter}", python_of.parents[1])
    install = [*uv, "pip", "install", "-q", f"--python={python_of}", f"--resolution={resolution}"]
    session.run(*install, "--reinstall-package=sdnn-learn", ".[test]")
    session.run(python_of, "-m", "pytest", "-q", *tests, *session.posargs, external=True)


@weekly()
def cluster(session):
    """Run trials on a Dask cluster whose parts are killed and frozen."""
    pytest(session, "tests/cluster")


@quick()
def robustness(session):
    """Try bad values and damaged files; end commands anywhere; let every call of writers fail."""
    pytest(session, "tests/robustness")


@weekly(name="robustness-weekly")
def robustness_weekly(session):
    """Try all bad values, eleven times as many."""
    os.environ["SDNN_WEEKLY"] = "1"
    pytest(session, "tests/robustness/test_bad_values.py")


@quick()
def soak(session):
    """Let agents learn in random spaces with random settings."""
    python(session, "tests/robustness/soak.py", *session.posargs)


@weekly(name="soak-weekly")
def soak_weekly(session):
    """Build the package with AddressSanitizer and UBSan, and run 2,000 random lives with it."""
    folder, flags = ROOT / "build" / "asan", "-O1 -g1 -fsanitize=address,undefined"
    install = ["pip", "install", "-q", "--no-deps", "--no-build-isolation", "--upgrade"]
    defines = [f"-Ccmake.define.CMAKE_CXX_FLAGS={flags} -fno-sanitize-recover=all"]
    python(session, "-m", *install, f"--target={folder}", "-Ccmake.build-type=None", *defines, ".")
    libraries = [
        session.run("g++", f"-print-file-name=lib{name}.so", silent=True, external=True).strip()
        for name in ("asan", "ubsan")
    ]
    options = "detect_leaks=0:allocator_may_return_null=1"
    environment = {"LD_PRELOAD": " ".join(libraries), "ASAN_OPTIONS": options}
    environment["PYTHONPATH"] = str(folder)
    arguments = session.posargs or ("--lives", "2000")
    python(session, "tests/robustness/soak.py", *arguments, env=environment)


@quick()
def emulation(session):
    """Compile the C headers of agents for Arm too; run them in an emulator."""
    pytest(session, "tests/emulation")


@weekly()
def boards(session):
    """Run agents and estimators as firmware of emulated boards."""
    pytest(session, "tests/boards")


@quick()
def packaging(session):
    """Check the source distribution, the wheel and the C++ library as others use it."""
    pytest(session, "tests/packaging")


@quick()
def fuzz(session):
    """Run every fuzz target, in C++ and Python, over its corpus and for some seconds beyond it.

    ``nox -s fuzz -- --seconds 600`` for ten minutes each; build/fuzzing/counts.json sums up.
    """
    cmake_build(session, "fuzz")
    arguments = ("--out", "build/fuzzing", "--seconds", "4", "--jobs", JOBS)
    python(session, "tests/fuzz/campaign.py", *arguments, *session.posargs)


@weekly()
def tidy(session):
    """Run clang-tidy over the headers and the C++ tests; check what headers include."""
    session.run("cmake", "--preset", "tidy", external=True)
    session.run("run-clang-tidy.py", "-quiet", "-p", "build/tidy", f"-j{JOBS}")
    # Each header must include what it uses. The check looks at main files only, so it gets the
    # headers as main files.
    headers = [name for name in cpp_sources() if re.search(r"cpp/(include|tools)/.*hpp$", name)]
    flags = ["-xc++", "-std=c++20", "-ffp-contract=off", "-DSDNN_NO_CONTRACTION"]
    flags += [f"-I{ROOT}/cpp/include", f"-I{ROOT}/cpp", "-isystem/usr/include/eigen3"]
    flags += [f"-isystem{sysconfig.get_path('purelib')}/cmeel.prefix/include/eigen3"]
    checks = "--checks=-*,misc-include-cleaner"
    session.run("clang-tidy", "--quiet", checks, *headers, "--", *flags)


@weekly()
def slow(session):
    """Run the tests that are marked slow."""
    pytest(session, "-m", "slow", "tests")


@weekly()
def coverage(session):
    """Measure which lines the tests reach, in Python and in C++."""
    report = ROOT / "build" / "coverage"
    pytest(session, "--cov=sdnn", f"--cov-report=html:{report}", "--cov-report=term")
    cmake_build(session, "coverage")
    session.run("ctest", "--preset", "coverage", "--parallel", JOBS, external=True)
    filters = ["--filter", "cpp/include/", "--root", str(ROOT), "build/coverage"]
    python(session, "-m", "gcovr", "--print-summary", "--txt", "build/coverage.txt", *filters)
