"""Run the code of a page from top to bottom, in order: ``python tests/docs/run_page.py PAGE``.

Blocks in ``python`` share their global names, blocks in ``sh`` their folder: a temporary one that
looks like a clone, with a copy of ``docs``. A block whose first line names a file, as
``# docking.py`` does, is written to it; blocks in languages that are not run must name one. A
comment before a block is its mark, and restricts when it is run::

    <!-- needs: gcc -->            only if all names, listed in NEEDS, are available
    <!-- weekly: 3 minutes -->     only with --weekly, because it takes more than a minute; also
                                   without a mark if it begins with "python bench/"
    <!-- not run: needs SLURM -->  never; required for blocks that install something

``--list`` counts the blocks of all pages.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]

RUN = ("python", "sh")
WRITTEN = ("python", "toml", "c", "cpp", "cmake")
SHOWN = ("text", "")
"""Languages of blocks that are run, that are written to a file, and that are neither."""

_BLOCK = re.compile(r"(?:^<!-- (\w[\w ]*): ([^\n]*) -->\n)?^```(\w*)\n(.*?)^```", re.S | re.M)
_NAME = re.compile(r"(?:#|//) ([\w/-]+\.\w+)$", re.M)


class Block(NamedTuple):
    """A block of a page."""

    line: int
    """The number of the line ```LANGUAGE, from 1."""
    language: str
    text: str
    mark: str = ""
    """The word "needs", "weekly" or "not run", or "" without a comment."""
    reason: str = ""
    """The text after the mark in the comment."""


def pages() -> list[Path]:
    """List the pages that have code, sorted by their paths."""
    paths = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
    return [page for page in paths if any(b.language not in SHOWN for b in blocks(page))]


def blocks(page: Path) -> list[Block]:
    """List the blocks of a page.

    Raises
    ------
    ValueError
        If a language or a mark is unknown, or a block lacks the name of a file or a mark.
    """
    text = page.read_text("utf-8")
    blocks_of_page = []
    for match in _BLOCK.finditer(text):
        mark, reason, language, content = match.groups(default="")
        if not mark and language == "sh" and content.startswith("python bench/"):
            mark, reason = "weekly", "a measurement"
        line = text.count("\n", 0, match.start(3)) + 1
        if language not in {*RUN, *WRITTEN, *SHOWN}:
            raise ValueError(f"{page}:{line}: a block in {language} is neither run nor written")
        if language in WRITTEN and language not in RUN and not _NAME.match(content):
            raise ValueError(
                f"{page}:{line}: the first line must name a file, as # mine.{language}"
            )
        if mark not in ("", "needs", "weekly", "not run"):
            raise ValueError(f"{page}:{line}: no mark is called {mark!r}")
        if language == "sh" and mark != "not run" and re.search(r"\b(pip|apt) install\b", content):
            raise ValueError(f"{page}:{line}: a block that installs something is marked not run")
        blocks_of_page.append(Block(line, language, content, mark, reason))
    return blocks_of_page


def _is_sdnn_installed() -> bool:
    """Return whether the package is installed: only then its CMake files are beside it."""
    command = [sys.executable, "-m", "sdnn", "--cmakedir"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


NEEDS: dict[str, Callable[[], bool]] = {
    "gcc": lambda: shutil.which("gcc") is not None,
    "cmake": lambda: shutil.which("cmake") is not None,
    "nlohmann/json": Path("/usr/include/nlohmann/json.hpp").exists,
    "an installed package": _is_sdnn_installed,
}
"""Functions that return whether a need is available, by the names in marks."""


def missing(block: Block) -> list[str]:
    """List what a block needs and this machine lacks."""
    needed = block.reason.split(", ") if block.mark == "needs" else []
    return [name for name in needed if not NEEDS[name]()]


def is_due(block: Block, *, weekly: bool) -> bool:
    """Return whether a block is to be run or written."""
    return not block.mark or block.mark == "needs" or (weekly and block.mark == "weekly")


def make_folder(folder: Path) -> dict[str, str]:
    """Make a folder look like a clone; return the environment of its commands."""
    for path in ROOT.iterdir():
        if path.name not in (".git", "docs", "build", "results", "runs"):
            (folder / path.name).symlink_to(path)
    shutil.copytree(ROOT / "docs", folder / "docs")
    commands = folder / ".commands"
    commands.mkdir()
    (commands / "sdnn").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sdnn "$@"\n')
    (commands / "sdnn").chmod(0o755)
    beside = Path(sys.executable).parent
    path = os.pathsep.join([str(commands), str(beside), os.environ["PATH"]])
    return os.environ | {"PATH": path, "MPLBACKEND": "Agg", "SDL_VIDEODRIVER": "dummy"}


def run(page: Path, *, weekly: bool) -> Iterator[tuple[Block, float, list[str]]]:
    """Run a page in the current folder; yield each block, its seconds, and the needs it lacks.

    A block that lacks something is written to its file, but not run.
    """
    global_names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.language in SHOWN or not is_due(block, weekly=weekly):
            continue
        begin = time.perf_counter()
        lacks = missing(block)
        name = _NAME.match(block.text)
        if name and block.language in WRITTEN:
            path = Path(name[1])
            path.parent.mkdir(exist_ok=True)
            path.unlink(missing_ok=True)
            path.write_text(block.text, "utf-8")
        if block.language == "python" and not lacks:
            where = f"{page.name} from line {block.line + 1}"
            exec(compile(block.text, where, "exec"), global_names)
        elif block.language == "sh" and not lacks:
            _run_shell(block.text)
        yield block, time.perf_counter() - begin, lacks


def _run_shell(text: str) -> None:
    """Run a block in sh, and end the processes that it leaves in the background."""
    command = ["bash", "-euo", "pipefail", "-c", text]
    shell = subprocess.Popen(command, start_new_session=True)
    try:
        if shell.wait():
            raise subprocess.CalledProcessError(shell.returncode, command)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(shell.pid, signal.SIGTERM)


def count() -> Counter[str]:
    """Count the blocks of all pages by their marks."""
    code_blocks = (b for page in pages() for b in blocks(page) if b.language not in SHOWN)
    return Counter(block.mark or "run" for block in code_blocks)


def main() -> None:
    """Run a page, or count blocks."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("page", type=Path, nargs="?")
    parser.add_argument("--weekly", action="store_true", help="blocks over a minute, too")
    parser.add_argument("--list", action="store_true", help="count the blocks of all pages")
    options = parser.parse_args()
    if options.list:
        print(*(f"{mark}: {n}" for mark, n in sorted(count().items())), sep="\n")
        return
    if options.page is None:
        parser.error("name a page, or --list")
    page = options.page.resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(make_folder(Path(folder)))
        os.chdir(folder)
        sys.path[:0] = [folder]
        for block, seconds, lacks in run(page, weekly=options.weekly):
            outcome = f"left out, needs {', '.join(lacks)}" if lacks else f"{seconds:.1f} s"
            print(f"{page.name}:{block.line} {block.language}: {outcome}", flush=True)
        os.chdir(ROOT)


if __name__ == "__main__":
    main()
