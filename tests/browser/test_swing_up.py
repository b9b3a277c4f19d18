"""The page of experiment B in Chromium: the bits of a trial, controls, and how fast it is."""

import re
import shlex

import pytest
from click.testing import CliRunner

from sdnn.cli import main

FINISH_MS = 120_000
"""Limit of the time in which both agents learn 1,000 episodes."""


def finish(page, controls, *, sensors, noise=0.02, seed=0, preset="robust"):
    """Let both agents learn 1,000 episodes with settings of the controls.

    Returns the digest of the rows and the command of `sdnn` that the page shows at the end.
    """
    page.locator("#preset").select_option(preset)
    controls.slide(page, "sensors", sensors)
    controls.slide(page, "noise", noise)
    page.locator("#seed").fill(str(seed))
    page.locator("#seed").press("Tab")
    controls.speed_up(page)
    page.locator("#result").wait_for(timeout=FINISH_MS)
    return page.locator("#digest").inner_text(), page.locator("#command").inner_text()


def native_digest(command, folder):
    """Run a command of the page on this machine; return the digest that it prints."""
    program, *arguments = shlex.split(command)
    assert program == "sdnn"
    result = CliRunner().invoke(main, [*arguments, "--out", str(folder)])
    assert result.exit_code == 0, result.output
    return re.search(r"digest of the rows ([0-9a-f]{16})", result.output)[1]


@pytest.mark.parametrize("sensors", [4, 6])
@pytest.mark.parametrize("seed", [0, 1, 999_999])
def test_1000_episodes_have_the_digest_of_the_native_trials(
    visit, controls, tmp_path, sensors, seed
):
    digest, command = finish(visit("index.html"), controls, sensors=sensors, seed=seed)
    assert f"--sensors {sensors} --noise 0.02 --agent sdnn-c-robust --agent fuzzy" in command
    assert command.endswith(f"--trials 1 --episodes 1000 --seed {seed}")
    assert digest == native_digest(command, tmp_path)


@pytest.mark.parametrize(("sensors", "noise", "preset"), [(5, 0.035, "paper"), (5, 0, "robust")])
def test_other_noise_and_the_settings_of_the_paper_have_native_digests(
    visit, controls, tmp_path, sensors, noise, preset
):
    page = visit("index.html")
    digest, command = finish(page, controls, sensors=sensors, noise=noise, preset=preset)
    assert digest == native_digest(command, tmp_path)


def test_speed_does_not_change_the_rows(visit, controls):
    page = visit("index.html")
    controls.slide(page, "speed", 3)
    page.wait_for_timeout(1500)  # ms, in which the agents begin at this speed
    controls.speed_up(page)
    page.locator("#result").wait_for(timeout=FINISH_MS)
    digest_of_both_speeds = page.locator("#digest").inner_text()
    page.locator("#restart").click()
    assert page.locator("#result").is_hidden()
    page.locator("#result").wait_for(timeout=FINISH_MS)
    assert page.locator("#digest").inner_text() == digest_of_both_speeds


def test_curves_and_summary_follow_the_trials(visit, controls):
    page = visit("index.html")
    finish(page, controls, sensors=6)
    summary = page.locator("#summary").inner_text()
    sdnn_c, fuzzy = re.findall(r"(\d+) of (\d+) tests", summary)
    assert (sdnn_c[1], fuzzy[1]) == ("100", "100"), "a test after each 10 of 1,000 episodes"
    assert int(sdnn_c[0]) > int(fuzzy[0]), "SDNN-C keeps the swing-up, fuzzy Q-learning does not"
    colors = page.locator("#chart").evaluate(
        """canvas => new Set(new Uint32Array(canvas.getContext("2d").getImageData(
           0, 0, canvas.width, canvas.height).data.buffer)).size"""
    )
    assert colors > 10, "the chart has axes and two curves"


def test_keyboard_alone_reaches_and_uses_every_control(visit):
    page = visit("index.html")
    page.locator("#restart:enabled").wait_for()
    page.locator("nav a").last.focus()
    for control in ("run", "restart", "speed", "noise", "sensors", "preset", "seed"):
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.id") == control
    page.locator("#noise").focus()
    page.keyboard.press("ArrowRight")
    assert page.locator("#noise-text").inner_text() == "0.025"
    page.locator("#sensors").focus()
    page.keyboard.press("Home")
    assert page.locator("#sensors-text").inner_text() == "4"
    page.locator("#speed").focus()
    page.keyboard.press("End")
    assert page.locator("#speed-text").inner_text() == "fastest"
    page.locator("#result").wait_for(timeout=FINISH_MS)
    assert "--sensors 4 --noise 0.025" in page.locator("#command").inner_text()


def test_pause_stops_and_start_continues(visit):
    page = visit("index.html")
    run, progress = page.locator("#run"), page.locator("#progress-0")
    # The text is such as "episode 1, 3 s": wait for the first episode or decision.
    page.wait_for_function("document.getElementById('progress-0').textContent.includes('1')")
    run.focus()
    page.keyboard.press("Space")
    assert run.inner_text() == "Start"
    page.wait_for_timeout(200)
    stopped = progress.inner_text()
    page.wait_for_timeout(400)
    assert progress.inner_text() == stopped
    page.keyboard.press("Space")
    page.wait_for_function(
        "text => document.getElementById('progress-0').textContent !== text", arg=stopped
    )


def test_an_invalid_seed_changes_nothing(visit, controls):
    page = visit("index.html")
    page.locator("#restart:enabled").wait_for()
    page.locator("#seed").fill("-1")
    page.locator("#seed").press("Tab")
    assert page.locator("#seed").evaluate("input => input.validity.rangeUnderflow")
    controls.speed_up(page)
    page.locator("#result").wait_for(timeout=FINISH_MS)
    assert page.locator("#command").inner_text().endswith("--seed 0")


def test_the_command_can_be_copied(visit, controls):
    page = visit("index.html", permissions=["clipboard-read", "clipboard-write"])
    _, command = finish(page, controls, sensors=4)
    page.locator("#copy").click()
    page.get_by_text("Copied").wait_for()
    assert page.evaluate("navigator.clipboard.readText()") == command


def test_an_agent_that_has_learned_repeats_its_last_test(visit, controls):
    page = visit("index.html")
    finish(page, controls, sensors=6)
    assert page.locator("#progress-0").inner_text().startswith("its last test, ")
    before = page.locator("#picture-0").screenshot()
    page.wait_for_timeout(300)
    assert page.locator("#picture-0").screenshot() != before


def test_first_paint_and_first_episode_are_fast(visit):
    page = visit("index.html")
    page.wait_for_function(
        "document.getElementById('progress-0').textContent.match(/episode ([2-9]|\\d\\d)/)"
    )
    times = page.evaluate(
        "[performance.getEntriesByName('first-contentful-paint')[0].startTime, performance.now()]"
    )
    print(f"first paint after {times[0]:.0f} ms, first episode after {times[1]:.0f} ms")
    assert times[0] <= 1000
    assert times[1] <= 3000


def test_page_stays_smooth_while_the_agents_learn_as_fast_as_possible(visit, controls):
    page = visit("index.html")
    controls.speed_up(page)
    longest = page.evaluate(
        """() => new Promise((resolve) => {
          let [last, longest, n] = [performance.now(), 0, 0];
          const frame = (now) => {
            longest = Math.max(longest, now - last);
            last = now;
            if (++n < 60) requestAnimationFrame(frame); else resolve(longest);
          };
          requestAnimationFrame(frame);
        })"""
    )
    assert longest < 500, "milliseconds between two frames"
