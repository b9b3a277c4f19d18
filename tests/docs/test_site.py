"""The documentation as a site: builds without a warning, every link leads somewhere."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sdnn

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory, skip_unless_ci):
    if importlib.util.find_spec("mkdocs") is None:
        skip_unless_ci("needs mkdocs: pip install .[docs]")
    folder = tmp_path_factory.mktemp("site") / "site"
    process = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stdout + process.stderr
    return folder


def pages(site):
    """Return the text of each page by its path in the site."""
    return {p.relative_to(site).as_posix(): p.read_text("utf-8") for p in site.rglob("*.html")}


def test_every_document_is_in_the_navigation(site):
    paths = set(pages(site))
    for document in (ROOT / "docs").rglob("*.md"):
        place = document.relative_to(ROOT / "docs")
        if place.as_posix() == "site/first-page.md":
            continue  # it is index.html
        folder = place.parent if place.stem == "README" else place.with_suffix("")
        assert f"{folder.as_posix()}/index.html" in paths
    assert "index.html" in paths


def test_every_internal_link_of_the_site_resolves(site):
    for name, text in pages(site).items():
        if name == "404.html":
            continue
        for target in re.findall(r'(?:href|src)="([^"#?]+)', text):
            if re.match(r"[a-z]+:|//", target):
                continue
            path = (site / name).parent / target
            assert path.exists(), f"{name} links to {target}"


def test_the_demonstration_is_there_if_it_has_been_built(site):
    names = ("acrobot.wasm", "pole.wasm")
    is_built = all((ROOT / "build" / "demonstration" / name).is_file() for name in names)
    first_page = (site / "index.html").read_text("utf-8")
    assert ('href="demonstration/index.html">Try it now' in first_page) == is_built
    sources = {path.name for path in (ROOT / "docs" / "site" / "demonstration").iterdir()}
    copied = {path.name for path in (site / "demonstration").glob("*")}
    assert copied == ({*names, *sources} if is_built else set())


def test_the_reference_has_every_public_name(site):
    text = "".join(page.read_text("utf-8") for page in (site / "reference").rglob("*.html"))
    packages = {name for name in sdnn.__all__ if hasattr(getattr(sdnn, name), "__all__")}
    for package in packages:
        for name in getattr(sdnn, package).__all__:
            entry = f'id="sdnn.{package}.{name}"'
            assert text.count(entry) == 1, f"{package}.{name} has no entry, or several"


N_WIDE_TABLES = """
  [...document.querySelectorAll('.md-content table')].filter((table) => {
    const around = table.closest('.md-typeset__scrollwrap') ?? table.parentElement;
    return around.scrollWidth > around.clientWidth + 1;
  }).length
"""
"""JavaScript for the number of tables that are wider than the column of a page."""


def test_pages_fit_the_screen_and_have_a_search_box(site, chromium):
    names = [name for name, text in pages(site).items() if "md-content" in text]
    assert len(names) > 40
    for width in (390, 1280):  # pixels, of a phone and of a laptop
        page = chromium.new_page(viewport={"width": width, "height": 900})
        for name in names:
            page.goto((site / name).as_uri())
            assert page.locator(".md-search__input").count() == 1, name
            assert page.evaluate("document.documentElement.scrollWidth") <= width, (name, width)
            assert width < 1280 or page.evaluate(N_WIDE_TABLES) == 0, name
        page.close()


def test_the_benchmarks_begin_with_their_picture(site):
    text = (site / "evidence" / "benchmarks" / "index.html").read_text("utf-8")
    assert re.search(r"</h1>\s*<p><img ", text)


def test_doxygen_builds_the_cpp_reference_without_warnings(tmp_path, skip_unless_ci):
    if shutil.which("doxygen") is None:
        skip_unless_ci("needs doxygen")
    text = (ROOT / "docs/site/Doxyfile").read_text() + f'\nOUTPUT_DIRECTORY = "{tmp_path}"\n'
    process = subprocess.run(
        ["doxygen", "-"], input=text, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert process.returncode == 0, process.stderr[-4000:]
    assert (tmp_path / "html" / "classsdnn_1_1approximators_1_1SDNNC.html").exists()
