import dataclasses

import numpy as np
import pytest

import tcs
from tcs.errors import ArmClassError, RobotError, TaskError, UnknownNameError
from tcs.model.tasks import load_task, partners
from tcs.output.report.score.pictures import scene_figure
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.words import goal_names
from tcs.placement.reasons import explain
from tcs.placement.refinement.points import PointScorer
from tcs.placement.robustness import Trials
from tcs.placement.scoring import score, verify
from tcs.placement.scoring.file_checker import FileChecker, Posture
from tcs.placement.store import load_scores, save_scores
from tcs.placement.tables import Reason, RefinedTable
from tests.environments import write_environment
from tests.two_arms import GRID, PAIR, write_pair

ALONE = [{**{k: v for k, v in g.items() if k != "together_with"}, "arm": g["arm"]} for g in PAIR]


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("pair"), "beside", GRID)


@pytest.fixture(scope="module")
def pair(beside, tmp_path_factory):
    """The scores of a pair of goals, as they are read from disk."""
    folder = tmp_path_factory.mktemp("of_pair")
    save_scores(folder / "pair.tcs", score(write_pair(folder, PAIR), beside, "pr2"))
    return load_scores(folder / "pair.tcs")


def test_both_goals_are_reached_or_neither(pair):
    scores = pair.nominal.scores
    hold, wipe = scores.reached.T
    np.testing.assert_array_equal(hold, wipe)
    np.testing.assert_array_equal(scores.dexterity[:, 0], scores.dexterity[:, 1])
    assert 2 < np.count_nonzero(hold) < hold.size
    reasons = {Reason(one) for one in scores.reason.ravel()}
    assert {Reason.ARMS_BLOCKED, Reason.OTHER_GOAL_UNREACHED} <= reasons
    for h in np.flatnonzero(scores.reason[:, 0] == Reason.ARMS_BLOCKED):
        assert scores.reason[h, 1] == Reason.ARMS_BLOCKED
        left, right = scores.pair_names[scores.pair[h, 0]]
        assert (left[:2], right[:2]) == ("l_", "r_")
        assert scores.pair_names[scores.pair[h, 1]] == (right, left)


def test_approaches_of_two_arms_at_once_are_refused(pair, beside, tmp_path):
    assert "reached by two" in pair.metadata["no_approach"]
    with pytest.raises(ArmClassError, match="reached by two"):
        score(write_pair(tmp_path, PAIR), beside, "pr2", approach=True)


def test_drake_judges_both_arms_at_once(pair):
    found = verify(pair, pairs=100, dense=6, jobs=1)
    assert found.is_sound
    assert found.checked == np.count_nonzero(pair.nominal.scores.reached)
    assert found.missed == 0
    assert [one.reason for one in found.strata][-2:] == [
        Reason.OTHER_GOAL_UNREACHED,
        Reason.ARMS_BLOCKED,
    ]


def test_drake_refuses_arms_that_touch(pair):
    """Both arms stay at their goals, but that of another base pose gets the joints of this one."""
    checker = FileChecker.of(pair, jobs=1)
    h = int(np.flatnonzero(pair.nominal.scores.reached[:, 0])[0])
    value, q, other = checker.dexterity(h, 0), checker.joints(h, 0), checker.joints(h, 1)
    assert checker.check(h, 0, Posture(0, value, q, other)).is_true
    # The right forearm swings into the left one.
    swung = other + np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    finding = checker.check(h, 0, Posture(0, value, q, swung))
    assert not finding.is_true
    # Each arm meets the other where that is now, not where it is parked.
    contacts = 0
    for goal, joints, of_other in ((0, q, swung), (1, swung, q)):
        hand = checker.hand(h, goal)
        checker.drakes[hand].pose_other_arm(of_other)
        number = checker.goals[hand].index(goal)
        contacts += (
            checker.drakes[hand]
            .check_at(checker.drakes[hand].values(h), number, joints, value)
            .contacts
        )
    assert finding.contacts == contacts > 0
    assert not checker.check(h, 0, Posture(0, value + 0.01, q, other)).dexterity_error < 0.009


def test_both_arms_of_a_refined_set_are_judged_at_once(pair):
    scores = pair.nominal.scores
    h = int(np.flatnonzero(scores.reached[:, 0])[0])
    at = pair.configurations.values([h])
    q = np.stack([scores.joints_of(h, goal) for goal in (0, 1)])[None, None]
    for turned in (0.0, 1.2):
        swung = q.copy()
        swung[..., 1, 0] += np.float32(turned)
        refined = RefinedTable(
            origin=np.array([[h]], np.int32),
            values=np.stack([at[axis.name] for axis in pair.configurations.axes], axis=1)[None],
            reached=scores.reached[None, None, h],
            dexterity=scores.dexterity[None, None, h],
            arm_joints=swung,
            objective=np.zeros(1),
            weights=scores.weights,
            hand=scores.hand[None, None, h],
        )
        tables = (dataclasses.replace(pair.nominal, refined=refined),)
        checker = FileChecker.of(dataclasses.replace(pair, tables=tables), jobs=1)
        found = checker.refined(checker.refined_pairs(), lambda: None)
        assert [finding.is_true for finding in found] == [not turned] * 2


def test_both_arms_are_checked_against_each_other_off_the_grid_and_under_error(pair):
    grid, scores = pair.configurations, pair.nominal.scores
    at = grid.values(np.arange(grid.size))
    found = PointScorer.of(pair, 0).score(np.stack([at[axis.name] for axis in grid.axes], axis=1))
    np.testing.assert_array_equal(found.reached, scores.reached)
    np.testing.assert_array_equal(found.dexterity, scores.dexterity)
    members = np.flatnonzero((scores.reason != Reason.BODY_BLOCKED).all(axis=1))
    reached = Trials.of(pair).reached(members, {"person_x": np.zeros(1)})
    np.testing.assert_array_equal(reached[:, 0], scores.reached[members])
    assert np.any(scores.reason[members] == Reason.OTHER_GOAL_UNREACHED)


def test_motions_of_two_arms_at_once_are_refused(pair):
    with pytest.raises(TaskError, match=r"one arm moves at a time\. Leave 'together_with' out"):
        tcs.plan(pair, [int(pair.nominal.sets.candidates[0])])


def test_names_and_sides_of_a_pair_do_not_matter(pair, beside, tmp_path):
    on_the_other = [{**PAIR[1], "together_with": "hold"}, ALONE[0]]
    other = score(write_pair(tmp_path, on_the_other), beside, "pr2").nominal.scores
    ours = pair.nominal.scores
    np.testing.assert_array_equal(ours.reason, other.reason[:, ::-1])
    np.testing.assert_array_equal(ours.dexterity, other.dexterity[:, ::-1])


def test_each_arm_reaches_more_alone(pair, beside, tmp_path):
    # Alone, the other arm is tucked in: it may be in the way there and not at its goal.
    alone = score(write_pair(tmp_path, ALONE), beside, "pr2").nominal.scores
    assert np.count_nonzero(alone.reached) > np.count_nonzero(pair.nominal.scores.reached)


def test_answers_tell_the_pair(pair):
    assert goal_names(pair.task, 2) == ("hold [left arm]", "wipe [right arm]")
    h = int(np.flatnonzero(pair.nominal.scores.reason[:, 0] == Reason.ARMS_BLOCKED)[0])
    explained = explain(pair, 0, h).explained
    assert explained.reason is Reason.ARMS_BLOCKED
    assert explained.pair is not None
    best = pair.nominal.sets.best
    members = tuple(pair.configurations.configuration(i) for i in best)
    shown = ShownSet(None, members, best, 0, "", pair)
    caption = scene_figure(pair, shown).axes[0].get_title()
    assert "arms at goals hold [left arm] (1), wipe [right arm] (2)" in " ".join(caption.split())


BAD = [
    ([PAIR[0]], UnknownNameError, r"goals\[0\], field 'together_with': unknown goal 'wipe'"),
    ([PAIR[0], {**PAIR[1], "arm": "left"}], TaskError, "the two goals name left and left"),
    ([PAIR[0], {**PAIR[1], "arm": ""}], TaskError, "the two goals name left and no arm"),
    ([PAIR[0], PAIR[1], PAIR[1]], TaskError, "2 goals are called 'wipe'"),
    (
        [PAIR[0], PAIR[1], {**PAIR[0], "name": "again"}],
        TaskError,
        r"goals\[2\], field 'together_with': .* in another pair already",
    ),
]


@pytest.mark.parametrize(("goals", "error", "message"), BAD, ids=range(len(BAD)))
def test_a_pair_that_is_none_is_refused_in_one_line(tmp_path, goals, error, message):
    with pytest.raises(error, match=message) as caught:
        load_task(write_pair(tmp_path, goals))
    assert "\n" not in str(caught.value)


def test_two_arms_of_a_robot_with_one_are_refused(beside, tmp_path):
    with pytest.raises(RobotError, match="names the arm 'left', but robot 'iiwa7' names no arms"):
        score(write_pair(tmp_path, PAIR), beside, "iiwa7")


def test_partners_are_found_from_either_goal(tmp_path):
    goals = load_task(write_pair(tmp_path, PAIR)).goals
    assert partners(goals) == (1, 0)
    named = dataclasses.replace(goals[1], together_with="hold")
    assert partners((goals[0], named)) == (1, 0)
