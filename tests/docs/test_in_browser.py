"""The site in a real browser: nothing fetched, nothing wider than the screen, no complaints."""

import pytest

from tests.docs.building import DOCS
from tests.view.browser import chromium

PHONE, DESKTOP = 390, 1280
"""Widths of a common phone and of a small laptop [px]."""


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.mark.slow
@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_pages_fit_the_screen(site, browser, width):
    screen = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width == PHONE}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    too_wide = {}
    for source in DOCS.rglob("*.md"):
        path = (site / source.relative_to(DOCS)).with_suffix(".html")
        browser.driver.get(path.as_uri())
        wide = browser.driver.execute_script("return document.documentElement.scrollWidth")
        # Tables, code and equations may be scrolled by themselves; the page may not.
        if wide > width:
            too_wide[path.name] = wide
        assert all(address.startswith("file://") for address in browser.fetched()), path
        assert browser.complaints() == [], path
    assert too_wide == {}


@pytest.mark.slow
def test_equations_have_their_shape(site, browser):
    browser.driver.get((site / "method.html").as_uri())
    heights = browser.driver.execute_script("""
        const equations = [...document.querySelectorAll(".equation math")];
        return equations.map(one => one.getBoundingClientRect().height);
    """)
    assert len(heights) >= 6
    # A browser that knows no MathML would write each in one line of text, some 20 px high.
    assert max(heights) > 50
