import dataclasses

import numpy as np
import pytest
import yaml

from tcs.errors import RobotError, StoreError, TaskError, UnknownNameError
from tcs.model.grid import InitialConfiguration
from tcs.model.tasks import load_task
from tcs.output.words import goal_names
from tcs.placement.constraints import Constraints, Obstacle
from tcs.placement.reasons import explain
from tcs.placement.refinement.points import PointScorer
from tcs.placement.robustness import Trials
from tcs.placement.scoring import load_job, rebuild_scenes, score, summary, verify
from tcs.placement.selection import SelectionTables, select
from tcs.placement.selection.admission import admitted_candidates
from tcs.placement.store import HANDS, load_scores, save_scores
from tcs.placement.tables import Reason
from tests.environments import CORNER, write_environment

HALF = 0.7071067811865476
BESIDE_LEFT = {
    "body_frame": "head",
    "position": [0.14, 0.12, -0.03],
    "quaternion_wxyz": [HALF, 0.0, 0.0, -HALF],
}
BEFORE = {
    "body_frame": "head",
    "position": [0.17, 0.0, -0.05],
    "quaternion_wxyz": [0.0, 0.0, 0.0, 1.0],
}
GOALS = [
    {"name": "cheek", "arm": "left", "tool": "blade", **BESIDE_LEFT},
    {"name": "mouth", "arm": "right", "tool": "spoon", **BEFORE},
    {"name": "chin", **BEFORE},
    {"name": "lips", "arm": "right", "tool": "spoon", "weight": 2.0, **BEFORE},
]
HERE = InitialConfiguration(base_x=1.15, base_y=-0.7, base_yaw=3.1, torso=0.15)


def write_task(folder, goals, **more):
    path = folder / "hands.yaml"
    content = {"name": "hands", "title": "Hands", "source": "made up"}
    content |= {"environments": ["wheelchair"], "tools": {"blade": "razor"}, "goals": goals}
    path.write_text(yaml.safe_dump({**content, **more}))
    return path


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("hands"), "corner", CORNER)


@pytest.fixture(scope="module")
def hands(corner, tmp_path_factory):
    """The scores of goals of three hands, as they are read from disk."""
    folder = tmp_path_factory.mktemp("of_hands")
    save_scores(
        folder / "hands.tcs", score(write_task(folder, GOALS), corner, "pr2", approach=False)
    )
    return load_scores(folder / "hands.tcs")


@pytest.mark.parametrize(
    ("robot", "goals"), [("pr2+razor", [0]), ("pr2_right+spoon", [1, 3]), ("pr2", [2])]
)
def test_goals_have_the_scores_of_their_hand(hands, corner, tmp_path, robot, goals):
    bare = [{k: v for k, v in GOALS[g].items() if k not in ("arm", "tool")} for g in goals]
    alone = score(write_task(tmp_path, bare), corner, robot, approach=False).nominal.scores
    scores = hands.nominal.scores
    assert np.count_nonzero(alone.reached)
    np.testing.assert_array_equal(scores.reason[:, goals], alone.reason)
    np.testing.assert_array_equal(scores.dexterity[:, goals], alone.dexterity)
    for h, i in np.argwhere(alone.reached).tolist():
        np.testing.assert_array_equal(scores.joints_of(h, goals[i]), alone.joints_of(h, i))
    for mine, other in zip(scores.pair[:, goals].ravel(), alone.pair.ravel(), strict=True):
        names = scores.pair_names[mine] if mine >= 0 else None
        assert names == (alone.pair_names[other] if other >= 0 else None)


def test_drake_judges_each_goal_with_its_hand(hands):
    found = verify(hands, pairs=100, dense=4, jobs=1)
    assert found.is_sound
    assert found.checked == np.count_nonzero(hands.nominal.scores.reached)
    entries = [dict(entry) for entry in hands.hands]
    entries[0]["goals"], entries[2]["goals"] = entries[2]["goals"], entries[0]["goals"]
    swapped = dataclasses.replace(hands, metadata={**hands.metadata, HANDS: entries})
    with pytest.raises(StoreError, match="other hands"):
        verify(swapped, pairs=1, dense=0)


def test_answers_name_the_hand(hands):
    names = goal_names(hands.task, 4)
    assert names[:3] == ("cheek [left arm with blade]", "mouth [right arm with spoon]", "chin")
    assert summary(hands)["hands"] == [
        {"arm": "left", "tool": "blade", "goals": [0]},
        {"arm": "right", "tool": "spoon", "goals": [1, 3]},
        {"arm": "", "tool": "", "goals": [2]},
    ]
    assert hands.robot["name"] == "pr2"
    choice = select(hands, HERE)
    assert choice.reachability > 0.0
    found = explain(hands, 1, HERE)
    reached = np.count_nonzero(hands.nominal.scores.reason[:, 1] == Reason.REACHED)
    assert found.distribution.reasons[Reason.REACHED] == reached


def test_obstacles_block_the_solutions_of_each_hand(hands, corner, tmp_path):
    with pytest.raises(TaskError, match="of 3: left arm with blade; right arm with spoon; bare"):
        load_job(write_task(tmp_path, GOALS), corner, "pr2")
    sets = hands.nominal.sets
    box = Obstacle.parse("0.75 -0.45 0.2 0.2 0 0.9 1.2")
    constraints, tables = Constraints(blocked=(box,)), SelectionTables.of(hands)
    found = admitted_candidates(constraints, HERE, tables, tables.index)
    assert not np.array_equal(found.reached, sets.reached)
    for numbers in hands.goals_of_hands:
        goals = [{k: v for k, v in GOALS[g].items()} for g in numbers]
        alone = score(write_task(tmp_path, goals), corner, "pr2", approach=False)
        tables = SelectionTables.of(alone)
        of_hand = admitted_candidates(constraints, HERE, tables, tables.index)
        rows = np.searchsorted(sets.candidates, alone.nominal.sets.candidates)
        np.testing.assert_array_equal(found.reached[np.ix_(rows, numbers)], of_hand.reached)


def test_goals_without_an_arm_are_reached_by_any(corner, tmp_path):
    task = write_task(tmp_path, GOALS)
    named, any_arm = (
        score(task, corner, "pr2", arms=arms, approach=False) for arms in (None, "both")
    )
    assert any_arm.hand_names == ("left+blade", "right+spoon", "left", "right")
    ours, theirs = any_arm.nominal.scores, named.nominal.scores
    np.testing.assert_array_equal(ours.reached[:, [0, 1, 3]], theirs.reached[:, [0, 1, 3]])
    assert np.all(ours.reached[:, 2] >= theirs.reached[:, 2])
    assert np.count_nonzero(ours.reached[:, 2]) > np.count_nonzero(theirs.reached[:, 2])


def test_every_consumer_takes_several_hands(hands):
    points = PointScorer.of(hands, 0)
    grid, scores = hands.configurations, hands.nominal.scores
    at = grid.values(np.arange(grid.size))
    found = points.score(np.stack([at[axis.name] for axis in grid.axes], axis=1))
    np.testing.assert_array_equal(found.reached, scores.reached)
    np.testing.assert_array_equal(found.hand[found.reached], scores.hand[found.reached])
    members = hands.nominal.sets.candidates
    reached = Trials.of(hands).reached(members, {"person_x": np.zeros(1)})
    np.testing.assert_array_equal(reached[:, 0], scores.reached[members])


def test_goals_of_one_hand_are_scored_as_with_that_robot(corner, tmp_path):
    task = write_task(tmp_path, [{**BEFORE, "tool": "spoon", "arm": "right"}])
    file = score(task, corner, "pr2", approach=False)
    assert not file.hands
    assert file.robot["name"] == "pr2_right+spoon"
    assert file.metadata["robot"] == "pr2"
    job, *_ = rebuild_scenes(file)[0]
    assert job.spec.robot.tool_frame == "spoon_tip"
    assert len(rebuild_scenes(file)) == 1
    assert score(task, corner, "pr2", arms="both", approach=False).robot == file.robot


def test_contact_is_allowed_to_the_tool_that_a_goal_needs(corner, tmp_path):
    contacts = [["razor", "person::head_center"]]
    task = write_task(tmp_path, GOALS, allowed_contacts=contacts)
    allowed = score(task, corner, "pr2", approach=False)
    assert allowed.task["allowed_contacts"] == contacts
    with pytest.raises(UnknownNameError, match="unknown robot body 'rasor'"):
        score(write_task(tmp_path, GOALS, allowed_contacts=[["rasor", contacts[0][1]]]), corner)


BAD = [
    (
        {"tool": "rasor"},
        UnknownNameError,
        r"goals\[0\]: unknown tool 'rasor'.*Did you mean 'razor'",
    ),
    ({"arm": "third"}, UnknownNameError, r"goals\[0\], robot 'pr2': unknown arm 'third'"),
]


@pytest.mark.parametrize(("fields", "error", "message"), BAD)
def test_an_unknown_hand_is_refused_in_one_line(corner, tmp_path, fields, error, message):
    with pytest.raises(error, match=message) as caught:
        score(write_task(tmp_path, [{**BEFORE, **fields}]), corner, "pr2")
    assert "\n" not in str(caught.value)


def test_an_arm_of_a_robot_with_one_is_refused_in_one_line(corner, tmp_path):
    task = write_task(tmp_path, [{**BEFORE, "arm": "left"}])
    with pytest.raises(RobotError, match=r"names the arm 'left', but robot 'iiwa7' names no arms"):
        score(task, corner, "iiwa7")


def test_a_tool_file_is_found_beside_the_task(tmp_path):
    path = write_task(tmp_path, [{**BEFORE, "tool": "own"}], tools={"own": "own.yaml"})
    assert load_task(path).tools == {"own": str(tmp_path / "own.yaml")}


def test_hands_of_a_file_are_checked(hands):
    entries = [dict(entry) for entry in hands.hands]
    entries[1]["goals"] = [1]
    with pytest.raises(StoreError, match="must give every goal to hands"):
        dataclasses.replace(hands, metadata={**hands.metadata, HANDS: entries})
