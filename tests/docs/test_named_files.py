"""Files and tests that the documents and the sessions of nox name exist."""

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


def test_files_and_tests_named_by_sessions_of_nox_exist():
    text = (ROOT / "noxfile.py").read_text("utf-8")
    named = re.findall(r'"(tests/[\w/]+(?:\.py)?)(?:::(\w+))?"', text)
    assert len(named) > 10
    for path, test in named:
        assert (ROOT / path).exists(), path
        assert not test or f"def {test}(" in (ROOT / path).read_text("utf-8"), test
    assert '"-k"' not in text, "an expression could select no test; name the test instead"
