"""Measure the page of `tcs app` in a headless Chromium: opening, clicks, furniture moved, a pose.

Usage: python benchmarks/app.py FILE [--repeats 5] [--clicks 40] [--moves 5] [--seed 0]
    [--poses-only] [--save]

FILE is a score file made by `tcs score`, of an environment with a person. The browser runs before
the command starts, draws in software, and shares the processor with the server. A click is timed
in the page, from the event until the words are drawn, one to two seconds after the click before;
what is moved from the change of its place until the map has another picture. The pose of a person,
another one each time, is observed over HTTP: as soon as `tcs serve` says that it is ready, of the
same server at rest, and once more; and as soon as the page of `tcs app` is usable. No kernel is
compiled while something is measured.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from table import cell, header, parser, row, save, spread

from tcs.placement.store import load_scores

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--window-size=1440,900",
)  # fmt: skip
PATIENCE = 60.0
"""Longest wait for the page [s]."""
SETTLED = 3.0
"""Time until the page rests: cards, the view in space and the other states follow the words [s]."""
HERE = [1.2, -0.7, 90.0]
"""Where the robot is that observes: x [m], y [m] and heading [deg]."""
WHEN = ("as soon as `tcs serve` is ready", "of a server at rest", "once more")
"""When a pose is observed."""
WITH_PAGE = "as soon as the page is usable"
PREPARED = 8.0
"""Time in which a server prepares what its first job needs [s]."""
CLICK = """
const done = arguments[2];
const [map, words] = ['map', 'words'].map(id => document.getElementById(id));
const box = map.getBoundingClientRect();
const at = {clientX: box.left + arguments[0] * box.width,
  clientY: box.top + arguments[1] * box.height, pointerId: 1, isPrimary: true, bubbles: true};
map.setPointerCapture = () => {};
let begun = 0;
const seen = new MutationObserver(() => {
  seen.disconnect();
  requestAnimationFrame(() => setTimeout(() => done(performance.now() - begun)));
});
seen.observe(words, {childList: true, characterData: true, subtree: true});
begun = performance.now();
map.dispatchEvent(new PointerEvent('pointerdown', at));
map.dispatchEvent(new PointerEvent('pointerup', at));
"""
MOVE = """
const done = arguments[1];
const image = document.querySelector('#map image');
const begun = performance.now();
let first = 0;
const seen = new MutationObserver(() => {
  first ||= performance.now();
  if (document.body.dataset.rescored) {
    seen.disconnect();
    requestAnimationFrame(() => setTimeout(() => done([first - begun, performance.now() - begun])));
  }
});
delete document.body.dataset.rescored;
seen.observe(image, {attributes: true, attributeFilter: ['href']});
seen.observe(document.body, {attributes: true, attributeFilter: ['data-rescored']});
const x = document.getElementById('thingX');
x.value = arguments[0];
x.dispatchEvent(new Event('change', {bubbles: true}));
"""


def main() -> int:
    """Measure, print and record everything; the exit code is 1 without a browser."""
    command_line = parser(__doc__)
    command_line.add_argument("file", type=Path, metavar="FILE")
    command_line.add_argument("--repeats", type=int, default=5)
    command_line.add_argument("--clicks", type=int, default=40)
    command_line.add_argument("--moves", type=int, default=5)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--poses-only", action="store_true")
    options = command_line.parse_args()
    if options.poses_only:
        header("fastapi", "uvicorn")
        observed(Poses(options), options.repeats)
        return 0
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    control = shutil.which("chromedriver")
    if found is None or control is None:
        print("no browser: install chromium and chromium-driver.", file=sys.stderr)
        return 1
    header("fastapi", "uvicorn", "selenium")
    with browser(found, control) as driver:
        row("browser", driver.capabilities["browserVersion"])
        poses = Poses(options)
        record("usable after `tcs app`", [opened(driver, poses) for _ in range(options.repeats)])
        with served("app", options.file) as url:
            usable(driver, url)
            clicks(driver, options)
            moves(driver, options)
    observed(poses, options.repeats)
    save(options)
    return 0


@contextlib.contextmanager
def browser(path: str, control: str) -> Iterator[Any]:
    """Yield a headless Chromium."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = path
    for option in OPTIONS:
        options.add_argument(option)
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(control))
    driver.set_script_timeout(PATIENCE)
    try:
        driver.get("about:blank")
        yield driver
    finally:
        driver.quit()


@contextlib.contextmanager
def served(command: str, file: Path) -> Iterator[str]:
    """Run `tcs app` or `tcs serve` on a file, and yield its address once it is printed."""
    how = {"app": ["--no-browser"], "serve": ["--port", "0"]}[command]
    process = subprocess.Popen(
        [sys.executable, "-m", "tcs", command, str(file), *how],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    try:
        yield next(
            found[0] for line in process.stderr if (found := re.search(r"http://[^\s,]+", line))
        )
    finally:
        process.terminate()
        process.wait()


def usable(driver: Any, url: str) -> None:
    """Open the page, and wait until it shows words and takes clicks."""
    driver.get("about:blank")
    driver.get(url)
    until(driver, "return document.body.dataset.ready")


def opened(driver: Any, poses: Poses) -> float:
    """Return the time from the start of the command until its page is usable [s]."""
    begun = time.perf_counter()
    with served("app", poses.file) as url:
        usable(driver, url)
        seconds = time.perf_counter() - begun
        poses.observe(url, WITH_PAGE)
        return seconds


def clicks(driver: Any, options: argparse.Namespace) -> None:
    """Measure clicks at random places of the map until the words are drawn."""
    until(driver, "return document.querySelectorAll('#map polygon').length > 5")
    time.sleep(SETTLED)
    rng, taken = random.Random(options.seed), []
    for _ in range(options.clicks):
        place = [rng.uniform(0.05, 0.95) for _ in range(2)]
        taken.append(1e-3 * driver.execute_async_script(CLICK, *place))
        time.sleep(rng.uniform(1.0, 2.0))
    record("click on the map to words", taken, "ms", 1e3)


def moves(driver: Any, options: argparse.Namespace) -> None:
    """Measure a moved chair or person until the map shows other scores, and until all are there."""
    until(driver, "return !document.getElementById('editing').hidden")
    choose = """const one = document.getElementById('subject'); one.value = one.options[1].value;
    one.onchange(); return one.value;"""
    thing = driver.execute_script(choose)
    found = []
    for i in range(options.moves + 1):
        found.append(driver.execute_async_script(MOVE, f"{0.05 * (i + 1):.2f}"))
        time.sleep(SETTLED)
    first, whole = (([1e-3 * times[k] for times in found[1:]]) for k in (0, 1))
    record(f"{thing} moved until the map shows other scores", first)
    record(f"{thing} moved until the state is scored in full", whole)


def observed(poses: Poses, repeats: int) -> None:
    """Measure the start of `tcs serve`, and observed poses until a set is chosen, over HTTP."""
    started = []
    for _ in range(repeats):
        begun = time.perf_counter()
        with served("serve", poses.file) as url:
            started.append(time.perf_counter() - begun)
            for when in WHEN:
                if when == WHEN[1]:
                    time.sleep(PREPARED)
                poses.observe(url, when)
    record("`tcs serve` is ready", started)
    for name, seconds in poses.taken.items():
        record(name, seconds)


class Poses:
    """Poses of a person around the scored one, none twice, and how long their answers take."""

    def __init__(self, options: argparse.Namespace) -> None:
        """Observe the first body frame of the file that the options name."""
        loaded = load_scores(options.file)
        self.file = options.file
        self.taken: dict[str, list[float]] = {}
        self._request = {key: loaded.metadata[key] for key in ("task", "environment", "robot")}
        self._frame, at = next(iter(loaded.body_frames.items()))
        self._at = np.ravel(at)[:3].tolist()
        self._rng = random.Random(options.seed)

    def observe(self, url: str, when: str) -> None:
        """Measure a pose until a set is chosen.

        A first answer comes from every third base position and where the robot is; the whole
        follows, timed from the same beginning.
        """
        import httpx

        pose = [value + self._rng.uniform(-0.01, 0.01) for value in self._at]
        request = {**self._request, "frames": {self._frame: pose}}
        with httpx.Client(base_url=url, trust_env=False, timeout=PATIENCE) as http:
            begun = time.perf_counter()
            for what, less in (("first answer", {"every": 3, "around": HERE[:2]}), ("all", {})):
                answer(http, {**request, **less})
                name = f"observed pose to {what}, {when}"
                self.taken.setdefault(name, []).append(time.perf_counter() - begun)


def answer(http: Any, request: dict[str, Any]) -> None:
    """Score an observed scene, and select a set from it."""
    job = http.post("/v1/score-here", json=request).json()
    with http.stream("GET", f"/v1/jobs/{job['job']}/events") as events:
        *_, end = (line for line in events.iter_lines() if line.startswith("data:"))
    done = json.loads(end.removeprefix("data:"))["result"]["file"]
    http.post("/v1/select", json={"file": done, "here": HERE, "at": {}}).raise_for_status()


def until(driver: Any, script: str) -> None:
    """Wait until a script returns something true."""
    end = time.monotonic() + PATIENCE
    while not driver.execute_script(script):
        if time.monotonic() > end:
            raise SystemExit(f"not so after {PATIENCE:.0f} s: {script}")
        time.sleep(0.01)


def record(name: str, seconds: list[float], unit: str = "s", scale: float = 1.0) -> None:
    """Print and record durations."""
    text = spread(seconds, unit, scale)
    row(name, text)
    cell("times", name, "time", text)


if __name__ == "__main__":
    sys.exit(main())
