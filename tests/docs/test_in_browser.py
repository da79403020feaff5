"""The site in a real browser: no requests, no overflow, no messages in the console."""

import pytest

from tests.docs.building import DOCS
from tests.output.view.browser import chromium

PHONE, DESKTOP = 390, 1280
"""Widths of a common phone and of a small laptop [px]."""


OVERFLOWING = """
const scrolls = one => /auto|scroll/.test(getComputedStyle(one).overflowX);
const inScrolled = one =>
  one.tagName !== "ARTICLE" && (scrolls(one) || inScrolled(one.parentElement));
return [...document.querySelectorAll("article *")]
  .filter(one => one.getBoundingClientRect().right > window.innerWidth + 1 && !inScrolled(one))
  .map(one => one.tagName + " " + one.textContent.slice(0, 40));
"""
"""Elements wider than the screen that are in no container that scrolls."""


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


def show_on(browser, width: int) -> None:
    screen = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width == PHONE}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)


@pytest.mark.slow
@pytest.mark.parametrize("width", [PHONE, DESKTOP])
def test_pages_fit_the_screen(site, browser, width):
    show_on(browser, width)
    for source in DOCS.rglob("*.md"):
        path = (site / source.relative_to(DOCS)).with_suffix(".html")
        browser.driver.get(path.as_uri())
        assert browser.driver.execute_script(OVERFLOWING) == [], path
        assert all(address.startswith("file://") for address in browser.fetched()), path
        assert browser.complaints() == [], path


@pytest.mark.slow
def test_mismatched_parts_are_found(site, browser):
    show_on(browser, PHONE)
    browser.driver.get((site / "index.html").as_uri())
    browser.driver.execute_script("""
        const wide = document.createElement("div");
        wide.style.width = "2000px";
        wide.textContent = "wide";
        document.querySelector("article").append(wide);
    """)
    assert browser.driver.execute_script(OVERFLOWING) == ["DIV wide"]


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
