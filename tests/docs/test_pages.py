"""Every block of every page runs, from top to bottom; what is marked is counted."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import run_page

PAGES = {page.relative_to(run_page.ROOT).as_posix(): page for page in run_page.pages()}


def run(page, *options):
    """Run a page in a separate process; return what it prints."""
    process = subprocess.run(
        [sys.executable, "-W", "ignore", run_page.__file__, page, *options],
        capture_output=True,
        text=True,
        check=False,
        start_new_session=True,
    )
    assert process.returncode == 0, process.stdout[-4000:] + process.stderr[-6000:]
    return process.stdout


@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", PAGES)
def test_the_code_blocks_of_a_page_run(name, skip_unless_ci):
    unmet_needs = set(re.findall(r"left out, (needs .*)", run(PAGES[name])))
    if unmet_needs:
        skip_unless_ci(f"all but some blocks ran: {'; '.join(sorted(unmet_needs))}")


@pytest.mark.skipif("SDNN_WEEKLY" not in os.environ, reason="takes an hour: nox -s docs-weekly")
@pytest.mark.timeout(0)
@pytest.mark.parametrize(
    "name",
    [
        name
        for name, page in PAGES.items()
        if any(block.mark == "weekly" for block in run_page.blocks(page))
    ],
)
def test_the_weekly_code_blocks_of_a_page_run(name):
    run(PAGES[name], "--weekly")


def test_two_thirds_of_the_code_blocks_run_at_every_change():
    n_blocks = run_page.count()  # by their marks
    assert set(n_blocks) == {"run", "needs", "weekly", "not run"}
    n_run = n_blocks["run"] + n_blocks["needs"]
    assert n_run > 2 / 3 * n_blocks.total()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("```basic\n10 GOTO 10\n```\n", "a block in basic"),
        ("```sh\npip install .\n```\n", "marked not run"),
        ("```toml\nx = 1\n```\n", "must name a file"),
        ("<!-- sometimes: rain -->\n```sh\nls\n```\n", "no mark is called 'sometimes'"),
    ],
)
def test_unknown_languages_and_marks_of_blocks_are_refused(text, message, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(ValueError, match=message):
        run_page.blocks(page)


def test_the_error_of_a_failing_block_names_it(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("Text.\n\n```python\nx = 1\n```\n\n```python\nassert x == 2\n```\n")
    with pytest.raises(AssertionError, match=r"page\.md from line 8"):
        run(page)
