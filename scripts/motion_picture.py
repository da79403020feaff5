"""Draw the animation of the README: the motions of a task as the page plays them.

Usage: python scripts/motion_picture.py [--out docs/images/motion.webp]

Scores shaving, opens the page in a headless Chromium and plans the motions from the best place.
Needs Chromium and selenium.
"""

from __future__ import annotations

import argparse
import io
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image

import tcs
from tcs.app import add_page
from tcs.service import Engine
from tcs.service.http import Access, Server, make_application

OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--window-size=1440,900",
)  # fmt: skip
PATIENCE = 300.0
"""Longest wait [s]."""
MOTION_WIDTH = 560
"""Width of the animation [pixels]."""
RATE = 6
"""Frames of the animation per second."""
SECONDS = 20.0
"""Longest duration of the animation [s]."""


def main() -> int:
    """Draw the animation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/images/motion.webp"))
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder, Engine() as engine:
        path = Path(folder) / "shaving-wheelchair-pr2.tcs"
        tcs.save(path, tcs.score("shaving"))
        engine.open_file(path)
        application = make_application(engine, Access())
        add_page(application)
        with Server(application, host="127.0.0.1", port=0) as server:
            draw(server.url, out)
    return 0


def draw(url: str, out: Path) -> None:
    """Open the page and write the animation."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for option in OPTIONS:
        options.add_argument(option)
    options.binary_location = shutil.which("chromium") or shutil.which("google-chrome") or ""
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    script = driver.execute_script
    try:
        driver.set_script_timeout(PATIENCE)
        driver.get(f"{url}/#language=en")
        wait(lambda: script("return !document.getElementById('editing').hidden"))
        script("document.getElementById('plan').click()")
        wait(lambda: not script("return document.getElementById('player').hidden"))
        animate(driver, out)
    finally:
        driver.quit()


def animate(driver: Any, path: Path) -> None:
    """Write the frames of the motions, as the slider of the page shows them."""
    script = driver.execute_script
    play = (
        "const one = document.getElementById('play'); if (one.textContent === 'Pause') one.click()"
    )
    script(play)
    last = int(script("return document.getElementById('time').max"))
    # The page fetches 15 frames per second.
    numbers = range(0, min(last, int(15 * SECONDS)), max(round(15 / RATE), 1))
    stage = driver.find_element("id", "stage")
    frames = []
    for number in numbers:
        show = (
            "const one = document.getElementById('time'); one.value = arguments[0]; one.oninput()"
        )
        script(show, number)
        time.sleep(0.15)
        picture = Image.open(io.BytesIO(stage.screenshot_as_png)).convert("RGB")
        height = round(picture.height * MOTION_WIDTH / picture.width)
        frames.append(picture.resize((MOTION_WIDTH, height), Image.Resampling.LANCZOS))
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=round(1000 / RATE), loop=0,
        quality=50, method=4,
    )  # fmt: skip


def wait(done: Callable[[], object]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not done():
        if time.monotonic() > end:
            raise TimeoutError(f"not so after {PATIENCE:g} s")
        time.sleep(0.1)


if __name__ == "__main__":
    sys.exit(main())
