"""Both pages: their size, and how they look on phones, in the dark and without motion.

``SDNN_SCREENSHOTS=FOLDER pytest tests/browser/test_pages.py`` keeps pictures of them.
"""

import gzip
import os
from pathlib import Path

import pytest

PAGES = Path(__file__).parents[2] / "docs" / "site" / "demonstration"

NAMES = ("index.html", "balance.html")
SCREENSHOTS = os.environ.get("SDNN_SCREENSHOTS")


def wait_until_ready(page):
    """Wait until the page has loaded its WebAssembly module and drawn."""
    page.locator("#run:enabled").wait_for()
    page.wait_for_timeout(500)


def test_pages_are_small(folder):
    sizes = {path.name: len(gzip.compress(path.read_bytes())) for path in folder.iterdir()}
    assert sum(sizes.values()) <= 300_000, sizes  # bytes, a chosen limit


def test_sources_are_at_most_800_lines():
    files = [path for path in PAGES.iterdir() if path.suffix in (".html", ".css", ".js")]
    assert sum(len(path.read_text("utf-8").splitlines()) for path in files) <= 800


@pytest.mark.parametrize("name", NAMES)
def test_pages_ask_for_nothing_from_outside(name):
    text = (PAGES / name).read_text("utf-8")
    assert "http:" not in text
    assert "https:" not in text


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("name", NAMES)
def test_pages_fit_the_screen_and_follow_its_colors(visit, controls, name, width, scheme, tmp_path):
    page = visit(name, viewport={"width": width, "height": 844}, color_scheme=scheme)
    controls.speed_up(page)
    wait_until_ready(page)
    page.wait_for_timeout(1000)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    # The color is a text such as "rgb(16, 18, 24)".
    red = page.evaluate("parseInt(getComputedStyle(document.body).backgroundColor.slice(4))")
    assert (red < 60) == (scheme == "dark")
    small = page.evaluate(
        """[...document.querySelectorAll("button, input, select")]
           .filter((control) => control.getBoundingClientRect().height < 32).map(({ id }) => id)"""
    )
    assert set(small) <= {"copy"}, "large enough for a finger, but the button that copies text"
    picture = Path(SCREENSHOTS or tmp_path, f"{name[:-5]}-{width}-{scheme}.png")
    picture.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=picture, full_page=True)


@pytest.mark.parametrize("name", NAMES)
def test_nothing_moves_by_itself_with_reduced_motion(visit, name):
    page = visit(name, reduced_motion="reduce")
    wait_until_ready(page)
    assert page.locator("#run").inner_text() == "Start"
    before = page.screenshot()
    page.wait_for_timeout(1500)
    assert page.screenshot() == before


@pytest.mark.parametrize("name", NAMES)
def test_controls_have_names_and_pages_a_language(visit, name):
    page = visit(name)
    wait_until_ready(page)
    assert page.locator("html").get_attribute("lang") == "en"
    unnamed = page.evaluate(
        """[...document.querySelectorAll("input, select")]
           .filter((control) => control.labels.length === 0).map(({ id }) => id)"""
    )
    assert unnamed == []
    for canvas in page.locator("canvas").all():
        assert canvas.get_attribute("aria-label")


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_module_is_reported(chromium, address, name):
    page = chromium.new_page()
    page.route("**/*.wasm", lambda route: route.fulfill(status=404))
    page.goto(f"{address}/{name}")
    page.locator("#error").wait_for()
    assert "must be beside this page, got status 404" in page.locator("#error").inner_text()
    page.close()
