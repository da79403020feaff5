"""A headless Chromium for tests of the viewer; tests are skipped if it is not installed."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

# WebGL by software: there is no graphics card to rely on. Root, as in containers, has no sandbox.
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--window-size=1000,700",
)  # fmt: skip
SEEN = """
const goals = viewer.scene_tree.find(["drake", "goals"]).children;
return Object.fromEntries(Object.entries(goals).map(([goal, node]) => [goal,
  Object.keys(node.children).filter(name => node.children[name].object.visible)]));
"""
PATIENCE = 60.0
"""Longest wait [s]: drawing by software on a busy machine takes seconds."""


class Page:
    """A page in the browser."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def open(self, url: str, ready: str) -> None:
        """Open a page and wait until the scene has an object at a path."""
        self.driver.get(url)
        self.wait(lambda: self.has(ready))

    def has(self, path: str) -> bool:
        """Return whether an object at a path is visible."""
        steps = "/".join(["drake", *([path] if path else [])]).split("/")
        script = """
        if (typeof viewer === "undefined") return false;
        let node = viewer.scene_tree;
        for (const step of arguments[0]) {
          if (!(step in node.children)) return false;
          node = node.children[step];
        }
        let found = false;
        node.object.traverse(one => { found = found || one.isMesh || one.isLine; });
        return found;
        """
        return bool(self.driver.execute_script(script, steps))

    def arrows(self) -> dict[int, list[str]]:
        """Return the reasons whose arrows are visible, by goal."""
        seen = self.driver.execute_script(SEEN)
        return {
            int(goal): [name for name in names if name != "<object>"]
            for goal, names in seen.items()
        }

    def picture(self, *hidden: str) -> np.ndarray:
        """Return a screenshot with some paths hidden, shape (h, w, 3)."""
        show = "viewer.set_property(arguments[0], 'visible', arguments[1]); viewer.set_dirty();"
        for path in hidden:
            self.driver.execute_script(show, ["drake", path], False)
        time.sleep(1.0)
        shot = Image.open(io.BytesIO(self.driver.get_screenshot_as_png())).convert("RGB")
        for path in hidden:
            self.driver.execute_script(show, ["drake", path], True)
        return np.asarray(shot).astype(int)

    def fetched(self) -> list[str]:
        """Addresses of everything that the page has loaded."""
        script = "return performance.getEntriesByType('resource').map(one => one.name)"
        return list(self.driver.execute_script(script))

    def complaints(self) -> list[dict[str, Any]]:
        """Errors on the browser's console."""
        return [entry for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]

    def wait(self, done: Callable[[], object]) -> None:
        """Wait until a condition holds."""
        end = time.monotonic() + PATIENCE
        while not done():
            assert time.monotonic() < end, f"not so after {PATIENCE:.0f} s"
            time.sleep(0.02)


def chromium() -> Iterator[Page]:
    """Yield a page of a new browser, or skip the test."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="needs selenium")
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    control = shutil.which("chromedriver")
    if browser is None or control is None:
        pytest.skip("needs chromium and chromedriver (apt install chromium chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for option in OPTIONS:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(control))
    try:
        yield Page(driver)
    finally:
        driver.quit()
