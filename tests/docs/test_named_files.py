"""Files that the documents name in backticks exist in the repository."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_files_named_by_the_documents_exist():
    folders = [ROOT / name for name in ("cpp", "python", "bench", "tests", "docs")]
    there = {f"/{path.as_posix()}" for folder in folders for path in folder.rglob("*.*")}
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    named = [
        (page.name, name)
        for page in pages
        for name in re.findall(r"`(\w+(?:/\w+)+\.(?:hpp|cpp|py))`", page.read_text("utf-8"))
    ]
    assert len(named) > 20
    missing = [pair for pair in named if not any(path.endswith(f"/{pair[1]}") for path in there)]
    assert missing == []
