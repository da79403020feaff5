import dataclasses

import numpy as np
import pytest

from tcs.errors import RobotError, SelectionError, StoreError, UnknownNameError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.robots import arm_references
from tcs.placement.constraints import Constraints, Obstacle
from tcs.placement.reasons import explain
from tcs.placement.robustness import Trials
from tcs.placement.scoring import rebuild_scene, score, verify
from tcs.placement.scoring.verify import check_pairs
from tcs.placement.selection import SelectionTables, select
from tcs.placement.selection.admission import admitted_candidates
from tcs.placement.store import (
    ARMS,
    file_of_arm,
    files_of_arms,
    load_scores,
    save_scores,
)
from tcs.placement.store.frame import score_frame
from tests.environments import CORNER, write_environment

ARRAYS = ("dexterity", "reason", "arm_joints", "weights")


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("arms"), "corner", CORNER)


@pytest.fixture(scope="module")
def singles(corner):
    """The file of each arm, scored by itself."""
    return {
        "left": score("shaving", corner, "pr2", approach=False),
        "right": score("shaving", corner, "pr2", arms="right", approach=False),
    }


@pytest.fixture(scope="module")
def both(corner, tmp_path_factory):
    """The file of both arms, as it is read from disk."""
    path = tmp_path_factory.mktemp("both") / "both.tcs"
    save_scores(path, score("shaving", corner, "pr2", arms="both", approach=False))
    return load_scores(path)


def names_of(scores):
    return [scores.pair_names[i] if i >= 0 else None for i in scores.pair.ravel()]


@pytest.mark.parametrize("arm", ["left", "right"])
def test_one_arm_of_a_file_is_the_file_of_that_arm(both, singles, arm):
    part, single = file_of_arm(both, arm), singles[arm]
    ours, theirs = part.nominal.scores, single.nominal.scores
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    assert names_of(ours) == names_of(theirs)
    assert (part.grid, part.robot) == (single.grid, single.robot)
    for key in ("robot", "scene_digest", "robot_shapes", "ik", "self_contact", "measure"):
        assert part.metadata[key] == single.metadata[key]
    for name in ("candidates", "reached", "dexterity", "cell", "cell_xy", "best_single"):
        np.testing.assert_array_equal(
            getattr(part.nominal.sets, name), getattr(single.nominal.sets, name)
        )
    assert rebuild_scene(part)[0].spec.robot.name == {"left": "pr2", "right": "pr2_right"}[arm]


def test_a_file_of_one_arm_is_unchanged_on_disk(singles):
    left = singles["left"]
    assert "arms" not in left.metadata
    assert list(left.grid) == ["axes"]
    assert files_of_arms(left) == (left,)


def test_sets_of_both_arms_are_at_least_as_good(both, singles):
    best = sum(both.nominal.sets.scores_of(both.nominal.sets.best))
    for single in singles.values():
        assert best >= sum(single.nominal.sets.scores_of(single.nominal.sets.best))
    size = Grid.from_dict(both.grid).arm_size
    pairs = both.nominal.sets.kept_pairs
    # Pairs of one arm are fewer: there are some with a member of each arm.
    assert pairs > max(single.nominal.sets.kept_pairs for single in singles.values())
    assert len(both.nominal.scores.reason) == 2 * size


def test_drake_confirms_a_set_with_both_arms(both):
    grid, scores = Grid.from_dict(both.grid), both.nominal.scores
    left = int(np.argmax(scores.reached[: grid.arm_size].sum(axis=1)))
    right = grid.arm_size + int(np.argmax(scores.reached[grid.arm_size :].sum(axis=1)))
    assert [grid.configuration(h).arm for h in (left, right)] == ["left", "right"]
    pairs = [(h, int(g)) for h in (left, right) for g in np.flatnonzero(scores.reached[h])]
    assert {h for h, _ in pairs} == {left, right}
    assert all(finding.is_true for finding in check_pairs(both, 0, pairs))


def test_verification_covers_both_arms(both, singles):
    found = verify(both, pairs=40, dense=2, jobs=1)
    assert found.is_sound
    assert found.checked == 40
    wrong = dataclasses.replace(both, metadata={**both.metadata, ARMS: dict(both.metadata[ARMS])})
    entries = wrong.metadata[ARMS]
    entries["left"] = {**entries["left"], "robot": "pr2_right"}
    with pytest.raises(StoreError, match="other models"):
        verify(wrong, pairs=1, dense=0)


def test_members_of_a_choice_name_their_arm(both):
    here = InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.1, torso=0.0)
    choice = select(both, here)
    members = choice.to_json("isotropy")["members"]
    assert {member["arm"] for member in members} <= {"left", "right"}
    assert all(repr(m).endswith(f"arm='{m.arm}')") for m in choice.members)
    with pytest.raises(SelectionError, match="one arm, but the score file is of left and right"):
        rebuild_scene(both)
    frame = score_frame(both)
    assert set(frame["arm"]) == {"left", "right"}


def test_trials_take_the_arm_of_each_member(both, singles):
    grid = Grid.from_dict(both.grid)
    scores = both.nominal.scores
    of_each = [np.flatnonzero(scores.reached[rows].any(axis=1))[:2] for rows in _halves(grid)]
    trials, rng = Trials.of(both), np.random.default_rng(0)
    members = np.concatenate([of_each[0], of_each[1] + grid.arm_size])
    exact = trials.reached(members, {"person_x": np.zeros(2)})
    np.testing.assert_array_equal(exact[:, 0], scores.reached[members])
    offsets = {name: rng.normal(0.0, 0.05, 20) for name in ("person_x", "person_y")}
    found = np.split(trials.reached(members, offsets), 2)
    for single, part, h in zip(singles.values(), found, of_each, strict=True):
        np.testing.assert_array_equal(part, Trials.of(single).reached(h, offsets))


def test_obstacles_block_the_solutions_of_each_arm(both, singles):
    constraints = Constraints(blocked=(Obstacle.parse("0.75 -0.45 0.2 0.2 0 0.9 1.2"),))
    here = InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.1, torso=0.0)
    found = admitted_candidates(constraints, here, SelectionTables.of(both))
    parts = [
        admitted_candidates(constraints, here, SelectionTables.of(single))
        for single in singles.values()
    ]
    for name in ("candidates", "reached", "dexterity"):
        together = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(getattr(found, name), together)
    assert not np.array_equal(found.reached, both.nominal.sets.reached)


def _halves(grid):
    return slice(0, grid.arm_size), slice(grid.arm_size, grid.size)


def test_explanation_takes_the_arm_into_account(both):
    grid, scores = Grid.from_dict(both.grid), both.nominal.scores
    one, other = scores.reached[: grid.arm_size], scores.reached[grid.arm_size :]
    h, goal = (int(i) for i in np.argwhere(other & ~one)[0])
    stated = dataclasses.replace(grid.configuration(h), arm=None)
    # From the same base pose the right arm reaches it, so that is the arm explained.
    assert explain(both, goal, stated).explained.index == h + grid.arm_size
    by_left = explain(both, goal, dataclasses.replace(stated, arm="left"))
    assert not by_left.explained.is_reached
    assert by_left.fix.sentence == "Use the right arm."
    assert by_left.fix.cost == pytest.approx(0.0, abs=1e-9)


def test_arms_are_those_of_the_robot_file():
    assert arm_references("pr2_right", "both") == {"left": "pr2", "right": "pr2_right"}
    assert arm_references("pr2_right", "left") == {"left": "pr2"}
    with pytest.raises(UnknownNameError, match=r"arm 'lefft'.*Did you mean 'left'"):
        arm_references("pr2", "lefft")
    with pytest.raises(RobotError, match="robot 'iiwa7' names no arms"):
        arm_references("iiwa7", "both")


def test_a_robot_that_is_not_among_its_arms_is_refused(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("based_on: pr2\nname: mine\ntitle: mine\n")
    with pytest.raises(RobotError, match="must name 'mine' itself once"):
        arm_references(path, "both")
    path.write_text(path.read_text() + "arms: {left: ./mine.yaml, right: pr2_right}\n")
    assert list(arm_references(path, "both")) == ["left", "right"]
