"""What the command line shows, and the names under which programs call the same functions."""

import json
from pathlib import Path

import pytest
import typer.main

import tcs
from tcs.cli.app import app
from tcs.model.catalogue import kind_of
from tcs.model.scene import load_environment
from tcs.model.tasks import load_task

CHECKOUT = Path(__file__).resolve().parents[2]
ALIASES = {
    "select": "place",
    "evaluate": "study evaluate",
    "robustify": "study robustify",
    "population": "study population",
    "refine": "study refine",
    "motions": "study motions",
    "study new": "study trials new",
    "study record": "study trials record",
    "study report": "study trials report",
    "robot new": "new robot",
    "teleop": "arm",
    "teleop replay": "arm replay",
    "teleop experiment": "study experiment",
    "teleop pick-and-place": "study pick-and-place",
    "capability merge": "maps capability merge",
    "arplace query": "maps arplace query",
    "locate": "maps locate",
    "map-check": "maps check",
}
"""The name that programs may call, and the one that the help shows."""
OTHERS = ("list", "verify", "export", "map", "picture", "view", "robot check", "environment check")
"""Names of parts of `check` and `report`, and the list that the help points to."""


def command(name):
    found = typer.main.get_command(app)
    for word in name.split():
        found = found.commands[word]
    return found


def test_at_most_twelve_entries_are_shown():
    shown = [n for n, one in typer.main.get_command(app).commands.items() if not one.hidden]
    assert shown[:4] == ["app", "score", "place", "explain"]
    assert len(shown) <= 12


@pytest.mark.parametrize(("alias", "name"), ALIASES.items())
def test_alias_is_the_same_command(alias, name):
    hidden, shown = command(alias), command(name)
    assert hidden.callback.__wrapped__ is shown.callback.__wrapped__
    assert [p.opts for p in hidden.params] == [p.opts for p in shown.params]


@pytest.mark.parametrize("name", OTHERS)
def test_other_names_go_on(name):
    assert command(name).callback is not None


def test_help_says_where_the_list_is(tcs_command):
    ran = tcs_command("--help")
    assert "tcs list" in ran.out


@pytest.mark.parametrize(
    ("reference", "kind"),
    [
        ("shaving", "task"),
        ("bed", "environment"),
        ("pr2", "robot"),
        ("razor", "tool"),
        ("examples/pr2_spoon.yaml", "robot"),
        ("examples/kitchen.yaml", "environment"),
        ("examples/wiping.yaml", "task"),
        ("scores.tcs", None),
    ],
)
def test_kind_of_a_model(reference, kind):
    path = CHECKOUT / reference
    assert kind_of(str(path) if path.exists() else reference) == kind


def test_check_takes_anything(tcs_command, small_file, tmp_path):
    person, nothing = tmp_path / "tall.yaml", tmp_path / "nothing.yaml"
    person.write_text("{sex: female, stature: 1.8}")
    nothing.write_text("colour: green")
    ran = tcs_command("check", "shaving", "wheelchair", person, small_file, nothing, "--json")
    assert ran.code == 1
    kinds = [one["kind"] for one in ran.json["whole"]]
    assert kinds == ["task", "environment", "person", "score file"]
    assert len(ran.json["whole"][0]["details"]["goals"]) == 8
    [refused] = ran.json["damaged"]
    assert "no key of a task" in refused["error"]


def test_a_task_that_is_wrong_is_one_line(tcs_command, tmp_path):
    path = tmp_path / "task.yaml"
    path.write_text("{name: x, title: X, source: me, environments: [bed], goals: []}")
    ran = tcs_command("check", path)
    assert ran.code == 1
    assert ran.err.count("\n") == 1


def test_drafts_can_be_used_at_once(tcs_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert tcs_command("new", "environment", "room.yaml").code == 0
    assert tcs_command("new", "task", "wipe.yaml", "--environment", "room.yaml").code == 0
    assert [one.name for one in load_environment("room.yaml").obstacles] == ["table"]
    assert load_task("wipe.yaml").environments == ("room",)
    assert tcs_command("check", "room.yaml", "wipe.yaml").code == 0
    again = tcs_command("new", "task", "wipe.yaml")
    assert again.code == 1
    assert "exists" in again.err


def test_report_writes_single_files(tcs_command, corner, tmp_path):
    scores, table, floor = (tmp_path / name for name in ("a.tcs", "a.csv", "a.png"))
    tcs.save(scores, tcs.score("shaving", corner, approach=False))
    ran = tcs_command("report", scores, "--csv", table, "--map", floor, "--json")
    assert ran.code == 0
    assert ran.json["files"] == [str(floor), str(table)]
    assert ran.json["bytes"] == [path.stat().st_size for path in (floor, table)]


def test_report_of_nothing_is_misuse(tcs_command, small_file):
    ran = tcs_command("report", small_file)
    assert ran.code == 2
    assert "--map" in ran.err


def test_explain_tells_of_all_goals(tcs_command, small_file):
    ran = tcs_command("explain", small_file, "--json")
    goals = tcs.load(small_file).nominal.sets.weights.size
    assert [one["goal"] for one in ran.json["goals"]] == list(range(goals))
    one = tcs_command("explain", small_file, "--goal", "1", "--json").json
    one.pop("missing", None)
    assert json.dumps(ran.json["goals"][0], sort_keys=True) == json.dumps(one, sort_keys=True)
    assert "--goal" in tcs_command("explain", small_file).out
