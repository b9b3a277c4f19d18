"""The headers without CMake: they refuse old standards and options that change results."""

import shutil
import subprocess
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXACT = ("-ffp-contract=off", "-DSDNN_NO_CONTRACTION")

WITHOUT_EXCEPTIONS = """
#include <cstdio>
#include <cstdlib>

#include "sdnn/sdnn.hpp"

int main(int argc, char**) {
  sdnn::core::error_handler() = [](const char* message) {
    std::printf("handled: %s\\n", message);
    std::exit(3);
  };
  sdnn::environments::AcrobotConfig config;
  if (argc > 1) config.integration_step = -1.0;
  sdnn::environments::Acrobot acrobot(config);
  std::printf("%d\\n", acrobot.step(1.0, 0.0).terminated);
}
"""


@pytest.fixture(params=["g++", "clang++"])
def compile_program(request, tmp_path, skip_unless_ci):
    """Compiles a source file to the program "main", with Eigen as a wheel or a system package."""
    if shutil.which(request.param) is None:
        skip_unless_ci(f"needs {request.param}")
    eigen = Path(sysconfig.get_path("purelib"), "cmeel.prefix", "include", "eigen3")

    def _compile_program(source, *options):
        (tmp_path / "main.cpp").write_text(source)
        return subprocess.run(
            [
                *(request.param, "-std=c++20", f"-I{ROOT / 'cpp' / 'include'}"),
                *("-isystem", str(eigen), "-isystem", "/usr/include/eigen3"),
                *options,
                *(tmp_path / "main.cpp", "-o", tmp_path / "main"),
            ],
            capture_output=True,
            text=True,
            check=False,
        )

    return _compile_program


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "compile with -ffp-contract=off -DSDNN_NO_CONTRACTION"),
        (("-Ofast", *EXACT), "results would not be exact with -ffast-math, -Ofast"),
        (("-ffast-math", *EXACT), "results would not be exact with -ffast-math, -Ofast"),
        (("-ffinite-math-only", *EXACT), "results would not be exact with -ffast-math, -Ofast"),
        (("-std=c++17", *EXACT), "sdnn needs C++20"),
    ],
)
def test_compiler_options_that_change_results_are_refused(options, message, compile_program):
    source = '#include "sdnn/core/random.hpp"\nint main() {}\n'
    process = compile_program(source, "-fsyntax-only", *options)
    assert process.returncode != 0
    assert message in process.stderr


def test_the_documented_compiler_options_are_accepted(compile_program):
    source = '#include "sdnn/core/random.hpp"\nint main() {}\n'
    process = compile_program(source, "-fsyntax-only", *EXACT)
    assert process.returncode == 0, process.stderr


@pytest.mark.timeout(300)
def test_a_program_without_exceptions_receives_errors_by_its_handler(compile_program, tmp_path):
    options = ("-O0", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror")
    compiled = compile_program(WITHOUT_EXCEPTIONS, *options, *EXACT)
    assert compiled.returncode == 0, compiled.stderr
    run = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    assert run.stdout == "0\n", "one step does not end an episode"
    run = subprocess.run([tmp_path / "main", "bad"], capture_output=True, text=True, check=False)
    assert run.returncode == 3, "the exit code of the program's handler"
    assert run.stdout.startswith("handled: integration_step must be ")
