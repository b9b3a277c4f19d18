"""The installed C++ library, the versions and stub of the Python package, and shipped files."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path

import pytest

import sdnn
from sdnn import _core

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "examples" / "cpp"
STUB = ROOT / "python" / "sdnn" / "_core.pyi"
STUB_COMMAND = "python tests/python/reference/core_stub.py > python/sdnn/_core.pyi"


# The C++ library, installed and used from outside.


def run_example(cmake, configure, build, *options, target="all"):
    """Build the programs of docs/examples/cpp with an installed library, and run swing_up.

    Returns the words of each line that it prints, for 40 episodes with seed 7.
    """
    quick = ("-DCMAKE_BUILD_TYPE=None", "-DCMAKE_CXX_FLAGS=-O1")
    process = configure(EXAMPLE, build, *quick, *options)
    assert process.returncode == 0, process.stdout + process.stderr
    process = cmake("--build", build, "--target", target)
    assert process.returncode == 0, process.stdout + process.stderr
    program = next(path for path in build.rglob("swing_up*") if os.access(path, os.X_OK))
    process = subprocess.run([program, "40", "7"], capture_output=True, text=True, check=True)
    return [tuple(line.split()) for line in process.stdout.splitlines()]


def rows_of_trial():
    """Return the expected output of the example: a trial of the same length and seed."""
    approximator, learning = _core.presets()["robust"][1:3]
    trial = _core.AcrobotTrial(
        approximator=approximator,
        learning=learning,
        acrobot=_core.AcrobotConfig(),
        goal=_core.GoalScheduleConfig(),
        sensors=_core.SensorConfig(),
        protocol=_core.ProtocolConfig(episodes=40),
        seed=7,
    )
    trial.advance(40)
    rows = trial.test_rows()
    return [
        (str(episode), str(steps), "solved" if solved else "-")
        for episode, steps, solved in zip(
            rows["episode"], rows["steps"], rows["solved"], strict=True
        )
    ]


def test_the_cpp_example_runs_with_an_installed_prefix(cmake, configure, tmp_path, skip_unless_ci):
    prefix = tmp_path / "prefix"
    for process in (
        configure(ROOT, tmp_path / "library", f"-DCMAKE_INSTALL_PREFIX={prefix}"),
        cmake("--install", tmp_path / "library"),
    ):
        assert process.returncode == 0, process.stdout + process.stderr
    installed = {path.relative_to(prefix).as_posix() for path in prefix.rglob("*.hpp")}
    sources = ROOT / "cpp" / "include"
    assert installed == {
        f"include/{path.relative_to(sources).as_posix()}" for path in sources.rglob("*.hpp")
    }
    build = tmp_path / "example"
    lines = run_example(cmake, configure, build, f"-DCMAKE_PREFIX_PATH={prefix}")
    assert lines == rows_of_trial()
    if shutil.which("pkg-config") is None:
        skip_unless_ci("needs pkg-config")
    assert pkg_config_flags(prefix).issuperset(
        {f"-I{prefix}/share/pkgconfig/../../include", "-ffp-contract=off", "-DSDNN_NO_CONTRACTION"}
    )


def pkg_config_flags(prefix):
    """Run pkg-config for an installed library, with Eigen as a package or a wheel."""
    eigen = Path(sysconfig.get_path("purelib"), "cmeel.prefix", "share", "pkgconfig")
    path = os.pathsep.join([f"{prefix}/share/pkgconfig", str(eigen)])
    command = ["pkg-config", "--cflags", "sdnn"]
    env = os.environ | {"PKG_CONFIG_PATH": path}
    return set(subprocess.check_output(command, env=env, text=True).split())


def test_the_cpp_example_runs_with_the_installed_python_package(cmake, configure, tmp_path):
    command = [sys.executable, "-m", "sdnn", "--cmakedir"]
    folder = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert (Path(folder) / "sdnnConfig.cmake").is_file()
    root = f"-Dsdnn_ROOT={folder}"
    lines = run_example(cmake, configure, tmp_path / "example", root, target="swing_up")
    assert lines == rows_of_trial()
    cache = (tmp_path / "example" / "CMakeCache.txt").read_text()
    used_folder = re.search(r"^sdnn_DIR:PATH=(.*)$", cache, re.MULTILINE)[1]
    assert Path(used_folder).resolve() == Path(folder).resolve()


def test_a_missing_json_library_is_an_error_for_saved_agents_only(configure, tmp_path):
    (tmp_path / "main.cpp").write_text("int main() {}\n")
    for target, fits in (("sdnn::sdnn", True), ("sdnn::controller", False)):
        (tmp_path / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.21)\nproject(robot LANGUAGES CXX)\n"
            f"add_subdirectory({ROOT.as_posix()} sdnn)\nadd_executable(robot main.cpp)\n"
            f"target_link_libraries(robot PRIVATE {target})\n"
        )
        none = "-DCMAKE_DISABLE_FIND_PACKAGE_nlohmann_json=ON"
        process = configure(tmp_path, tmp_path / "build", none)
        assert (process.returncode == 0) == fits, process.stdout + process.stderr
        assert ("apt install nlohmann-json3-dev" in process.stderr) != fits


def test_cmake_finds_eigen_in_the_python_on_the_path(
    configure, skip_unless_ci, tmp_path, monkeypatch
):
    site = Path(sysconfig.get_path("purelib"))
    if not (site / "cmeel.prefix").is_dir():
        skip_unless_ci("needs Eigen as a wheel: pip install cmeel-eigen")
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.21)\nproject(finder LANGUAGES NONE)\n"
        f"include({(ROOT / 'cmake' / 'FindEigenAnyway.cmake').as_posix()})\n"
    )
    monkeypatch.setenv("PATH", "")  # the fixture `cmake` puts the folder of this Python before it
    monkeypatch.delenv("CMAKE_PREFIX_PATH", raising=False)
    build = tmp_path / "build"
    process = configure(tmp_path, build, "-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF")
    assert process.returncode == 0, process.stdout + process.stderr
    eigen_folder = re.search(
        r"^Eigen3_DIR:PATH=(.*)$", (build / "CMakeCache.txt").read_text(), re.M
    )[1]
    assert site.resolve() in Path(eigen_folder).resolve().parents


@pytest.mark.parametrize("required", [False, True])
def test_find_package_fails_without_eigen(required, configure, tmp_path):
    config = (ROOT / "cmake" / "sdnnConfig.cmake.in").read_text().replace("@PACKAGE_INIT@", "")
    (tmp_path / "sdnnConfig.cmake").write_text(config)
    for name in ("FindEigenAnyway.cmake", "AgentFiles.cmake"):
        (tmp_path / name).write_text((ROOT / "cmake" / name).read_text())
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.21)\nproject(robot LANGUAGES NONE)\n"
        f"find_package(sdnn {'REQUIRED' if required else 'QUIET'})\n"
        'message(STATUS "found: ${sdnn_FOUND}")\n'
    )
    options = (f"-Dsdnn_DIR={tmp_path.as_posix()}", "-DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON")
    process = configure(tmp_path, tmp_path / "build", *options)
    messages = " ".join((process.stdout + process.stderr).split())
    assert process.returncode == (1 if required else 0), messages
    assert ("sdnn needs Eigen >= 3.4" if required else "found: 0") in messages


def test_no_build_file_has_options_for_a_processor():
    folders = [ROOT / name for name in ("cpp", "cmake", "tests", "bench", "docs", "python")]
    build_files = [ROOT / "CMakeLists.txt", ROOT / "pyproject.toml"]
    for pattern in ("CMakeLists.txt", "*.cmake*"):
        build_files += [path for folder in folders for path in folder.rglob(pattern)]
    assert len(build_files) > 5
    for path in build_files:
        assert not re.search(r"-m(arch|tune|cpu)=|ffast-math", path.read_text()), path


# The Python package.


def test_all_files_that_name_the_version_name_the_same():
    patterns = {
        "CMakeLists.txt": r"project\(sdnn VERSION ([0-9.]+)",
        "cpp/include/sdnn/core/version.hpp": r'kVersion = "([^"]+)"',
        "CITATION.cff": r"(?m)^version: (.+)$",
        "cmake/vcpkg/sdnn/vcpkg.json": r'"version": "([^"]+)"',
        "docs/reference/cpp.md": r"requires = sdnn/([0-9.]+)",
        "CHANGELOG.md": r"(?m)^## ([0-9.]+)( \([0-9-]{10}\))?$",
    }
    versions = {
        path: re.search(pattern, (ROOT / path).read_text())[1] for path, pattern in patterns.items()
    }
    assert set(versions.values()) == {sdnn.__version__}, versions


def test_the_type_stub_is_up_to_date():
    pytest.importorskip("pybind11_stubgen")
    import core_stub

    assert STUB.read_text() == core_stub.generate(), f"regenerate it: {STUB_COMMAND}"


# The shipped files.

SHIPPED = (
    r"PKG-INFO|CMakeLists\.txt|pyproject\.toml|LICENSE|CITATION\.cff|[A-Z_]+\.md",
    r"CMakePresets\.json|noxfile\.py|mkdocs\.yml|\.gitignore|\.clang-(format|tidy)|docs/site/Doxyfile",
    r"cmake/((toolchains/)?[^/]+\.cmake(\.in)?|sdnn\.pc\.in|vcpkg/sdnn/(portfile\.cmake|vcpkg\.json))",
    r"conanfile\.py",
    r"cpp/include/sdnn/([a-z_]+/){0,2}[a-z0-9_]+\.hpp",
    r"cpp/compiled/[a-z_]+\.cpp|cpp/tools/[a-z_]+\.hpp|cpp/bindings/([a-z_]+\.[ch]pp|CMakeLists\.txt)",
    r"cpp/wasm/[a-z0-9]+\.[ch]pp|docs/site/demonstration/[a-z]+\.(html|js)",
    r"python/sdnn/([a-z_]+/){0,2}[a-z_]+\.pyi?|python/sdnn/py\.typed",
    r"python/sdnn/(cli/[a-z]+\.txt|reports/page\.(html|md))\.jinja|cpp/c/sdnn_[a-z_]+\.h",
    r"python/sdnn/runs/(schema\.sql|baselines\.json)|python/sdnn/reproduction/(claims\.toml|reference-results\.csv)",
    r"(tests|bench|docs)/.*\.(py|c|h|cpp|hpp|ino|conf|txt|md|json|csv|png|gif|svg|css|toml|ipynb|bin|safetensors)",
)
"""Every file of a source distribution matches one of these."""

NEEDED = (
    "CMakeLists.txt",
    "CMakePresets.json",
    "pyproject.toml",
    "README.md",
    "LICENSE",
    "THIRD_PARTY_NOTICES.md",
    "cmake/*",
    "cpp/include/**/*.hpp",
    "cpp/compiled/*.cpp",
    "cpp/tools/*.hpp",
    "cpp/bindings/*",
    "cpp/c/*",
    "python/sdnn/**/*.csv",
    "python/sdnn/**/*.py",
    "python/sdnn/**/*.sql",
    "python/sdnn/**/*.toml",
    "python/sdnn/**/*.jinja",
    "python/sdnn/_core.pyi",
    "python/sdnn/py.typed",
)
"""Every file of the tree that matches one of these is in a source distribution."""


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """A source distribution, built without isolation: nothing is downloaded."""
    pytest.importorskip("scikit_build_core")
    out = tmp_path_factory.mktemp("sdist")
    code = f"from scikit_build_core.build import build_sdist; build_sdist({str(out)!r})"
    process = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stdout + process.stderr
    return next(out.glob("sdnn_learn-*.tar.gz"))


def names_in(sdist):
    """Return the paths of the files of a source distribution, below its only folder."""
    with tarfile.open(sdist) as archive:
        names = [member.name for member in archive.getmembers() if member.isfile()]
    folders = {name.partition("/")[0] for name in names}
    assert len(folders) == 1, folders
    return {name.partition("/")[2] for name in names}


def test_the_source_distribution_has_listed_files_only(sdist):
    shipped = re.compile("|".join(f"(?:{pattern})" for pattern in SHIPPED))
    unlisted = [name for name in sorted(names_in(sdist)) if not shipped.fullmatch(name)]
    assert unlisted == []


def test_the_source_distribution_has_all_files_that_a_build_needs(sdist):
    needed = {
        path.relative_to(ROOT).as_posix()
        for pattern in NEEDED
        for path in ROOT.glob(pattern)
        if path.is_file()
    }
    assert len(needed) > 40
    assert needed <= names_in(sdist)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_wheel_built_from_the_source_distribution_is_complete(sdist, tmp_path):
    for module in ("scikit_build_core", "pybind11", "pip"):
        pytest.importorskip(module)
    command = [sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps"]
    process = subprocess.run(
        [*command, "-w", tmp_path, sdist], capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stdout + process.stderr
    wheel = next(tmp_path.glob("sdnn_learn-*.whl"))
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    sources = ROOT / "python"
    expected = {path.relative_to(sources).as_posix() for path in sources.rglob("*.py")}
    expected |= {"sdnn/_core.pyi", "sdnn/py.typed", "sdnn/share/cmake/sdnn/sdnnConfig.cmake"}
    expected |= {
        f"sdnn/include/{path.relative_to(ROOT / 'cpp' / 'include').as_posix()}"
        for path in (ROOT / "cpp" / "include").rglob("*.hpp")
    }
    assert expected <= names
    assert any(re.fullmatch(r"sdnn/_core\..*(so|pyd)", name) for name in names)
    assert not any("Eigen/" in name or name.startswith("tests") for name in names)
    # The extension takes most of it. The limit is chosen so that debug symbols, or data by mistake,
    # would exceed it.
    assert wheel.stat().st_size < 2_500_000
