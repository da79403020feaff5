import csv
import os
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from tcs.errors import TaskError, TcsError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.tasks import load_task, task_names

FIGURES = Path(__file__).parents[2] / "data" / "adl_goals.csv"

GOOD = """\
name: wiping
title: Wiping the mouth
source: made up
environments: [wheelchair]
goals:
  - body_frame: head
    position: [0.1, 0, -0.05]
    quaternion_wxyz: [1, 0, 0, 0]
    weight: 2
"""


def written(task: str) -> list[dict[str, str]]:
    with FIGURES.open(encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["task"] == task]


@pytest.fixture
def refused(tmp_path):
    """Return the one-line error of a file with this content."""

    def message(content: str | bytes, error: type[TcsError] = TaskError) -> str:
        path = tmp_path / "wiping.yaml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        with pytest.raises(error) as caught:
            load_task(path)
        text = str(caught.value)
        assert text.startswith(f"task file '{path}'")
        assert "\n" not in text
        assert len(text) < 500
        return text

    return message


TABLE_1 = {
    "shaving": ("wheelchair", "bed", "bed-no-wall"),
    "feeding": ("wheelchair",),
    "brushing": ("wheelchair",),
    "bathing": ("bed",),
    "scratching_upper_arm_left": ("bed",),
    "scratching_upper_arm_right": ("bed",),
    "scratching_forearm_left": ("bed",),
    "scratching_forearm_right": ("bed",),
    "scratching_thigh_left": ("bed",),
    "scratching_thigh_right": ("bed",),
    "scratching_chest": ("bed",),
}
"""The tasks of the TCS paper and their environments: 13 rows of its Table I."""


def test_the_rows_of_the_paper_ship():
    assert {name: load_task(name).environments for name in task_names()} == TABLE_1
    assert sum(len(environments) for environments in TABLE_1.values()) == 13


def test_bathing_has_its_goals_on_seven_parts_of_the_body():
    assert len({goal.body_frame for goal in load_task("bathing").goals}) == 7


@pytest.mark.parametrize("name", TABLE_1)
def test_figures_are_the_published_ones(name):
    task, rows = load_task(name), written(name)
    assert len(task.goals) == len(rows)
    for goal, row in zip(task.goals, rows, strict=True):
        assert goal.body_frame == row["body_frame"]
        # 1e-6 is the last digit of the published positions.
        np.testing.assert_allclose(goal.position, [float(row[k]) for k in "xyz"], atol=1e-6)
        quaternion = [float(row[k]) for k in ("qw", "qx", "qy", "qz")]
        np.testing.assert_allclose(goal.quaternion, quaternion, atol=1e-6)
    # Published weights carry nine digits.
    np.testing.assert_allclose(task.weights, [float(row["weight"]) for row in rows], atol=1e-9)


@pytest.mark.parametrize("name", task_names())
def test_shipped_tasks_are_sound(name):
    task = load_task(name)
    assert task.name == name
    assert task.title
    assert task.source
    assert task.tool
    assert task.weights.sum() == pytest.approx(1.0, abs=1e-15)  # rounding of a short sum
    names = [goal.name for goal in task.goals]
    assert all(names)
    assert len(set(names)) == len(names)
    for goal in task.goals:
        # y of the head points to the left; the other frames are one of each side, or in the middle.
        side = goal.body_frame.rpartition("_")[2]
        if goal.body_frame == "head" and abs(goal.position[1]) > 0.01:
            side = "left" if goal.position[1] > 0.0 else "right"
        assert {"left", "right"} & set(goal.name.split()) == {"left", "right"} & {side}
    environments = data_folder() / "models" / "beds_wheelchairs"
    for environment in task.environments:
        assert (environments / f"{environment}.yaml").is_file()


def test_a_task_of_the_users_own(tmp_path):
    path = tmp_path / "wiping.yaml"
    path.write_text(GOOD + "allowed_contacts: [[l_finger, head]]\n")
    task = load_task(path)
    assert (task.name, task.environments) == ("wiping", ("wheelchair",))
    assert task.allowed_contacts == (("l_finger", "head"),)
    assert task.goals[0].weight == 2.0
    assert load_task(str(path)) == task


def test_a_path_may_be_relative(tmp_path, monkeypatch):
    (tmp_path / "wiping.yaml").write_text(GOOD)
    monkeypatch.chdir(tmp_path)
    assert load_task("wiping.yaml") == load_task(f".{os.sep}wiping.yaml")


def test_exponents_are_numbers_with_and_without_a_point(tmp_path):
    path = tmp_path / "wiping.yaml"
    path.write_text(GOOD.replace("[0.1, 0, -0.05]", "[1e-1, +0, -5.0e-2]"))
    assert load_task(path).goals[0].position.tolist() == [0.1, 0.0, -0.05]


def test_grid_changes_are_read(tmp_path):
    path = tmp_path / "wiping.yaml"
    path.write_text(GOOD + "grids: {wheelchair: {base_yaw: {step: 90, count: 4}}}\n")
    assert load_task(path).grid_changes("wheelchair") == {"base_yaw": {"step": 90.0, "count": 4}}


def test_unknown_task_gets_the_nearest_name():
    with pytest.raises(UnknownNameError, match=r"unknown task 'shavign'.*Did you mean 'shaving'\?"):
        load_task("shavign")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("title:", "titel:", "unknown key 'titel'. Known: allowed_contacts"),
        (
            "position:",
            "positoin:",
            "field 'goals[0]': unknown key 'positoin'. Known: alternatives, approach, arm",
        ),
        ("weight: 2", "weigth: 2", "Did you mean 'weight'?"),
        ("position:", "position_mm:", "Did you mean 'position'?"),
        (
            "goals:",
            "grids: {wheelchair: {torso: {cuont: 1}}}\ngoals:",
            "field 'grids.wheelchair.torso': unknown key 'cuont'. Known: count, start, step.",
        ),
        ("goals:", "grids: {bed: {}}\ngoals:", "field 'grids': unknown environment 'bed'"),
    ],
    ids=["top", "goal", "nearest", "unit", "grid", "environment"],
)
def test_unknown_keys_are_refused_with_the_known_ones(refused, old, new, expected):
    assert expected in refused(GOOD.replace(old, new), UnknownNameError)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[1, 0, 0, 0]", "[1, 0.1, 0, 0]", "goals[0]: field 'quaternion_wxyz' has length 1.00499"),
        ("[1, 0, 0, 0]", "[1, 0, 0]", "goals[0]: field 'quaternion_wxyz' is [1.0, 0.0, 0.0]"),
        ("[0.1, 0, -0.05]", "[.nan, 0, 0]", "goals[0]: field 'position' is [nan, 0.0, 0.0]"),
        ("[0.1, 0, -0.05]", "[100, 0, -50]", "at most 2 m away. Write metres."),
        (
            "[0.1, 0, -0.05]",
            "[a, 0, 0]",
            "field 'goals[0].position[0]' is 'a', but must be a valid",
        ),
        ("[0.1, 0, -0.05]", "0.1", "field 'goals[0].position' is 0.1, but must be a valid list"),
        ("weight: 2", "weight: yes", "field 'goals[0].weight' is True, but must be a valid number"),
        (
            "weight: 2",
            "weight: 0",
            "goals[0]: field 'weight' is 0, but a weight must be 1e-06 to 1,000,000.",
        ),
        ("[wheelchair]", "[]", "field 'environments' is empty"),
        ("[wheelchair]", "wheelchair", "field 'environments' is 'wheelchair', but must be a valid"),
        ("source: made up\n", "", "field 'source' is missing."),
        ("goals:", "allowed_contacts: [[a]]\ngoals:", "field 'allowed_contacts[0]' is ['a']"),
        ("goals:", "1: 2\ngoals:", "line 5, column 1: a key must be text"),
        ("goals:", "? [a, b]\n: 2\ngoals:", "line 5, column 3: a key must be text"),
        ("Wiping the mouth", f"[{'9' * 999}]", "field 'title' is [9"),
        (
            "Wiping the mouth",
            "2015-13-01",
            "line 2, column 8: impossible value '2015-13-01': month must be in 1..12.",
        ),
        ("goals:", "name: other\ngoals:", "line 5, column 1: key 'name' appears twice"),
        ("[wheelchair]", "[wheelchair", "is not valid YAML: line "),
        ("name: wiping", "name: !!python/name:os.system", "is not valid YAML: line 1"),
    ],
)
def test_invalid_values_are_refused_with_their_location(refused, old, new, expected):
    assert old in GOOD
    assert expected in refused(GOOD.replace(old, new, 1))


def test_goals_are_needed(refused):
    head = GOOD[: GOOD.index("goals:")]
    assert "needs at least one goal" in refused(head + "goals: []\n")
    assert "field 'goals' is empty." in refused(head)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "must contain keys and values: name, title"),
        ("- a\n- b\n", "must contain keys and values"),
        (b"\xff\xfe\x00", "is not a text file in UTF-8"),
        ("name: a\x00", "is not valid YAML"),
    ],
    ids=["empty", "list", "binary", "control"],
)
def test_files_that_are_something_else(refused, content, expected):
    assert expected in refused(content)


def test_several_mistakes_are_counted(refused):
    text = refused(GOOD.replace("title: Wiping the mouth\nsource: made up\n", ""))
    assert text.endswith("field 'title' is missing. (1 more after this one.)")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(TaskError, match=r"wiping.yaml' cannot be read: No such file"):
        load_task(tmp_path / "wiping.yaml")


def test_a_folder_is_refused(tmp_path):
    with pytest.raises(TaskError, match="cannot be read"):
        load_task(tmp_path)


@pytest.mark.parametrize("name", task_names())
def test_shipped_files_carry_no_key_the_program_ignores(name):
    (path,) = (data_folder() / "tasks").glob(f"*/{name}.yaml")
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert len(content["goals"]) == len(load_task(name).goals)
    assert content["environments"] == list(load_task(name).environments)


def test_straight_motions_of_a_goal_come_from_goal_task_or_default(tmp_path):
    path = tmp_path / "wiping.yaml"
    path.write_text(GOOD)
    (goal,) = load_task(path).goals
    assert (goal.approach.direction, goal.approach.distance) == ((1.0, 0.0, 0.0), 0.1)
    assert goal.retreat == goal.approach.reverse()
    path.write_text(GOOD + "approach: {direction: [0, 0, 2], distance: 0.2}\n")
    (goal,) = load_task(path).goals
    np.testing.assert_array_equal(goal.approach.offset, [0, 0, 0.2])
    np.testing.assert_array_equal(goal.retreat.offset, [0, 0, -0.2])
    own = GOOD + "    retreat: {direction: [0, 1, 0], distance: 0.05}\n"
    path.write_text(own + "approach: {direction: [0, 0, 2], distance: 0.2}\n")
    (goal,) = load_task(path).goals
    assert goal.approach.direction == (0.0, 0.0, 1.0)
    assert goal.retreat.direction == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{direction: [1, 0, 0], distance: 0.0}", "approach.*distance.*0 m, but must be above 0"),
        ("{direction: [0, 0, 0], distance: 0.1}", "approach.*direction.*length 0"),
        ("{direction: [1, 0], distance: 0.1}", r"approach.direction.*must be \[x, y, z\]"),
        ("{direction: [1, 0, 0], distance: 3.0}", "distance.*at most 1 m"),
    ],
)
def test_straight_motions_out_of_range_are_refused(refused, line, message):
    assert re.search(message, refused(GOOD + f"approach: {line}\n"))
