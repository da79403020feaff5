"""Measure the live page of teleoperation while a headless Chromium draws it.

Usage: python benchmarks/live_page.py [--seconds 20] [--robots iiwa7 pr2 tiago] [--seed 0]

Chromium draws in software, on the same processor. The sliders of the rates move all the time.
Nothing here is a test: tests never depend on time.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np
from table import cell, header, parser, row, save

from tcs.output.view.teleop.controls import RATE_SLIDERS
from tcs.output.view.teleop.session import LiveOptions, LiveSession
from tcs.output.view.teleop.timing import Durations

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--window-size=1000,700", "--remote-debugging-port=0",
)  # fmt: skip
SLICE = 0.2
"""Time between two moves of the sliders [s]."""
CONNECTED_WITHIN = 60.0
"""Longest wait for the browser [s]."""


def main() -> int:
    """Measure, print and record everything; the exit code is 1 without a browser."""
    command_line = parser(__doc__)
    command_line.add_argument("--seconds", type=float, default=20.0)
    command_line.add_argument("--robots", nargs="*", default=("iiwa7", "pr2", "tiago"))
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if browser is None:
        print(f"no browser: none of {', '.join(BROWSERS)} is installed.", file=sys.stderr)
        return 1
    header()
    for robot in options.robots:
        drive(browser, robot, options.seconds, options.seed)
    save(options)
    return 0


def drive(browser: str, robot: str, seconds: float, seed: int) -> None:
    """Drive an arm for a while with the page open, and print how long everything took."""
    session = LiveSession(LiveOptions(robot=robot), port=None, on_stop=lambda _: None, record=False)
    page, link = session.page, session.link
    rng = np.random.default_rng(seed)
    with opened(browser, session.url):
        end = time.monotonic() + CONNECTED_WITHIN
        while not link.read().watched and time.monotonic() < end:
            page.run(SLICE)
        for durations in (page.steps, page.worked, page.pictures):
            del durations.taken[:]
        page.dropped = 0
        begun, busy = time.perf_counter(), time.process_time()
        while time.perf_counter() - begun < seconds:
            for name in RATE_SLIDERS:
                link.set_slider(name, float(0.05 * rng.normal()))
            page.run(SLICE)
        wall, cpu = time.perf_counter() - begun, time.process_time() - busy
    for line, text in (
        ("one control step: median, 99th percentile [ms]", middle_and_late(page.steps)),
        ("reading the controls, and the step [ms]", middle_and_late(page.worked)),
        ("sending a frame [ms]", middle_and_late(page.pictures)),
        ("steps dropped", f"{page.dropped} of {page.dropped + page.steps.count:,}"),
        ("fraction of a core [%]", f"{100.0 * cpu / wall:.0f}"),
    ):
        row(f"{robot}: {line}", text)
        cell("live", line, robot, text)


@contextlib.contextmanager
def opened(browser: str, url: str):
    """Keep a page open in a browser."""
    with tempfile.TemporaryDirectory() as profile:
        command = [browser, *OPTIONS, f"--user-data-dir={profile}", url]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            yield
        finally:
            process.terminate()
            process.wait()


def middle_and_late(durations: Durations) -> str:
    """Return median and 99th percentile [ms]."""
    middle, late = np.percentile(np.array(durations.taken), (50.0, 99.0)) * 1e3
    return f"{middle:.2f}, {late:.1f}"


if __name__ == "__main__":
    sys.exit(main())
