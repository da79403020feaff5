"""The operator's page and the playback of a run in a headless Chromium."""

from __future__ import annotations

import time

import numpy as np
import pytest

from tcs.output.view import open_meshcat
from tcs.output.view.teleop import RunView, replay_page
from tcs.output.view.teleop.panel import COLOURS
from tcs.output.view.teleop.session import LiveOptions, LiveSession
from tests.output.view.browser import chromium

pytestmark = pytest.mark.slow
HOLD = 0.4
"""Time for which the page runs after a key [s]: the arm moves and comes to rest."""


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A page that draws by software on a busy machine stands still for a second at a time."""
    monkeypatch.setattr("tcs.output.view.teleop.page_link.SILENCE", 1.8)


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.fixture
def reasons():
    return []


@pytest.fixture
def page(browser, ready, reasons):
    """The live page of a session in the browser."""
    options = LiveOptions(robot="iiwa7", start_deg=tuple(np.degrees(ready)))
    session = LiveSession(options, port=None, on_stop=reasons.append, record=False)
    browser.open(session.url, "tool")
    until(session.page, lambda: session.link.read().watched)
    session.page.run(0.2)
    session.page.url = session.url
    yield session.page
    browser.driver.get("about:blank")
    session.close()


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


SLIDE = """
const input = document.querySelector(`[data-slider="${arguments[0]}"]`);
input.value = arguments[1];
input.dispatchEvent(new Event("input"));
"""


def slide(browser, page, name, value):
    browser.driver.execute_script(SLIDE, name, value)
    page.run(0.1)


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


def test_a_slider_moves_the_tool_and_space_resets_it(page, browser):
    before = page.last.p.copy()
    slide(browser, page, "move y [m/s]", 0.1)
    until(page, lambda: (page.last.p - before)[1] > 0.02)
    press(browser, page, " ")
    here = page.last.p.copy()
    page.run(0.5)
    np.testing.assert_allclose(page.last.p, here, atol=1e-4)
    value = "return Number(document.querySelector('[data-slider^=\"move y\"]').value)"
    browser.wait(lambda: browser.driver.execute_script(value) == 0)


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
