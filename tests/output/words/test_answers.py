"""Answers with their words: each place belongs to the base pose beside it."""

from __future__ import annotations

import itertools
import math

import numpy as np

import tcs
from tcs.output.terminal.tables import report_choice
from tcs.output.words import (
    choice_in_words,
    explanation_in_words,
    member_places,
    place_in_line,
    place_of_state,
    relative_place,
    summary_in_words,
)
from tests.placement.store.example import score_file

# No axis of the body through base positions of the grid: rounding would decide on the sides.
BODY = {
    "head": (0.017, 0.013, 1.2), "lower_body": (0.017, 0.013, 0.6),
    "foot_left": (0.713, 0.113, 0.2), "foot_right": (0.717, -0.087, 0.2),
}  # fmt: skip
FILE = score_file(body_frames={name: [*at, *at] for name, at in BODY.items()})
"""A file with two states of the environment."""


def place(member):
    yaw = math.radians(member["base_yaw_deg"])
    return relative_place(member["base_x"], member["base_y"], yaw, BODY).text


def test_each_stop_has_its_place():
    turned = set()
    for x, y in itertools.product((-3.0, 0.0, 3.0), repeat=2):
        here = tcs.InitialConfiguration(base_x=x, base_y=y, base_yaw=0.0, torso=0.0)
        choice = tcs.select(FILE, here, weights=tcs.UtilityWeights(travel=0.01))
        found = choice_in_words(FILE, choice, here)
        assert found["places"] == [place(member) for member in found["members"]]
        assert found["here_place"] == relative_place(x, y, 0.0, BODY).text
        assert len(set(found["places"])) == 2
        turned.add(choice.order == tuple(sorted(choice.order)))
    assert turned == {True, False}


def test_places_are_of_the_state_and_the_table():
    turned = {name: (-x, -y, z) for name, (x, y, z) in BODY.items()}
    file = score_file(body_frames={name: [*at, *turned[name]] for name, at in BODY.items()})
    grid = file.configurations
    for _ in range(2):
        for index in range(grid.size):
            member = grid.configuration(index)
            frames = (BODY, turned)[int(grid.state_of(np.array([index]))[0])]
            pose = (member.base_x, member.base_y, member.base_yaw)
            assert member_places(file, 0, [index]) == [relative_place(*pose, frames).text]


def test_a_base_off_the_grid_is_beside_the_person_of_the_nearest_state():
    turned = {name: (-x, -y, z) for name, (x, y, z) in BODY.items()}
    file = score_file(body_frames={name: [*at, *turned[name]] for name, at in BODY.items()})
    [axis] = file.configurations.environment_axes
    first, last = axis.value(0), axis.value(-1)
    for value, frames in (
        (first - 1.0, BODY), (0.6 * first + 0.4 * last, BODY),
        (0.4 * first + 0.6 * last, turned), (last, turned),
    ):  # fmt: skip
        here = tcs.InitialConfiguration(
            base_x=7.1,
            base_y=-3.3,
            base_yaw=1.0,
            torso=0.0,
            environment=((axis.name, value),),
            environment_units=(axis.held_unit,),
        )
        assert place_of_state(file, 0, here) == relative_place(7.1, -3.3, 1.0, frames).text


def test_alternatives_have_places_before_their_coordinates(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    here = tcs.InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    found = choice_in_words(FILE, tcs.select(FILE, here, top=tcs.Top(count=3, min_apart=0.1)), here)
    assert len(found["alternatives"]) == 2
    for one in found["alternatives"]:
        assert one["places"] == [place(member) for member in one["members"]]
    report_choice(found)
    printed = capsys.readouterr().out
    assert printed.startswith(f"Now: {place_in_line(found['here_place'])}.\nStop 1: ")
    [heading] = [line for line in printed.splitlines() if "net utility" in line]
    [row] = [line for line in printed.splitlines() if line.split()[:1] == ["3"]]
    moves = ", ".join(found["alternatives"][1]["moves"]) or "-"
    assert row.rindex(moves) == heading.index("moves")
    assert 0 < printed.index("Set 1: ") < printed.index("Set 3: ") < printed.index("base poses")


def test_the_best_sets_of_a_summary_have_places():
    sets, grid = FILE.nominal.sets, FILE.configurations
    found = summary_in_words(FILE, {"best": {"reachability": 1.0}, "best_single": {}, "goals": 5})
    for key, members in (("best", sets.best), ("best_single", sets.best_single)):
        expected = [place(grid.configuration(h).to_json()) for h in members]
        assert found[key]["places"] == expected
    assert (found["best"]["reachability"], found["goals"]) == (1.0, 5)
    assert summary_in_words(FILE, {"best": None, "best_single": None})["best"] is None


def test_explanations_name_goals_and_places():
    seen = set()
    for index in range(0, FILE.configurations.size, 7):
        found = explanation_in_words(FILE, tcs.explain(FILE, 2, index))
        assert found["goal_names"] == ["head, place 1", "", "", "", ""]
        for key in ("explained", "nearest_reaching"):
            assert found[key]["place"] == place(found[key]["members"][0])
            seen.add((key, found[key]["place"]))
    assert len(seen) > 4


def test_without_a_person_there_is_no_place():
    here = tcs.InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    file = score_file()
    found = choice_in_words(file, tcs.select(file, here), here)
    assert set(found["places"]) == {""}
    assert found["here_place"] == ""
