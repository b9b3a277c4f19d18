"""The page of the pole on a cart in Chromium: learning, controls, and pushes by the visitor."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from sdnn.cli import main

HEADERS = Path(__file__).parents[2] / "build" / "demonstration" / "headers"


def test_the_agent_learns_to_balance(visit, controls):
    page = visit("balance.html")
    controls.speed_up(page)
    page.wait_for_function(
        "document.getElementById('summary').textContent === 'The last test had 500.'",
        timeout=60_000,
    )
    n_steps = int(re.match(r"[\d,]+", page.locator("#progress").inner_text())[0].replace(",", ""))
    assert n_steps < 1_000_000


@pytest.mark.parametrize(("copies", "memory"), [(1, "20 kB"), (2, "46 kB"), (3, "108 kB")])
def test_the_number_of_sensors_selects_the_header_of_that_number(visit, controls, copies, memory):
    page = visit("balance.html")
    page.locator("#run:enabled").wait_for()
    controls.slide(page, "copies", copies)
    assert page.locator("#memory").inner_text() == memory
    command = page.locator("#command").text_content()
    assert command.count("--range") == 4 * copies, "four sensors, each so often"


def test_the_command_writes_the_header_that_runs_here(visit, controls, tmp_path, monkeypatch):
    page = visit("balance.html")
    page.locator("#run:enabled").wait_for()
    controls.slide(page, "copies", 2)
    program, *arguments = page.locator("#command").text_content().split()
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, arguments)
    assert (program, result.exit_code) == ("sdnn", 0), result.output
    header = (tmp_path / "pole.h").read_text("utf-8")
    renamed = header.replace("pole", "pole2").replace("POLE", "POLE2")
    assert renamed == (HEADERS / "pole2.h").read_text("utf-8")


def test_keyboard_alone_reaches_every_control_and_pushes_the_cart(visit):
    page = visit("balance.html", reduced_motion="reduce")
    page.locator("#run:enabled").wait_for()
    page.locator("nav a").last.focus()
    for control in ("run", "restart", "push-left", "push-right", "speed", "noise", "copies"):
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.id") == control
    page.locator("#noise").focus()
    page.keyboard.press("End")
    assert page.locator("#noise-text").inner_text() == "10.0 %"
    page.locator("#push-right").focus()
    before = page.locator("#picture").screenshot()
    page.keyboard.down("Space")
    page.wait_for_timeout(1200)  # ms; with reduced motion the picture changes once a second
    pushed = page.locator("#picture").screenshot()
    page.keyboard.up("Space")
    page.wait_for_timeout(1200)
    assert pushed != before, "a hand touches the cart"
    assert page.locator("#picture").screenshot() == before, "and leaves it"


def test_a_press_beside_the_cart_pushes_it(visit, controls):
    page = visit("balance.html")
    page.locator("#run:enabled").wait_for()
    controls.slide(page, "speed", 0)
    page.locator("#restart").click()
    picture = page.locator("#picture").bounding_box()
    before = page.locator("#progress").inner_text()
    page.mouse.move(picture["x"] + 10, picture["y"] + picture["height"] / 2)
    page.mouse.down()
    page.wait_for_function(
        "before => document.getElementById('progress').textContent !== before", arg=before
    )
    page.mouse.up()
    assert page.locator("#error").is_hidden()
