"""Hostile names in a store or study are harmless in tables, pages and figures."""

import csv
import json
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from hypothesis import example, given, settings, strategies as st
from markdown_it import MarkdownIt

from made_records import make_record
from sdnn.reports.pages import Page, Section, Table
from sdnn.reports.plots import figure_bytes
from sdnn.runs.figures import draw_study
from sdnn.runs.study import compare
from sdnn.runs.sweep import study_json, study_page, trial_table
from sdnn.support.csv_files import csv_bytes

FRAGMENTS = (
    "=1+1", "+2", "-3", "@SUM(A1)", "=cmd|' /C calc'!A0", "\t=4", "|", "\\", "`", "*", "_", "~~",
    "<script>alert(1)</script>", "<img src=x onerror=y>", "<!--", "&lt;", "\"'>", "](http://x.de)",
    "[a]", "![i]", "[r]: http://x.de", "http://x.de", "www.x.de", "a@x.de", "{{ 7 * 7 }}", "{% x",
    "#", "$x$", "\n", "- ", "1. ", " ", "n",
)  # fmt: skip
NAMES = st.lists(st.sampled_from(FRAGMENTS), min_size=1, max_size=6).map("".join).filter(str.strip)
HARMLESS_TAGS = {
    "strong", "h1", "h2", "p", "ul", "li", "table", "thead", "tbody", "tr", "th", "td",
}  # fmt: skip
WORST = "=1|<script>x</script> [a](http://x.de) *b* `c` {{ 1 }}"


class Tags(HTMLParser):
    """The elements, attributes and texts of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.texts = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += attributes

    def handle_data(self, data):
        self.texts.append(" ".join(data.split()))


def single_spaced(name):
    """Return the name as browsers show it: spaces and line breaks in a row are one space."""
    return " ".join(name.split())


def table_of(name):
    rows = [(name, "1"), ("b", name)]
    return Table(title=name, header=("what", name), rows=rows, kinds={name: "good"})


@settings(max_examples=40, deadline=None)
@given(NAMES)
@example(WORST)
def test_hostile_names_are_no_formulas_in_csv_files(name):
    header, *rows = csv.reader(
        csv_bytes([name], [[name], [-1.5], ["-1.5"]]).decode().splitlines(True)
    )
    assert rows[1:] == [["-1.5"], ["-1.5"]]
    for (cell,) in (header, rows[0]):
        assert cell.removeprefix("'") == name
        is_formula = cell.startswith(("=", "+", "-", "@", "\t", "\r"))
        assert not is_formula or float(cell), "numbers such as -3 are no formulas"


@settings(max_examples=40, deadline=None)
@given(NAMES)
@example(WORST)
def test_markdown_shows_hostile_names_as_plain_text(name):
    page = Page(
        title=name, intro=f"About {name}", warnings=[name], source=f"From {name}",
        sections=[Section(table=table_of(name), notes=[f"About {name}"], terms={"a": name})],
    )  # fmt: skip
    rendered = Tags(MarkdownIt("gfm-like", {"linkify": False}).render(page.to_markdown()))
    assert set(rendered.tags) <= HARMLESS_TAGS, page.to_markdown()
    assert rendered.tags.count("td") == 2 * 2, "no name splits a cell"
    # At least as the titles of page and table, as warning, in the table's header and its rows.
    assert rendered.texts.count(single_spaced(name)) >= 5


@settings(max_examples=40, deadline=None)
@given(NAMES)
@example(WORST)
def test_html_shows_hostile_names_as_plain_text(name):
    table = table_of(name)
    page = Page(
        title=name, intro=name, warnings=[name], source=name,
        sections=[
            Section(picture=b"<svg/>", alt=name, table=table, notes=[name], terms={name: name}),
            Section(title=name),
            Section(folded=[Section(title=name, notes=[name], text=name, table=table)]),
        ],
    )  # fmt: skip
    plain_page = replace(page, title="n", intro="n", source="n")
    tags = Tags(page.to_html(name))
    assert tags.tags == Tags(plain_page.to_html("n")).tags
    assert {"script", "a"}.isdisjoint(tags.tags)
    assert [value for key, value in tags.attributes if key == "alt"] == [name]
    assert not [key for key, _ in tags.attributes if key.startswith("on")]
    assert sum(single_spaced(name) in text for text in tags.texts) >= 11, "fields with the name"


@pytest.mark.parametrize("name", [WORST, "$\\frac{", "a$_$", "&<>\"'", "=1+1", "-x|\\"])
def test_the_outputs_of_a_study_with_hostile_names_are_harmless(study, name):
    hostile = study(
        f"[study]\ntitle = {json.dumps(name)}\ntrials = 2\n"
        f"[cases.mine]\ntitle = {json.dumps(name)}\nenvironment = 'sdnn/PaperAcrobot-v0'\n"
        f"[variants.{json.dumps(name)}]\n[variants.other]\ntitle = {json.dumps(name)}\n"
        "learning.discount = 0.5\n"
    )
    records = [
        make_record(
            config=combination.spec.canonical_json(),
            key=key,
            version=name,
            finished_at=name,
            steps=[4] * 20,
        )
        for pair, combination in hostile.combinations.items()
        for key in hostile.keys(*pair)
    ]
    comparison = compare(hostile, records)
    _, svg = figure_bytes(draw_study(comparison, name))
    assert "script" not in {element.tag for element in ElementTree.fromstring(svg).iter()}
    additions, digest = hostile.additions(comparison), "abc"
    page = study_page(comparison, digest, additions, svg)
    assert "script" not in Tags(page.to_html("")).tags
    markdown = MarkdownIt("gfm-like", {"linkify": False}).render(page.to_markdown())
    assert set(Tags(markdown).tags) <= HARMLESS_TAGS
    assert json.loads(json.dumps(study_json(comparison, digest, additions)))
    table = csv_bytes(*trial_table(comparison)).decode()
    cells = {cell for row in csv.reader(table.splitlines(True)) for cell in row}
    assert {cell for cell in cells if cell.startswith(("=", "+", "-", "@", "\t"))} == set()
    assert name in {cell.removeprefix("'") for cell in cells}
