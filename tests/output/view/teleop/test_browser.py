"""The live page and the playback of a run in a headless Chromium."""

from __future__ import annotations

import time

import numpy as np
import pytest

from tcs.output.view import open_meshcat
from tcs.output.view.teleop import LivePage, RunView, replay_page
from tcs.output.view.teleop.panel import COLOURS
from tcs.teleop import Settings
from tests.output.view.browser import chromium
from tests.output.view.teleop.conftest import MODES

pytestmark = pytest.mark.slow
HOLD = 0.4
"""Time for which the page runs after a key [s]: the arm moves and comes to rest."""


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.fixture
def reasons():
    return []


@pytest.fixture
def page(iiwa, iiwa_display, ready, browser, reasons):
    """A live page in the browser."""
    meshcat = open_meshcat()
    found = LivePage(
        meshcat, iiwa_display, iiwa, ready, settings=Settings(), modes=MODES, on_stop=reasons.append
    )
    browser.open(meshcat.web_url(), "tool")
    until(found, lambda: meshcat.GetNumActiveConnections() == 1)
    # The closed page of the previous test may still count for a moment.
    found.run(0.2)
    found.url = meshcat.web_url()
    yield found
    browser.driver.get("about:blank")


def until(page, done, patience=20.0):
    """Run the page until a condition holds."""
    end = time.monotonic() + patience
    while not done():
        assert time.monotonic() < end, f"not so after {patience:g} s"
        page.run(0.05)


def press(browser, page, key, times=1):
    from selenium.webdriver import ActionChains

    for _ in range(times):
        ActionChains(browser.driver).send_keys(key).perform()
        page.run(0.1)
    page.run(HOLD)


def slide(browser, page, name, value):
    browser.driver.execute_script(
        "viewer.gui_controllers[arguments[0]].setValue(arguments[1])", name, value
    )
    page.run(0.1)


def near(browser, colour):
    """Return the number of pixels with about this colour."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(browser.picture() - wanted).max(axis=2) < 12).sum())


def shown_states(browser, states=tuple(COLOURS)):
    """Return which colours of each bar are visible in the scene of the browser."""
    script = """
    const camera = viewer.scene_tree.find(["Cameras", "default", "rotated", "<object>"]);
    const bars = camera.children["panel"].children["bar"].children;
    return Object.keys(bars).sort().map(i => arguments[0].filter(
      state => bars[i].children[state].object.visible));
    """
    return browser.driver.execute_script(script, states)


def pads(browser, pad):
    """Give the browser a gamepad, or none."""
    browser.driver.execute_script(
        """
        const given = arguments[0];
        navigator.getGamepads = () => [given && {
          index: 0, connected: true, axes: given.axes,
          buttons: given.buttons.map(value => ({value: value})),
        }];
        """,
        pad,
    )


def test_page_loads_without_complaint_and_keys_move_the_tool(page, browser):
    before = page.last.p.copy()
    press(browser, page, "w", 4)
    moved = page.last.p - before
    # Four presses of 0.15 s at 0.1 m/s, some of which overlap.
    assert 0.02 < moved[0] < 0.08
    assert np.abs(moved[1:]).max() < 1e-3
    before = page.last.p.copy()
    press(browser, page, "r")
    assert (page.last.p - before)[2] > 0.005
    assert browser.complaints() == []
    ours = (page.url, "data:", "blob:")
    assert [name for name in browser.fetched() if not name.startswith(ours)] == []


def test_a_slider_moves_the_tool_and_space_resets_it(page, browser):
    before = page.last.p.copy()
    slide(browser, page, "move y [m/s]", 0.1)
    page.run(0.5)
    assert (page.last.p - before)[1] > 0.02
    press(browser, page, " ")
    here = page.last.p.copy()
    page.run(0.5)
    np.testing.assert_allclose(page.last.p, here, atol=1e-4)
    value = "return viewer.gui_controllers['move y [m/s]'].getValue()"
    browser.wait(lambda: browser.driver.execute_script(value) == 0)


def test_null_space_mode_moves_the_elbow_and_keeps_the_tool(page, browser, iiwa):
    press(browser, page, "m")
    assert "null-space mode, group 1 (joints 1 2 3)" in page.mode_line()
    tool = page.last.p.copy()
    elbow = iiwa.link_poses(page.last.joints)[3, :3, 3]
    press(browser, page, "e", 8)
    assert np.linalg.norm(iiwa.link_poses(page.last.joints)[3, :3, 3] - elbow) > 0.02
    # Bound on the displacement of the tool: 0.1 mm.
    assert np.linalg.norm(page.last.p - tool) < 1e-4


def test_bars_are_red_at_a_limit_and_magenta_where_it_is_singular(page, browser):
    assert shown_states(browser) == [["free"]] * 7
    red, magenta = COLOURS["limit"], COLOURS["singular"]
    assert near(browser, COLOURS["free"]) > 500
    assert near(browser, red) == near(browser, magenta) == 0
    slide(browser, page, "move z [m/s]", -0.25)
    until(page, lambda: page.last.limits.any())
    slide(browser, page, "move z [m/s]", 0.0)
    page.run(0.3)
    at = np.flatnonzero(page.last.limits)
    expected = [["limit"] if i in at else ["free"] for i in range(7)]
    browser.wait(lambda: shown_states(browser) == expected)
    # A full bar and its frame: some 700 pixels at this size.
    assert near(browser, red) > 300
    press(browser, page, "x")
    slide(browser, page, "move x [m/s]", 0.25)
    until(page, lambda: page.last.singular)
    page.run(0.5)
    browser.wait(lambda: ["singular"] in shown_states(browser))
    assert near(browser, magenta) > 500
    assert browser.complaints() == []


def test_panel_stays_when_the_camera_moves(page, browser):
    def panel():
        # The lower middle of the picture, where the panel is.
        picture = browser.picture()
        height, width = picture.shape[:2]
        return picture[int(0.8 * height) : int(0.95 * height), int(0.3 * width) : int(0.7 * width)]

    before = panel()
    browser.driver.execute_script(
        "viewer.set_property(['Cameras', 'default', 'rotated', '<object>'], 'position',"
        " [-1.5, 2.0, 1.0]); viewer.controls.update(); viewer.set_dirty();"
    )
    changed = (np.abs(before - panel()) > 20).any(axis=2).mean()
    # Bars, names and text are where they were; the arm above and around them is not.
    assert changed < 0.02


def test_a_gamepad_drives_and_the_arm_stops_when_it_is_lost(page, browser, reasons):
    at_rest = {"axes": [0, 0, 0, 0], "buttons": [0] * 17}
    pads(browser, at_rest)
    page.run(1.0)
    before = page.last.p.copy()
    pads(browser, {**at_rest, "axes": [0, -1, 0, 0]})
    until(page, lambda: (page.last.p - before)[0] > 0.02)
    pads(browser, None)
    until(page, lambda: page.last.reason)
    assert "gamepad lost" in page.last.reason
    page.run(0.3)
    here = page.last.p.copy()
    page.run(0.5)
    np.testing.assert_array_equal(page.last.p, here)
    assert [line for line in reasons if "gamepad lost" in line]
    press(browser, page, " ")
    page.run(0.2)
    assert page.last.reason == ""


def test_the_page_of_a_run_needs_no_server(browser, iiwa, iiwa_display, driven, tmp_path):
    film = RunView(iiwa, driven)
    path = tmp_path / "run.html"
    meshcat = open_meshcat()
    path.write_text(replay_page(meshcat, iiwa_display, film, title="A run"))
    del meshcat
    browser.open(path.as_uri(), "robot")
    where = """
    const tool = viewer.scene_tree.find(["drake", "tool"]).object.position;
    return [tool.x, tool.y, tool.z];
    """
    # Times of frames, of which there are 25 per second.
    for seconds in (0.0, 2.0, 3.6, 8.8):
        browser.driver.execute_script(
            "viewer.animator.pause(); viewer.animator.seek(arguments[0]);", seconds
        )
        i = film.sample(seconds)
        tool = browser.driver.execute_script(where)
        # Between two frames the tool moves by a hundredth of a metre at most.
        assert tool == pytest.approx(driven.position[i].tolist(), abs=1e-3)
        assert shown_states(browser) == [[state] for state in film.readout(i).states]
    assert browser.complaints() == []
    assert [name for name in browser.fetched() if not name.startswith(("data:", "blob:"))] == []
