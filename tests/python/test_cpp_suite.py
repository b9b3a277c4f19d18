"""The C++ tests as one test of the Python suite: nobody has to remember to run both."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def build_folder(request, tmp_path):
    """A folder that outlives the session where pytest keeps a cache: the next build is short."""
    cache = getattr(request.config, "cache", None)
    return Path(cache.mkdir("cpp_suite")) if cache is not None else tmp_path


@pytest.mark.timeout(1800)
def test_the_cpp_suite_passes(cmake, configure, build_folder, skip_unless_ci):
    configured = configure(ROOT, build_folder, "-DSDNN_BUILD_TESTS=ON", "-DSDNN_WERROR=ON")
    if "the C++ tests need GoogleTest" in configured.stderr:
        skip_unless_ci("needs GoogleTest: apt install libgtest-dev, or -DGTEST_SOURCE_DIR")
    assert configured.returncode == 0, configured.stdout + configured.stderr
    jobs = str(os.cpu_count() or 1)
    built = cmake("--build", build_folder, "--parallel", jobs)
    assert built.returncode == 0, (built.stdout + built.stderr)[-8000:]
    tested = cmake(
        "--test-dir", build_folder, "--output-on-failure", "--parallel", jobs, tool="ctest"
    )
    assert tested.returncode == 0, tested.stdout[-8000:]
    assert "No tests were found" not in tested.stdout + tested.stderr
