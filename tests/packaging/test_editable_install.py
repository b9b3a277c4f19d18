"""An editable install, whose modules stay in the source tree and whose built files do not."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from sdnn import _core

ROOT = Path(__file__).parents[2]
BUILD_FILES = ("CMakeLists.txt", "pyproject.toml", "README.md", "LICENSE", "THIRD_PARTY_NOTICES.md")

IMPORT_ONLY_THE_INSTALL = """
import site, sys
site.addsitedir(sys.argv[1])  # reads the .pth file that adds the editable install's finder
sys.path.append(sys.argv[2])  # other packages
sys.argv = ["sdnn", *sys.argv[3:]]
from sdnn.cli import main
main()
"""


@pytest.fixture(scope="module")
def run_sdnn(tmp_path_factory):
    """Makes an editable install; returns a function that runs its command ``sdnn``."""
    pytest.importorskip("scikit_build_core")
    source, wheel, site = (tmp_path_factory.mktemp(name) for name in ("source", "wheel", "site"))
    for name in BUILD_FILES:
        shutil.copy(ROOT / name, source)
    for name in ("cmake", "cpp", "python"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("_core.*.so"))
    # The compiled extension is there already: installing it takes the place of its compilation.
    extension = Path(_core.__file__).as_posix()
    bindings = source / "cpp" / "bindings" / "CMakeLists.txt"
    bindings.write_text(f'install(FILES "{extension}" DESTINATION sdnn)\n')
    code = f"from scikit_build_core.build import build_editable; build_editable({str(wheel)!r})"
    process = subprocess.run(
        [sys.executable, "-c", code], cwd=source, capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stdout + process.stderr
    with zipfile.ZipFile(next(wheel.glob("*.whl"))) as archive:
        archive.extractall(site)

    def run(*arguments):
        command = [sys.executable, "-I", "-S", "-c", IMPORT_ONLY_THE_INSTALL]
        command += [site, sysconfig.get_path("purelib"), *arguments]
        environment = os.environ | {"MPLBACKEND": "Agg"}
        process = subprocess.run(
            command, capture_output=True, text=True, cwd=site, env=environment, check=False
        )
        assert process.returncode == 0, process.stdout + process.stderr
        return process.stdout

    return run


def test_an_editable_install_finds_the_built_cmake_package(run_sdnn):
    assert (Path(run_sdnn("--cmakedir").strip()) / "sdnnConfig.cmake").is_file()


def test_an_editable_install_finds_templates_and_c_files(run_sdnn, tmp_path):
    folder, header = tmp_path / "run", tmp_path / "cart.h"
    # More steps than the warm-up of 1,000, before which there is nothing to export.
    printed = run_sdnn("train", "CartPole-v1", "--steps", "1100", "--out", folder)
    assert "sdnn evaluate" in printed, "the last lines of cli/outcome.txt.jinja"
    run_sdnn("export", folder, "--learning", "--c-header", header)
    assert "cart_learn(" in header.read_text(), "of cpp/c"


def test_an_editable_install_finds_what_a_report_needs(run_sdnn, tmp_path):
    forecast = run_sdnn("reproduce", "b", "--dry-run", "--out", tmp_path)
    assert "in all 80 trials" in forecast, "4 cases, 2 agents, 10 trials; cli/forecast.txt.jinja"
    run_sdnn("reproduce", "a", "--trials", "1", "--episodes", "10", "--out", tmp_path)
    (page,) = tmp_path.glob("report-*.html")
    assert page.read_text().endswith("</html>\n"), "of page.html.jinja; claims.toml was read, too"
