"""Texts use the field's words: none of the expressions of words.txt."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_name("words.txt")
GENERATED = {"docs/reference/settings.md"}
"""Pages whose length is that of what they list."""


def expressions():
    """Return (regular expression, better words) for each line of the list."""
    lines = LIST.read_text("utf-8").splitlines()
    pairs = [line.split("\t") for line in lines if line and not line.startswith("#")]
    return [(re.compile(pattern, re.IGNORECASE), better) for pattern, better in pairs]


def texts():
    """Return the files that users and contributors read."""
    found = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.py")]
    for folder, ending in (("python/sdnn", "*.py"), ("cpp/include", "*.hpp"), ("bench", "*.py")):
        found += (ROOT / folder).rglob(ending)
    return found


def test_the_texts_avoid_what_the_list_names():
    found = []
    for path in texts():
        text = re.sub(r"\s+(?:///?|#)?\s*", " ", path.read_text("utf-8"))
        found += [
            f"{path.relative_to(ROOT)}: {text[max(0, hit.start() - 20) : hit.end()]!r}: {better}"
            for pattern, better in expressions()
            for hit in pattern.finditer(text)
        ]
    assert found == []


def test_the_list_finds_what_it_names():
    examples = ("The agent goes on learning.", "Three rivals", "as they come", "is told")
    for example in examples:
        assert any(pattern.search(example) for pattern, _ in expressions()), example


def n_words(page):
    """Words of a page outside its tables."""
    lines = page.read_text("utf-8").splitlines()
    return sum(len(line.split()) for line in lines if not line.startswith("|"))


def test_the_documents_are_short():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    words = {
        page.relative_to(ROOT).as_posix(): n_words(page)
        for page in pages
        if page.name != "CHANGELOG.md"
    }
    assert sum(words.values()) <= 19_500
    assert words["README.md"] <= 350
    assert {name for name, n in words.items() if n > 1_500} <= GENERATED
