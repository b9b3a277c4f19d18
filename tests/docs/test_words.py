"""The language of texts, sources and commits: words, openings of comments, lengths."""

import ast
import io
import re
import subprocess
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_name("words.txt")
GENERATED = {"docs/reference/settings.md"}
"""Pages whose length is that of what they list."""

SOURCES = ("bench", "cpp", "docs", "python/sdnn", "tests")
LAST_LONG_SUBJECT = "9b2e235"


def expressions():
    """Return (regular expression, better words) for each line of the list."""
    lines = LIST.read_text("utf-8").splitlines()
    pairs = [line.split("\t") for line in lines if line and not line.startswith("#")]
    gap = r"\s+(?:(?:///?|#)\s*)?"  # within a line, or from one line of a comment to the next
    return [(re.compile(pattern.replace(" ", gap), re.I), better) for pattern, better in pairs]


def pages():
    return [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]


def sources():
    """Return the files in Python, C++ and C whose comments are checked."""
    files = [path for folder in SOURCES for path in (ROOT / folder).rglob("*.[chp]*")]
    return sorted(path for path in files if path.suffix in (".py", ".cpp", ".hpp", ".h", ".c"))


def comments(path):
    """Return (line, text) of each docstring and of the first line of each block of comments."""
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        lines = enumerate(text.splitlines(), 1)
        return first_lines((n, line.strip()) for n, line in lines if re.match(r"\s*//", line))
    docstrings = [
        (node.lineno, node.value.value.strip())
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ]
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return docstrings + first_lines(
        (token.start[0], token.string)
        for token in tokens
        if token.type == tokenize.COMMENT and token.line.lstrip().startswith("#")
    )


def first_lines(lines):
    """Return the first line of each run of (number, comment), without the comment's sign."""
    runs, previous = [], None
    for number, line in lines:
        if previous != number - 1:
            runs.append((number, line.lstrip("/#<! ")))
        previous = number
    return runs


def test_texts_avoid_the_listed_expressions():
    violations = []
    for path in {*pages(), *sources()} - {Path(__file__)}:
        text = path.read_text("utf-8")
        violations += [
            f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}: "
            f"{match[0]!r}: {better}"
            for pattern, better in expressions()
            for match in pattern.finditer(text)
        ]
    assert sorted(violations) == []


def test_each_listed_expression_matches_its_example():
    examples = ("The agent goes on learning.", "Three rivals", "as they\n    // come", "is told")
    for example in examples:
        assert any(pattern.search(example) for pattern, _ in expressions()), example


def test_comments_do_not_open_with_fragments():
    violations = [
        f"{path.relative_to(ROOT)}:{line}: {text.splitlines()[0]}"
        for path in sources()
        for line, text in comments(path)
        if re.match(r"(What|One|Of|The same|That|As)\b", text)
    ]
    assert violations == []


def test_subjects_of_commits_have_at_most_72_characters():
    log = ["git", "log", "--format=%h %s", f"{LAST_LONG_SUBJECT}..HEAD"]
    history = subprocess.run(log, cwd=ROOT, capture_output=True, text=True, check=False)
    if history.returncode:
        pytest.skip("needs the history")
    subjects = [line.partition(" ") for line in history.stdout.splitlines()]
    assert [commit for commit, _, subject in subjects if len(subject) > 72] == []


def n_words(page):
    """Words of a page outside its tables."""
    lines = page.read_text("utf-8").splitlines()
    return sum(len(line.split()) for line in lines if not line.startswith("|"))


def test_documents_keep_their_limits_of_words():
    lengths = {
        page.relative_to(ROOT).as_posix(): n_words(page)
        for page in pages()
        if page.name != "CHANGELOG.md"
    }
    assert sum(lengths.values()) <= 23_000
    assert lengths["README.md"] <= 400
    assert {name for name, n in lengths.items() if n > 1_500} <= GENERATED
