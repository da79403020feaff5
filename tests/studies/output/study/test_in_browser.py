"""Questionnaires in a real browser: phone and desktop, keyboard alone, no requests elsewhere."""

from __future__ import annotations

import time

import pytest

from tcs_studies.output.study.server import FormServer
from tcs_studies.study.participants import new_participant
from tcs_studies.study.recording import StudyRecording
from tests.output.view.browser import chromium
from tests.studies.study.example import answers_to, run_on, small_study

PHONE, DESKTOP = (390, 844), (1440, 900)
SMALL = """
const least = 44;
const targets = [...document.querySelectorAll(
  "label:has(input), button, textarea, input[type=text], input[type=number], .faults a")];
return targets.map(one => [one, one.getBoundingClientRect()])
  .filter(([, box]) => box.width < least - 0.5 || box.height < least - 0.5)
  .map(([one, box]) => one.outerHTML.slice(0, 80) + " " + box.width + " x " + box.height);
"""
"""Targets below 44 px."""


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.fixture
def recording(tmp_path):
    study = small_study(tmp_path, training=0)
    return StudyRecording(study, new_participant(study))


@pytest.fixture
def server(recording):
    found = FormServer(recording, port=None, refresh=False)
    yield found
    found.close()


def show_on(browser, size):
    width, height = size
    screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)


def wait_for(recording, key):
    end = time.monotonic() + 30.0
    while key not in recording.participant.steps and time.monotonic() < end:
        time.sleep(0.05)
    return recording.participant.steps[key]


@pytest.mark.slow
@pytest.mark.parametrize("size", [PHONE, DESKTOP], ids=["phone", "desktop"])
def test_forms_fit_the_screen_with_large_targets(browser, recording, server, size):
    show_on(browser, size)
    recording.skip("none")
    while (step := recording.next_step) is not None:
        if step.form is None:
            recording.record_run(run_on(recording.study, step.condition))
            continue
        browser.driver.get(server.url)
        width = browser.driver.execute_script("return document.documentElement.scrollWidth")
        assert width <= size[0], step.key
        assert browser.driver.execute_script(SMALL) == [], step.key
        assert browser.fetched() == [], step.key
        # Sent without the checks of the browser, the page returns with its list of faults.
        browser.driver.execute_script("document.querySelector('form').noValidate = true")
        browser.driver.find_element("css selector", "button").click()
        browser.wait(lambda: "Not saved yet" in browser.driver.page_source)
        assert browser.driver.execute_script(SMALL) == [], step.key
        recording.save_answers(step, answers_to(recording.form(step)))
    # The browser reports the status of the pages with faults, and must report nothing else.
    assert [one for one in browser.complaints() if "422" not in one["message"]] == []


@pytest.mark.slow
def test_a_form_is_filled_in_with_the_keyboard(browser, recording, server):
    from selenium.webdriver import ActionChains, Keys

    show_on(browser, DESKTOP)
    recording.skip("none")
    recording.record_run(run_on(recording.study, "end-effector"))
    browser.driver.get(server.url)
    keys = ActionChains(browser.driver)
    for item in range(9):
        # Space marks the first box, an arrow key the next one.
        keys.send_keys(Keys.TAB, Keys.SPACE, *[Keys.ARROW_RIGHT] * (item % 5))
    keys.send_keys(Keys.TAB, "good", Keys.TAB, Keys.ENTER).perform()
    answers = wait_for(recording, "end-effector/van-der-laan").answers
    assert answers.pop("comments") == "good"
    assert list(answers.values()) == [1 + item % 5 for item in range(9)]


@pytest.mark.slow
def test_a_double_click_is_one_answer(browser, recording, server):
    from selenium.webdriver import ActionChains

    show_on(browser, PHONE)
    browser.driver.get(server.url)
    button = browser.driver.find_element("css selector", "button")
    ActionChains(browser.driver).double_click(button).perform()
    wait_for(recording, "background")
    browser.wait(lambda: "Saved" in browser.driver.title)
    assert list(recording.participant.steps) == ["background"]
