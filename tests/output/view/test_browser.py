from __future__ import annotations

import numpy as np
import pytest

from tcs.model.scene import Scene
from tcs.output.view import SceneObjects, Viewer, open_meshcat
from tests.output.view.browser import chromium

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page():
    yield from chromium()


@pytest.fixture
def viewer(spec, shaving, shaving_set):
    objects = SceneObjects(Scene(spec, meshes=True), shaving, shaving_set, meshes=True)
    meshcat = open_meshcat()
    found = Viewer(meshcat, objects, shaving_set, lambda _: None)
    found.url = meshcat.web_url()
    return found


@pytest.fixture
def live(page, viewer):
    """The viewer in the browser."""
    page.open(viewer.url, "robot")
    page.wait(lambda: page.has("environment") and page.has("floor"))
    return page


def expected(viewed, index):
    """Return the arrows that should be visible."""
    return {g: [one.name.lower()] for g, one in enumerate(viewed.result(index).reasons)}


def changed(before, after):
    """Return the number of pixels that differ."""
    return np.count_nonzero(np.any(abs(before - after) > 20, axis=2))


def controller(page, name):
    """Return the slider of that name as an element to click on."""
    return page.driver.execute_script(
        "return [...document.querySelectorAll('.dg .cr')].find(row => "
        "row.querySelector('.property-name')?.textContent === arguments[0])"
        "?.querySelector('.slider')",
        name,
    )


def test_viewer_shows_and_answers(live, viewer, shaving_set):
    assert changed(live.picture(), live.picture("robot")) > 3000
    assert changed(live.picture(), live.picture("environment")) > 3000
    assert changed(live.picture(), live.picture("goals")) > 50
    # The map lies under both.
    bare = live.picture("robot", "environment")
    assert changed(bare, live.picture("robot", "environment", "floor")) > 300
    here = int(shaving_set.grid.flat(viewer.state.along))
    assert live.arrows() == expected(shaving_set, here)
    assert live.complaints() == []
    ours = (viewer.url, "data:", "blob:")
    assert [name for name in live.fetched() if not name.startswith(ours)] == []


def test_sliders_and_keys_change_what_the_arrows_show(live, viewer, shaving_set):
    from selenium.webdriver import ActionChains

    live.driver.execute_script("viewer.gui.open()")
    wanted = {"set member", "goal", "base x [m]", "heading [deg]"}
    names = "return Object.keys(viewer.gui_controllers)"
    # Controls arrive after the scene.
    live.wait(lambda: wanted <= set(live.driver.execute_script(names)))
    before = live.arrows()
    slider = controller(live, "base x [m]")
    live.driver.execute_script("arguments[0].scrollIntoView()", slider)
    right = slider.size["width"] // 2 - 3
    ActionChains(live.driver).move_to_element_with_offset(slider, right, 0).click().perform()
    live.wait(viewer.update)
    there = int(shaving_set.grid.flat(viewer.state.along))
    assert shaving_set.grid.configuration(there).base_x == pytest.approx(-0.1)
    live.wait(lambda: live.arrows() == expected(shaving_set, there))
    assert live.arrows() != before
    goal = viewer.state.goal
    ActionChains(live.driver).send_keys("g").perform()
    live.wait(viewer.update)
    assert viewer.state.goal == (goal + 1) % shaving_set.goals
    assert live.complaints() == []
