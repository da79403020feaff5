"""The operator's page in a headless Chromium: keys, bars, phone and desktop, signals."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tcs.output.view.teleop.session import LiveOptions, LiveSession
from tcs.teleop.runs.run_files import load_run
from tests.app.test_browser import AXE, RUN_AXE
from tests.output.view.browser import chromium
from tests.output.view.teleop.test_browser import SLIDE

pytestmark = pytest.mark.slow
SIZES = [(1440, 900), (390, 844)]
PRESSED = "return [...document.querySelectorAll('[aria-pressed=true]')].map(k => k.dataset.code)"
BARS = """
return [...document.querySelectorAll("#bars [role=meter]")].map(bar => [bar.dataset.state,
  bar.getAttribute("aria-valuetext"), bar.querySelector(".word").textContent]);
"""
SMALL = """
return [...document.querySelectorAll("#desk button")].map(one => one.getBoundingClientRect())
  .filter(one => one.height < 44 || one.width < 44 || one.right > innerWidth + 1).length;
"""


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A page that draws by software on a busy machine stands still for a second at a time."""
    monkeypatch.setattr("tcs.output.view.teleop.page_link.SILENCE", 1.8)


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.fixture(scope="module")
def session():
    options = LiveOptions(robot="iiwa7", start_deg=(0, 34, 0, -80, 0, 57, 0))
    found = LiveSession(options, port=None, on_stop=lambda _: None, record=True)
    yield found
    found.close()


@pytest.fixture(params=SIZES, ids=["desktop", "phone"])
def page(request, session, browser):
    """The session, its page open in the browser."""
    width, height = request.param
    screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width == 390}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    browser.open(session.url, "tool")
    session.begin()
    until(session, lambda: browser.driver.execute_script(BARS)[0][0] == "free")
    yield session
    browser.driver.get("about:blank")
    session.page.run(0.5)


def until(session, done, patience=30.0):
    """Run the arm until a condition holds."""
    end = time.monotonic() + patience
    while not done():
        assert time.monotonic() < end, f"not so after {patience:g} s"
        session.page.run(0.05)


def key(browser, code, down):
    letter = code.removeprefix("Key").lower()
    browser.driver.execute_cdp_cmd(
        "Input.dispatchKeyEvent",
        {
            "type": "keyDown" if down else "keyUp", "code": code, "key": letter,
            "windowsVirtualKeyCode": ord(letter.upper()),
        },
    )  # fmt: skip


def at_rest(session):
    """Let what is on its way arrive; return whether the arm is at rest then."""
    session.page.run(0.7)
    before = session.page.last.p.copy()
    session.page.run(0.5)
    return bool(np.abs(session.page.last.p - before).max() < 1e-5)


def test_a_key_moves_the_arm_until_it_is_released_and_is_lit(page, browser):
    before = page.page.last.p.copy()
    key(browser, "KeyW", True)
    until(page, lambda: (page.page.last.p - before)[0] > 0.05)
    # The key was pressed once, without a repeat; a press of 0.15 s would move the tool by 15 mm.
    assert browser.driver.execute_script(PRESSED) == ["KeyW"]
    key(browser, "KeyW", False)
    assert at_rest(page)
    assert browser.driver.execute_script(PRESSED) == []
    assert browser.complaints() == []
    ours = (page.url, "data:")
    assert [name for name in browser.fetched() if not name.startswith(ours)] == []


@pytest.mark.parametrize("how", ["blur", "closed"])
def test_a_page_that_is_left_releases_its_keys(page, browser, how):
    before = page.page.last.p.copy()
    key(browser, "KeyW", True)
    until(page, lambda: (page.page.last.p - before)[0] > 0.01)
    if how == "blur":
        browser.driver.execute_script("window.dispatchEvent(new Event('blur'))")
    else:
        browser.driver.get("about:blank")
    assert at_rest(page)


def test_a_page_that_is_left_stops_what_its_sliders_move(page, browser):
    browser.driver.execute_script(SLIDE, "move y [m/s]", 0.1)
    before = page.page.last.p.copy()
    until(page, lambda: (page.page.last.p - before)[1] > 0.01)
    browser.driver.get("about:blank")
    until(page, lambda: "no browser" in page.page.last.reason, patience=5.0)
    page.page.run(0.3)
    assert not page.page.last.rates.any()


def test_keys_of_the_page_are_held_by_a_finger_or_the_mouse(page, browser):
    before = page.page.last.p.copy()
    script = """
    const cap = document.querySelector("[data-code=KeyR]");
    cap.scrollIntoView();
    cap.setPointerCapture = () => {};
    cap.dispatchEvent(new PointerEvent(arguments[0], {bubbles: true, pointerId: 7}));
    """
    browser.driver.execute_script(script, "pointerdown")
    until(page, lambda: (page.page.last.p - before)[2] > 0.03)
    browser.driver.execute_script(script, "pointerup")
    assert at_rest(page)


CAMERAS = """
const scene = document.getElementById("meshcat-pane").getBoundingClientRect();
return [...document.querySelectorAll("#cameras figure:has(img)")].map(one => {
  const box = one.getBoundingClientRect();
  return [box.width * box.height / (scene.width * scene.height), box.bottom < scene.bottom];
});
"""


@pytest.mark.parametrize("size", SIZES, ids=["desktop", "phone"])
def test_camera_pictures_leave_the_scene_free(browser, size):
    options = LiveOptions(robot="iiwa7", cameras=True)
    session = LiveSession(options, port=None, on_stop=lambda _: None, record=False)
    width, height = size
    screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width == 390}
    script = browser.driver.execute_script
    try:
        browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        browser.open(session.url, "tool")
        session.begin()
        until(session, lambda: len(script(CAMERAS)) == 2, patience=120.0)
        session.page.run(0.5)
        small = script(CAMERAS)
        assert sum(share for share, _ in small) < 0.25
        assert all(is_inside for _, is_inside in small)
        for enlarged in (0, 1):
            script("document.querySelectorAll('#cameras button')[arguments[0]].click()", enlarged)
            session.page.run(0.2)
            now = script(CAMERAS)
            assert now[enlarged][0] > 2.0 * small[enlarged][0]
            assert now[1 - enlarged][0] <= 1.01 * small[1 - enlarged][0]
            assert all(is_inside for _, is_inside in now)
    finally:
        browser.driver.get("about:blank")
        session.close()


STALL = """
const until = performance.now() + arguments[0];
const fetched = window.fetch;
window.fetch = (...of) => { window.fetch = fetched; const reply = fetched(...of);
  while (performance.now() < until) {} return reply; };
window.said = [];
const line = document.getElementById("message");
new MutationObserver(() => said.push(line.textContent)).observe(line, {childList: true});
"""


def test_a_page_that_stood_still_has_not_lost_its_connection(page, browser, monkeypatch):
    browser.driver.execute_script(STALL, 1.8 * 1000.0)
    page.page.run(1.5)
    lost = "return said.filter(text => text.startsWith('No connection')).length"
    assert browser.driver.execute_script(lost) == 0
    receive = page.link.receive
    monkeypatch.setattr(page.link, "receive", lambda message: time.sleep(1.2) or receive(message))
    page.page.run(1.5)
    monkeypatch.undo()
    until(page, lambda: browser.driver.execute_script(lost) == 1)


def test_modes_are_switched_and_bars_say_their_state(page, browser):
    key(browser, "KeyM", True)
    key(browser, "KeyM", False)
    mode = "return document.getElementById('mode').textContent"
    until(page, lambda: "null-space mode, group 1" in browser.driver.execute_script(mode))
    for _ in range(2):
        key(browser, "KeyM", True)
        key(browser, "KeyM", False)
        page.page.run(0.2)
    # A key that goes down while the mode changes has no effect.
    until(page, lambda: "end-effector" in browser.driver.execute_script(mode))
    key(browser, "KeyF", True)
    until(page, lambda: page.page.last.limits.any(), patience=120.0)
    page.page.run(0.5)
    limited = np.flatnonzero(page.page.last.limits)
    shown = browser.driver.execute_script(BARS)
    assert [i for i, bar in enumerate(shown) if bar[0] == "limit"] == limited.tolist()
    assert all(bar[2] == "limit" and "at its limit" in bar[1] for bar in np.take(shown, limited, 0))
    message = browser.driver.execute_script("return document.getElementById('message').textContent")
    assert f"joint {limited[0] + 1}" in message
    key(browser, "KeyF", False)


def test_the_page_fits_and_is_accessible(page, browser):
    assert browser.driver.execute_script(SMALL) == 0
    wide = "return document.documentElement.scrollWidth - innerWidth"
    assert browser.driver.execute_script(wide) <= 0
    # What the desk leaves is the scene's.
    sizes = "return ['desk', 'meshcat-pane'].map(id => document.getElementById(id).offsetHeight)"
    desk, scene = browser.driver.execute_script(sizes)
    assert scene >= 300
    assert desk + scene == browser.driver.execute_script("return innerHeight")
    if AXE.exists():
        time.sleep(1.5)
        browser.driver.execute_script(AXE.read_text(encoding="utf-8"))
        assert browser.driver.execute_async_script(RUN_AXE) == []


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_recording_survives_a_stop_by_signal(browser, tmp_path, ending):
    path = Path(tmp_path) / "run.csv"
    command = [sys.executable, "-m", "tcs", "teleop", "--no-browser", "--save", str(path)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        address = next(line for line in process.stderr if "http" in line).split("open ")[1].split()
        browser.open(address[0], "tool")
        key(browser, "KeyW", True)
        time.sleep(2.0)
        process.send_signal(ending)
        process.communicate(timeout=60)
    finally:
        process.kill()
    run = load_run(path)
    assert run.position[-1, 0] - run.position[0, 0] > 0.02
