"""The fuzz targets over their kept corpus, and for a short time beyond it."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FUZZ = ROOT / "tests" / "fuzz"
TARGETS = sorted(path.stem for path in FUZZ.glob("*_fuzz.cpp"))
SECONDS = int(os.environ.get("SDNN_FUZZ_SECONDS", "12"))
"""For each target; a minute for all of them by default."""

SEEDS = {"agent_file_fuzz": ROOT / "tests" / "data" / "agents"}


def fuzz(program, target, corpus):
    """Run a target as CONTRIBUTING says; return the finished process."""
    folders = [corpus, FUZZ / "corpus" / target, *([SEEDS[target]] if target in SEEDS else [])]
    limits = ["-rss_limit_mb=1024", "-timeout=10", "-max_len=16384", "-len_control=10"]
    return subprocess.run(
        [program, *limits, f"-max_total_time={SECONDS}", "-print_final_stats=1", *folders],
        capture_output=True,
        text=True,
        cwd=corpus.parent,
        check=False,
    )


@pytest.mark.timeout(1800)
def test_no_input_crashes_hangs_or_takes_a_gigabyte(cmake, configure, tmp_path, skip_unless_ci):
    if shutil.which("clang++") is None:
        skip_unless_ci("needs clang++")
    build = tmp_path / "build"
    configured = configure(ROOT, build, "--preset", "fuzz")
    if "is not able to compile a simple test program" in " ".join(configured.stderr.split()):
        skip_unless_ci("clang++ cannot link: apt install libclang-rt-dev for its sanitizers")
    assert configured.returncode == 0, configured.stdout + configured.stderr
    built = cmake("--build", build, "--parallel", str(os.cpu_count() or 1))
    assert built.returncode == 0, (built.stdout + built.stderr)[-8000:]
    assert len(TARGETS) > 3
    for target in TARGETS:
        assert len(list((FUZZ / "corpus" / target).iterdir())) > 5
        corpus = tmp_path / target / "corpus"
        corpus.mkdir(parents=True)
        done = fuzz(build / "tests" / "fuzz" / target, target, corpus)
        assert done.returncode == 0, done.stderr[-8000:]
        assert "stat::number_of_executed_units:" in done.stderr
