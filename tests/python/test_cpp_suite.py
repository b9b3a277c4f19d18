"""The C++ tests as tests of the Python suite: nobody has to remember to run both."""

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def build_folder(request, tmp_path):
    """A folder that outlives the session where pytest keeps a cache: the next build is short."""

    def _build_folder(preset):
        cache = getattr(request.config, "cache", None)
        return Path(cache.mkdir(f"cpp_suite_{preset}")) if cache is not None else tmp_path

    return _build_folder


@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    ("preset", "compiler"),
    [
        ("dev", "g++"),
        pytest.param("sanitize", "clang++", marks=pytest.mark.slow),
        pytest.param("gcc", "g++", marks=pytest.mark.slow),
        pytest.param("clang", "clang++", marks=pytest.mark.slow),
        pytest.param("aarch64", "aarch64-linux-gnu-g++", marks=pytest.mark.slow),  # emulated
    ],
)
def test_the_cpp_suite_passes(preset, compiler, cmake, configure, build_folder, skip_unless_ci):
    if shutil.which(compiler) is None:
        skip_unless_ci(f"needs {compiler}")
    build = build_folder(preset)
    configured = configure(ROOT, build, "--preset", preset)
    if "the C++ tests need" in configured.stderr:
        skip_unless_ci("needs GoogleTest and JSON: apt install libgtest-dev nlohmann-json3-dev")
    if "is not able to compile a simple test program" in " ".join(configured.stderr.split()):
        skip_unless_ci(f"{compiler} cannot link: apt install libclang-rt-dev for its sanitizers")
    assert configured.returncode == 0, configured.stdout + configured.stderr
    jobs = str(os.cpu_count() or 1)
    built = cmake("--build", build, "--parallel", jobs)
    assert built.returncode == 0, (built.stdout + built.stderr)[-8000:]
    tested = cmake("--test-dir", build, "--output-on-failure", "--parallel", jobs, tool="ctest")
    assert tested.returncode == 0, tested.stdout[-8000:]
    assert "No tests were found" not in tested.stdout + tested.stderr
