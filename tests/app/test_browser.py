"""The page in a real browser: click, drag, keys, languages, a job, phone and desktop, offline."""

from __future__ import annotations

import pytest

import tcs
from tcs.app import add_page
from tcs.service import Engine
from tcs.service.http import Access, Server, make_application
from tests.environments import BESIDE, write_environment
from tests.output.view.browser import chromium

pytestmark = pytest.mark.slow
WORDS = "return document.getElementById('words').textContent"
POSE = "return ['x', 'y', 'yaw'].map(id => Number(document.getElementById(id).value))"
SMALL = """
return [...document.querySelectorAll("button, select, summary, input, a.button")]
  .filter(one => one.offsetParent && one.type !== "checkbox")
  .filter(one => one.getBoundingClientRect().height < 44)
  .map(one => one.outerHTML.slice(0, 80));
"""


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("app")
    grid = {**BESIDE, "base_yaw": (0, 45, 8)}
    environment = write_environment(folder, "beside", grid)
    tcs.save(folder / "beside.tcs", tcs.score("shaving", environment=str(environment)))
    with Engine() as engine:
        engine.open_file(folder / "beside.tcs")
        application = make_application(engine, Access())
        add_page(application)
        with Server(application, host="127.0.0.1", port=0) as server:
            yield server.url


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.fixture(params=[(1440, 900), (390, 844)], ids=["desktop", "phone"])
def page(request, url, browser):
    """The page at the size of a laptop or a phone, ready, with the scene drawn."""
    width, height = request.param
    screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width == 390}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    browser.driver.get("about:blank")
    browser.driver.get(f"{url}/#language=en")
    browser.wait(lambda: browser.driver.execute_script("return document.body.dataset.ready"))
    drawn = "return document.querySelectorAll('#map polygon').length > 5"
    browser.wait(lambda: browser.driver.execute_script(drawn))
    yield browser
    assert all(address.startswith(url) for address in browser.fetched())
    assert browser.complaints() == []


def key(page, text):
    page.driver.find_element("id", "map").send_keys(text)


def test_words_goals_and_places_follow_the_robot(page):
    script = page.driver.execute_script
    assert "places reached" in script(WORDS)
    x, _, yaw = script(POSE)
    key(page, "\ue014")
    page.wait(lambda: script(POSE)[0] > x)
    key(page, "r")
    page.wait(lambda: script(POSE)[2] != yaw)
    page.wait(lambda: script("return document.querySelectorAll('#goals li').length") == 8)
    page.wait(lambda: script("return document.querySelectorAll('#cards .card').length") > 0)
    moved = script(POSE)
    script("document.querySelector('#cards button').click()")
    page.wait(lambda: script(POSE) != moved)


def test_a_click_moves_the_robot_and_why_explains(page):
    from selenium.webdriver import ActionChains

    script = page.driver.execute_script
    before = script(POSE)
    place = page.driver.find_element("id", "map")
    script("arguments[0].scrollIntoView({block: 'center'})", place)
    size = place.size
    ActionChains(page.driver).move_to_element_with_offset(
        place, -size["width"] // 8, size["height"] // 8
    ).click().perform()
    page.wait(lambda: script(POSE)[:2] != before[:2])
    why = page.driver.find_elements("css selector", "#goals button")
    assert why
    script("arguments[0].click()", why[0])
    page.wait(lambda: not script("return document.getElementById('why').hidden"))
    assert script("return document.activeElement.id") == "why"


def test_languages_and_sizes(page):
    script = page.driver.execute_script
    assert script("return document.documentElement.scrollWidth") <= script("return innerWidth")
    assert script(SMALL) == []
    script("const one = document.getElementById('language'); one.value = 'de'; one.onchange()")
    page.wait(lambda: "erreicht" in script(WORDS))
    assert script("return document.documentElement.lang") == "de"
    script("const one = document.getElementById('language'); one.value = 'en'; one.onchange()")
    page.wait(lambda: "reached" in script(WORDS))


def test_a_task_is_scored_and_another_is_cancelled(page):
    script = page.driver.execute_script
    page.wait(lambda: script("return document.getElementById('task').options.length") > 5)
    choose = "const one = document.getElementById(arguments[0]); one.value = arguments[1];"
    script("document.getElementById('scoring').open = true")
    script(choose, "robot", "pr2")
    script(choose + "one.onchange()", "task", "feeding")
    script("document.getElementById('score').requestSubmit()")
    page.wait(lambda: not script("return document.getElementById('job').hidden"))
    script("document.getElementById('cancel').click()")
    words = "return document.getElementById('jobWords').textContent"
    page.wait(lambda: script(words) == "Cancelled.")
    files = script("return document.getElementById('file').options.length")
    script("document.getElementById('score').requestSubmit()")
    page.wait(lambda: script(words) == "Scored.")
    assert script("return document.getElementById('file').options.length") >= files
    page.wait(lambda: "places reached" in script(WORDS))
    assert "feeding" in script("return document.getElementById('file').selectedOptions[0].text")
