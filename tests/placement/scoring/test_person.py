"""Scoring for a person: the papers' man as before, others confirmed by Drake."""

from __future__ import annotations

import dataclasses

import pytest

import tcs
from tcs.errors import StoreError
from tcs.model.people import PAPERS_MAN
from tcs.placement.scoring import offline
from tcs.placement.scoring.person import recorded_person
from tcs.placement.scoring.rebuild import made_from
from tests.environments import BESIDE, write_environment
from tests.two_arms import GRID, PAIR, write_pair

SMALL = {"sex": "female", "stature_percentile": 5, "mass_percentile": 5}
LARGE = {"sex": "male", "stature_percentile": 95, "mass_percentile": 95}
BED = """
name: small-bed
based_on: bed-no-wall
grid:
  bed_height: {unit: m, start: 0.1, step: 0.1, count: 1}
  head_rest: {unit: deg, start: 35, step: 35, count: 2}
  base_x: {unit: m, start: 0.3, step: 0.3, count: 3}
  base_y: {unit: m, start: 0.8, step: 0.2, count: 2}
  base_yaw: {unit: deg, start: 180, step: 90, count: 2}
  torso: {unit: m, start: 0.15, step: 0.15, count: 1}
observed: {}
"""


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Paths of a small grid beside the wheelchair and of one beside the bed."""
    folder = tmp_path_factory.mktemp("places")
    bed = folder / "small-bed.yaml"
    bed.write_text(BED)
    return {"chair": write_environment(folder, "small-wheelchair", BESIDE), "bed": bed}


def test_the_papers_man_is_scored_as_before(small_environment, small_file):
    man = tcs.score("shaving", small_environment, person={"sex": "male", **PAPERS_MAN}, paper=True)
    for name in ("dexterity", "reason", "arm_joints"):
        before, after = (getattr(f.nominal.scores, name) for f in (small_file, man))
        assert before.tobytes() == after.tobytes()
    assert "person" not in small_file.metadata
    assert small_file.environment["person"] is None


slow = pytest.mark.slow


@pytest.mark.parametrize(
    ("place", "task", "person", "touching"),
    [
        ("chair", "shaving", LARGE, {}),
        pytest.param("chair", "shaving", SMALL, {}, marks=slow),
        # The goal on the forearm, beside a thigh that is broader than that of the papers' man.
        ("bed", "bathing", SMALL, {7: "person::quad_right_link"}),
        pytest.param("bed", "bathing", LARGE, {7: "person::quad_right_link"}, marks=slow),
    ],
)
def test_scores_of_a_person_hold_in_drake(places, caplog, place, task, person, touching):
    file = tcs.score(task, places[place], person=person, paper=True)
    entry = file.metadata["person"]
    assert entry["given"] == {"model": "person", **person}
    assert {found["goal"]: found["part"] for found in entry["touching_goals"]} == touching
    warnings = [text for text in caplog.messages if "is too near to this person" in text]
    assert [text.split()[1] for text in warnings] == [str(goal + 1) for goal in touching]
    assert file.nominal.scores.reached.any()
    # The scene is built again for the person whom the file names.
    found = tcs.verify(file, pairs=40, dense=5)
    assert (found.false_reached, found.missed) == (0, 0)


def inside(arm):
    """Return a goal in the chest, where the gripper touches the person."""
    return {
        "name": f"in the chest{arm}",
        "body_frame": "chest",
        "position": [0.0, 0.0, 0.0],
        "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0],
    }


def test_a_goal_of_one_of_several_hands_is_named_once(tmp_path, caplog):
    place = write_environment(tmp_path, "small", GRID)
    goals = [PAIR[0] | {"together_with": ""}, inside(" right") | {"arm": "right"}]
    file = tcs.score(write_pair(tmp_path, goals), place, person=SMALL, approach=False)
    touching = file.metadata["person"]["touching_goals"]
    assert [(found["goal"], found["name"]) for found in touching] == [(1, "in the chest right")]
    warnings = [text for text in caplog.messages if "is too near to this person" in text]
    assert [text.split(":")[0] for text in warnings] == [
        "goal 2 (in the chest right) is too near to this person"
    ]


def test_touching_goals_are_those_of_both_arms(tmp_path, monkeypatch):
    place, rows = write_environment(tmp_path, "small", GRID), []

    def entry(environment, task, tables):
        rows.extend(table.configurations for table in tables)
        return {}

    monkeypatch.setattr(offline, "person_entry", entry)
    task = write_pair(tmp_path, [inside("")])
    file = tcs.score(task, place, arms="both", person=SMALL, approach=False)
    assert rows == [file.nominal.scores.configurations]


def test_a_record_names_the_person(small_file):
    metadata = {**small_file.metadata, "person": {"given": SMALL}}
    file = dataclasses.replace(small_file, metadata=metadata)
    assert recorded_person(made_from(file)) == SMALL
    assert recorded_person(made_from(small_file)) is None
    for entry in (None, SMALL, {"given": ["sex"]}):
        with pytest.raises(StoreError, match="'person' must hold"):
            recorded_person({"person": entry})
