"""The page in a real browser: click, drag, keys, languages, a job, phone and desktop, offline."""

from __future__ import annotations

from pathlib import Path

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

NAMES = """
const [done, bodies] = [arguments[1], arguments[0]];
import("/app/texts.js").then(found =>
  done(bodies.map(one => found.bodyName(one, name => name === "wall"))));
"""

CARDS = """
const done = arguments[0];
import("/app/panels.js").then(({showCards}) => {
  const one = {members: [{}], reachability: 1, manipulability: 0.346, moves: [], cost: 0.08};
  const sure = {success: 0.92, success_ci95: [0.9, 0.94]};
  const two = {...one, ...sure, members: [{}, {}], manipulability: 0.348};
  const fewer = {...one, success: 0.32};
  showCards([{...two, basis: "success", fewer}, {...one, cost: 0}], () => {}, () => {});
  const texts = card => [...card.children].map(part => part.textContent);
  done([...document.querySelectorAll("#cards .card")].map(texts));
});
"""
REACHED = """
return [...document.querySelectorAll("#goals li")].filter(one => one.querySelector(".yes"))
  .map(one => one.querySelector(".name").firstChild.textContent);
"""

AXE = Path(__file__).parents[2] / "node_modules" / "axe-core" / "axe.min.js"
RUN_AXE = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ["violations"]}).then(found => done(found.violations
  .filter(one => ["serious", "critical"].includes(one.impact))
  .map(one => `${one.id}: ${one.nodes.map(node => node.html.slice(0, 120)).join(" | ")}`)));
"""


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("app")
    grid = {**BESIDE, "base_yaw": (0, 45, 8)}
    environment = write_environment(folder, "beside", grid)
    tcs.save(folder / "beside.tcs", tcs.score("shaving", environment=str(environment), paper=True))
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


def test_without_a_file_only_scoring_is_offered(browser):
    script = browser.driver.execute_script
    with Engine() as engine:
        application = make_application(engine, Access())
        add_page(application)
        with Server(application, host="127.0.0.1", port=0) as server:
            browser.driver.get("about:blank")
            browser.driver.get(f"{server.url}/#language=en")
            tasks = "return document.getElementById('task').options.length"
            browser.wait(lambda: script(tasks) > 5)
            shown = "return [...arguments].map(id => document.getElementById(id).checkVisibility())"
            parts = ("score", "words", "limits", "floor", "space", "cards", "expert", "files")
            assert script(shown, *parts) == [True] * 3 + [False] * 5
            assert "Choose a task above" in script(WORDS)
            browser.driver.get("about:blank")
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
    # The command that says the same names the goal by its number.
    number = "return 1 + [...document.querySelectorAll('#goals li')].indexOf(arguments[0])"
    goal = script(number, why[-1].find_element("xpath", "ancestor::li"))
    assert goal > 1
    script("arguments[0].click()", why[-1])
    page.wait(lambda: not script("return document.getElementById('why').hidden"))
    assert script("return document.activeElement.id") == "why"
    command = script("return document.getElementById('command').textContent")
    assert f" --goal {goal} --here " in command.splitlines()[-1]


def test_a_card_says_why_it_is_recommended_and_how_long_it_takes(page):
    first, second = page.driver.execute_async_script(CARDS)
    assert first[:4] == [
        "2 places: 100 %",
        "Recommended: the most robust",
        "2 places instead of 1: success under error 92.0 % instead of 32.0 %, dexterity 0.348 "
        "instead of 0.346.",
        "0.1 m to drive: 1 s at 0.2 m/s, without turning",
    ]
    assert second[:2] == ["One place: 100 %", "nothing to drive"]


def test_no_click_loses_a_goal_without_a_word(page):
    script = page.driver.execute_script
    buttons = "return document.querySelectorAll('#goals li button:last-child')"
    address = script("return location.href")
    for number in range(len(script(buttons))):
        page.driver.get("about:blank")
        page.driver.get(address)
        page.wait(lambda: len(script(buttons)) > 0)
        before, pose = script(REACHED), script(POSE)
        script("arguments[0].click()", script(buttons)[number])
        asks = "return !document.getElementById('why').hidden"
        page.wait(lambda: script(asks) or script(POSE) != pose)  # noqa: B023
        if script(asks):
            assert "It no longer reaches" in script(
                "return document.getElementById('why').innerText"
            )
            assert script(REACHED) == before
        else:
            page.wait(lambda: set(script(REACHED)) > set(before))  # noqa: B023


def scored_again(page, do):
    """Do something that changes the scene, and wait until it is scored again."""
    script = page.driver.execute_script
    script("delete document.body.dataset.rescored")
    do()
    page.wait(lambda: script("return document.body.dataset.rescored"))
    assert script("return document.getElementById('fault').textContent") == ""
    assert script("return document.getElementById('changed').textContent").startswith("Scored in")


def test_the_scene_is_changed_by_pointer_and_keys_and_scored_again(page):
    from selenium.webdriver import ActionChains

    script = page.driver.execute_script
    page.wait(lambda: not script("return document.getElementById('editing').hidden"))
    shown = "return document.querySelector('#map image').getAttribute('href')"
    before = script(shown)
    person = page.driver.find_element("css selector", ".thing[data-name=person] > polygon")
    script("document.getElementById('map').scrollIntoView({block: 'center'})")
    drag = ActionChains(page.driver).move_to_element(person).click_and_hold()
    scored_again(page, drag.move_by_offset(15, 6).move_by_offset(15, 6).release().perform)
    assert script("return document.getElementById('subject').value") == "person"
    assert float(script("return document.getElementById('thingX').value")) > 0.05
    moved = script(shown)
    assert moved != before
    scored_again(page, lambda: script("document.getElementById('addPiece').click()"))
    assert script("return document.getElementById('subject').value") == "chair_1"
    x = float(script("return document.getElementById('thingX').value"))
    scored_again(page, lambda: key(page, "\ue014"))
    assert float(script("return document.getElementById('thingX').value")) > x
    head = "[data-name=head_tilt_deg]"
    slide = f"const one = document.querySelector('{head}'); one.value = 5;"
    scored_again(page, lambda: script(f"{slide} one.oninput(); one.onchange()"))
    # The address restores the changes in another page.
    page.driver.refresh()
    page.wait(lambda: script("return document.querySelectorAll('.thing').length") == 3)
    page.wait(lambda: script("return document.body.dataset.rescored"))
    script("document.getElementById('undo').click()")
    page.wait(lambda: script(shown) == before)


def test_the_scene_in_space_says_that_it_is_the_one_before(page):
    script = page.driver.execute_script
    page.wait(lambda: not script("return document.getElementById('editing').hidden"))
    page.wait(lambda: script("return document.getElementById('building').hidden"))
    pale = "return Number(getComputedStyle(document.getElementById('canvas3d')).opacity) < 0.5"
    assert not script(pale)
    script("document.getElementById('addPiece').click()")
    assert script(pale)
    assert not script("return document.getElementById('building').hidden")
    page.wait(lambda: script("return document.getElementById('building').hidden"))
    assert script("return document.body.dataset.rescored")
    assert not script(pale)


def test_undo_shows_the_state_that_its_sliders_say(browser, tmp_path):
    grid = {"base_x": (1.5, 0.2, 2), "base_y": (0.5, 0.2, 2), "base_yaw": (180, 90, 1)}
    grid |= {"torso": (0.15, 0.15, 1), "bed_height": (0.0, 0.1, 1), "head_rest": (0, 40, 2)}
    environment = write_environment(tmp_path, "beds", grid, based_on="bed")
    script = browser.driver.execute_script
    with Engine() as engine:
        scores = tcs.score("shaving", environment=str(environment), paper=True)
        tcs.save(tmp_path / "beds.tcs", scores)
        engine.open_file(tmp_path / "beds.tcs")
        application = make_application(engine, Access())
        add_page(application)
        with Server(application, host="127.0.0.1", port=0) as server:
            browser.driver.get("about:blank")
            browser.driver.get(f"{server.url}/#language=en")
            browser.wait(lambda: not script("return document.getElementById('editing').hidden"))
            one = "const one = document.querySelector('#sliders [data-name=head_rest_deg]');"
            moves = f"{one} one.value = 30; one.oninput(); one.onchange()"
            scored_again(browser, lambda: script(moves))
            script("document.getElementById('undo').click()")
            # The nearest state of the table, in the sliders and in what is asked.
            browser.wait(lambda: script(f"{one} return one.value") == "40")
            browser.wait(lambda: "state=1" in script("return location.hash"))
            assert "at=" not in script("return location.hash")
            browser.driver.get("about:blank")
    # Where nothing is reached, no set can be chosen; no test of others reads of that.
    browser.complaints()


def test_the_3d_view_follows_and_motions_are_played(page):
    script = page.driver.execute_script
    picture = (
        "const one = document.getElementById('canvas3d');"
        "one.dispatchEvent(new KeyboardEvent('keydown', {key: '+'}));"
        "return document.getElementById('marks3d').toDataURL()"
    )
    page.wait(lambda: script("return document.getElementById('armAt').options.length") > 1)
    page.wait(lambda: script("return document.getElementById('building').hidden"))
    page.wait(lambda: script("return document.getElementById('marks3d').width") > 100)
    before = script(picture)
    page.wait(lambda: script(picture) != before)
    script("document.getElementById('plan').click()")
    page.wait(
        lambda: "can be done" in script("return document.getElementById('planWords').textContent")
    )
    words = script("return document.getElementById('planWords').textContent")
    limits = script("return document.getElementById('planLimits').textContent")
    assert "Not checked: driving" in limits
    assert script("return document.querySelectorAll('#limits li').length") == 4
    if not words.startswith("0 "):
        page.wait(lambda: not script("return document.getElementById('player').hidden"))
        time = "return Number(document.getElementById('time').value)"
        page.wait(lambda: script(time) > 0)
        label = "return document.getElementById('play').textContent"
        if script(label) == "Pause":
            script("document.getElementById('play').click()")
        assert script(label) == "Play"
        paused = script(time)
        assert script(time) == paused


def test_what_is_not_checked_is_in_view_and_files_are_in_the_header(page):
    script = page.driver.execute_script
    seen = "const {top, bottom} = document.querySelector('footer').getBoundingClientRect();"
    for scrolled in ("0", "document.body.scrollHeight"):
        script(f"scrollTo(0, {scrolled})")
        assert script(f"{seen} return top > 0 && bottom <= innerHeight")
    assert "driving" in script("return document.querySelector('footer').textContent")
    script("document.querySelector('header #files').open = true")
    assert not script("return document.getElementById('shared').innerText")
    script("document.getElementById('share').click()")
    page.wait(lambda: "copied" in script("return document.getElementById('shared').innerText"))
    # It is not of the set beside it, which begins where the robot is now.
    report = script("return document.getElementById('report').textContent")
    assert report == "Report of the recommended set"
    for name in ("report", "download", "downloadEnvironment", "page3d"):
        assert page.driver.find_element("css selector", f"header #{name}").is_displayed()


def test_what_is_beside_the_grid_is_told_from_where_nothing_is_reached(page):
    shown = (
        "return ['#map', '.legend .outside', '.legend .zero']"
        ".map(one => getComputedStyle(document.querySelector(one)).backgroundImage)"
    )
    beside, key, nothing = page.driver.execute_script(shown)
    assert beside == key
    assert "gradient" in beside
    assert nothing == "none"


def test_bodies_have_names_for_readers(page):
    script = page.driver.execute_script
    bodies = ["l_gripper_r_finger_link", "person::arm_left_link", "wall", "r_forearm_link"]
    assert page.driver.execute_async_script(NAMES, bodies) == [
        "left finger of the gripper (robot)", "left upper arm (person)", "wall",
        "right forearm (robot)",
    ]  # fmt: skip
    script("const one = document.getElementById('language'); one.value = 'de'; one.onchange()")
    page.wait(lambda: "erreicht" in script(WORDS))
    assert page.driver.execute_async_script(NAMES, bodies[1:3]) == [
        "Oberarm links (Person)", "Wand",
    ]  # fmt: skip
    script("const one = document.getElementById('language'); one.value = 'en'; one.onchange()")
    page.wait(lambda: "reached" in script(WORDS))


def test_languages_and_sizes(page):
    script = page.driver.execute_script
    assert script("return document.documentElement.scrollWidth") <= script("return innerWidth")
    assert script(SMALL) == []
    script("const one = document.getElementById('language'); one.value = 'de'; one.onchange()")
    page.wait(lambda: "erreicht" in script(WORDS))
    assert script("return document.documentElement.lang") == "de"
    script("const one = document.getElementById('language'); one.value = 'en'; one.onchange()")
    page.wait(lambda: "reached" in script(WORDS))


def test_axe_finds_nothing_serious_in_any_part(page):
    if not AXE.exists():
        pytest.skip("needs axe-core: npm install --no-save axe-core")
    script = page.driver.execute_script
    page.driver.set_script_timeout(60)
    script(AXE.read_text(encoding="utf-8"))
    assert page.driver.execute_async_script(RUN_AXE) == []
    # Everything opened: changed scene, explanation, colours, scoring and the details for experts.
    page.wait(lambda: not script("return document.getElementById('editing').hidden"))
    choose = "const one = document.getElementById('piece'); one.value = arguments[0];"
    for piece in ("chair", "region"):
        script(choose + "document.getElementById('addPiece').click()", piece)
    page.wait(lambda: not script("return document.body.hasAttribute('aria-busy')"))
    script("document.getElementById('drawRegion').click()")
    script("for (const one of document.querySelectorAll('details')) one.open = true")
    script(
        "document.getElementById('job').hidden = document.getElementById('player').hidden = false"
    )
    script("document.querySelector('#goals button').click()")
    page.wait(lambda: not script("return document.getElementById('why').hidden"))
    for language in ("en", "de"):
        script(
            "const one = document.getElementById('language'); one.value = arguments[0];"
            "one.onchange()",
            language,
        )
        page.wait(lambda: script("return document.documentElement.lang") == language)  # noqa: B023
        assert page.driver.execute_async_script(RUN_AXE) == []
    script("const one = document.getElementById('language'); one.value = 'en'; one.onchange()")
    page.wait(lambda: script("return document.documentElement.lang") == "en")


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
