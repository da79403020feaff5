"""The page without a browser: parts, texts in every language, and nothing from elsewhere."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from importlib.resources import files

import httpx
import pytest

from tcs.app import LANGUAGES, add_page
from tcs.model.tasks import load_task, task_names
from tcs.placement.tables import Reason
from tcs.service import Engine
from tcs.service.http import Access, Server, make_application

PAGE = files("tcs.app").joinpath("page")
PARTS = [part.name for part in PAGE.iterdir()]
TEXTS = {name: json.loads(PAGE.joinpath(f"{name}.json").read_text()) for name in LANGUAGES}
SCRIPTS = "".join(PAGE.joinpath(name).read_text() for name in PARTS if name.endswith(".js"))


@pytest.fixture(scope="module")
def http():
    with Engine() as engine:
        application = make_application(engine, Access())
        add_page(application)
        with (
            Server(application, host="127.0.0.1", port=0) as server,
            httpx.Client(base_url=server.url, trust_env=False) as http,
        ):
            yield http


def test_every_part_is_served(http):
    page = http.get("/")
    assert page.headers["content-security-policy"].startswith("default-src 'none'")
    assert "<main>" in page.text
    for name in PARTS:
        if name != "index.html":
            part = http.get(f"/app/{name}")
            assert part.status_code == 200, name
            assert part.content == PAGE.joinpath(name).read_bytes()
    assert http.get("/app/..%2fpages.py").status_code == 404
    assert http.get("/app/none.js").status_code == 404


@pytest.mark.parametrize("name", PARTS)
def test_nothing_is_from_elsewhere(name):
    text = PAGE.joinpath(name).read_text().replace('"http://www.w3.org/2000/svg"', "")
    assert re.findall(r"https?://|@import|//cdn", text) == []


def paths(texts: dict, above: str = "") -> set[str]:
    """Return the keys of all texts; frames, goals and bodies may fall back to their own names."""
    found = set()
    for key, value in texts.items():
        if isinstance(value, dict) and key not in ("frames", "goalNames", "bodies"):
            found |= paths(value, f"{above}{key}.")
        else:
            found.add(f"{above}{key}")
    return found


def test_languages_have_the_same_texts():
    first, *others = LANGUAGES
    for other in others:
        assert paths(TEXTS[other]) == paths(TEXTS[first])
        assert len(TEXTS[other]["limits"]) == len(TEXTS[first]["limits"])


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_text_that_is_used_is_there(language):
    html = PAGE.joinpath("index.html").read_text()
    used = {*re.findall(r'data-t="([^"]+)"', html), *re.findall(r'\bt\("([^"]+)"', SCRIPTS)}
    assert used - paths(TEXTS[language]) == set()
    # A refined place keeps no reason.
    reasons = {reason.name.lower() for reason in Reason} | {"unreached"}
    assert reasons == set(TEXTS[language]["reasons"])
    assert {"reachability", "manipulability", "success", "motion"} <= set(TEXTS[language]["legend"])


def test_other_languages_name_every_frame_and_goal_that_ships():
    goals = [goal for name in task_names() for goal in load_task(name).goals]
    for language in LANGUAGES[1:]:
        assert {goal.name for goal in goals if goal.name} <= set(TEXTS[language]["goalNames"])
        assert {goal.body_frame for goal in goals} <= set(TEXTS[language]["frames"])


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_a_badge_is_as_wide_as_its_numbers_and_within_the_picture():
    script = """
    const {grouped, whole} = await import(process.argv[1]);
    const at = (number, x) => ({number, at: [x, 0], reached: true});
    const badges = [[9, 10, 11].map(n => at(n, 0)), [at(12, 0)], [at(3, 0)]]
      .map(m => grouped(m, 1)[0]);
    console.log(JSON.stringify([badges.map(b => [b.text, b.wide]),
      [whole(1, 2, 0, 10), whole(9, 2, 0, 10), whole(5, 2, 0, 10), whole(-1, 2, 0, 10)]]));
    """
    marks = PAGE.joinpath("marks.js").read_bytes()
    # Without a package.json, node takes the page's modules for what they are not.
    url = "data:text/javascript;base64," + base64.b64encode(marks).decode()
    command = ["node", "--input-type=module", "-e", script, url]
    badges, moved = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    for text, wide in badges:
        # A digit is about 0.6 times as wide as the font is high, and a badge higher than its font.
        assert wide >= 0.55 * len(text)
    assert moved == [2, 8, 5, -1]
