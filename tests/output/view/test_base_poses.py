"""Pages of base poses: their content, and what the browser shows under the pointer."""

from __future__ import annotations

import json
import logging
import re

import numpy as np
import pytest

from tcs.errors import OutputError
from tcs.output.draw.base_poses import BasePoseView
from tcs.output.view import open_meshcat
from tcs.output.view.base_poses import write_page
from tests.output.view.browser import chromium

POSES = np.array(
    [[0.0, -0.5, np.pi / 2, 0.2], [0.1, -0.6, 0.0, 0.9], [0.1, -0.6, np.pi, 0.25], [0.3, 0, 0, 0.5]]
)


@pytest.fixture
def page(tmp_path):
    view = BasePoseView(
        poses=POSES, step=0.05, positions=np.zeros((1, 2)), grasps=np.zeros((1, 3)),
        caption="4 base poses\nat <one> height",
    )  # fmt: skip
    path = tmp_path / "page.html"
    write_page(path, view, title="ICM of a & b")
    return path


def test_a_page_holds_every_base_pose_and_loads_nothing(page):
    text = page.read_text()
    content = json.loads(re.search(r"const DATA = (.*);\n", text)[1])
    assert content["cells"] == [
        [0, -10, [[90.0, 0.2]]], [2, -12, [[0.0, 0.9], [180.0, 0.25]]], [6, 0, [[0.0, 0.5]]],
    ]  # fmt: skip
    assert content["best"] == [0.1, -0.6, 0.0]
    assert "<title>ICM of a &amp; b</title>" in text
    assert "4 base poses; at &lt;one&gt; height" in text
    assert re.findall(r"(?:src|href)=", text) == []
    assert [one for one in re.findall(r"https?://[\w./]*", text) if "w3.org" not in one] == []


def test_a_page_that_cannot_be_written_is_refused(page):
    view = BasePoseView(
        poses=POSES, step=0.05, positions=np.zeros((1, 2)), grasps=np.zeros((0, 3)), caption=""
    )
    with pytest.raises(OutputError):
        write_page(page / "inside.html", view, title="")


def test_the_log_level_is_restored_if_no_port_is_free(monkeypatch):
    def fail(*_arguments, **_options):
        raise RuntimeError("Meshcat failed to open a websocket port.")

    monkeypatch.setattr("tcs.output.view.live.Meshcat", fail)
    log = logging.getLogger("drake")
    monkeypatch.setattr(log, "level", log.level)
    log.setLevel(logging.INFO)
    with pytest.raises(OutputError, match="cannot listen"):
        open_meshcat()
    assert log.level == logging.INFO


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1440, 900), (390, 844)], ids=["desktop", "phone"])
def test_the_pointer_and_the_keys_show_the_headings(page, size):
    browsers = chromium()
    browser = next(browsers)
    driver, (width, height) = browser.driver, size
    try:
        screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width == 390}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        driver.get(page.as_uri())
        words = "return document.getElementById('words').textContent"
        assert driver.execute_script(words) == (
            "x 0.10 m, y -0.60 m: 2 headings, the best 0° with score 0.90. Headings: 0°, 180°."
        )
        arrows = "return document.querySelectorAll('#rose path').length"
        assert driver.execute_script(arrows) == 2
        driver.execute_script(
            """
            const map = document.getElementById("map");
            const point = new DOMPoint(arguments[0], -arguments[1]);
            const at = point.matrixTransform(map.getScreenCTM());
            map.dispatchEvent(new PointerEvent("pointermove", {clientX: at.x, clientY: at.y}));
            """,
            0.01, -0.48,
        )  # fmt: skip
        assert driver.execute_script(words).startswith(
            "x 0.00 m, y -0.50 m: 1 heading, the best 90"
        )
        driver.execute_script(
            "document.getElementById('map').dispatchEvent("
            "new KeyboardEvent('keydown', {key: 'ArrowUp'}))"
        )
        assert driver.execute_script(words) == "x 0.00 m, y -0.45 m: no base pose"
        assert driver.execute_script("return document.documentElement.scrollWidth") <= width
        assert browser.complaints() == []
    finally:
        browsers.close()
