"""Goals that any arm of a robot may reach: each is reached by the arm that reaches it best."""

import dataclasses

import numpy as np
import pytest

import tcs
from tcs.errors import RobotError, StoreError, UnknownNameError
from tcs.kernel.scores import NEARNESS
from tcs.model.grid import InitialConfiguration
from tcs.model.robots import arm_references
from tcs.placement.constraints import Constraints, Obstacle
from tcs.placement.reasons import explain
from tcs.placement.refinement.by_arm import explained_by_arm
from tcs.placement.robustness import Trials
from tcs.placement.scoring import LiveScorer, score, verify
from tcs.placement.scoring.hands import serving_hands
from tcs.placement.scoring.verify import check_pairs
from tcs.placement.selection import SelectionTables, select
from tcs.placement.selection.admission import admitted_candidates
from tcs.placement.store import HANDS, load_scores, save_scores
from tcs.placement.store.frame import score_frame
from tcs.placement.tables import Reason
from tests.environments import CORNER, write_environment

HERE = InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.1, torso=0.0)


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("arms"), "corner", CORNER)


@pytest.fixture(scope="module")
def singles(corner):
    """The file of each arm, scored by itself."""
    return [score("shaving", corner, "pr2", arms=arm, paper=True) for arm in ("left", "right")]


@pytest.fixture(scope="module")
def both(corner, tmp_path_factory):
    """The file of both arms, as it is read from disk."""
    path = tmp_path_factory.mktemp("both") / "both.tcs"
    save_scores(path, score("shaving", corner, "pr2", arms="both", paper=True))
    return load_scores(path)


def test_each_goal_is_reached_by_the_arm_that_reaches_it_best(both, singles):
    scores = both.nominal.scores
    tables = [single.nominal.scores for single in singles]
    dexterity = np.array([table.dexterity for table in tables])
    np.testing.assert_array_equal(scores.reached, np.any([t.reached for t in tables], axis=0))
    np.testing.assert_array_equal(scores.dexterity, dexterity.max(axis=0))
    used = set()
    for h, g in np.argwhere(scores.reached).tolist():
        hand = int(scores.hand[h, g])
        used.add(hand)
        assert scores.dexterity[h, g] == tables[hand].dexterity[h, g]
        np.testing.assert_array_equal(scores.joints_of(h, g), tables[hand].joints_of(h, g))
    assert used == {0, 1}
    for h, g in np.argwhere(~scores.reached).tolist():
        reasons = [int(table.reason[h, g]) for table in tables]
        assert NEARNESS[scores.reason[h, g]] == max(NEARNESS[reasons])


def test_ties_go_to_the_first_hand_and_reached_goes_before_near():
    far, near = np.full((1, 2), Reason.TOO_FAR, np.uint8), np.full((1, 2), 0, np.uint8)
    zero, some = np.zeros((1, 2), np.float32), np.full((1, 2), 0.5, np.float32)
    every = [(0, 1), (0, 1)]
    assert serving_hands([far, near], [zero, zero], every).tolist() == [[1, 1]]
    assert serving_hands([near, near], [some, some], every).tolist() == [[0, 0]]
    assert serving_hands([near, near], [zero, some], every).tolist() == [[1, 1]]
    only = serving_hands([far[:, :1], near[:, :1]], [zero[:, :1], some[:, :1]], [(1,), (0,)])
    assert only.tolist() == [[1, 0]]


def test_a_file_of_one_arm_has_no_hands(singles):
    for single in singles:
        assert "arms" not in single.metadata
        assert single.hands == ()
        assert single.nominal.scores.hand is None


def test_a_configuration_may_use_both_arms(both, singles):
    sets = both.nominal.sets
    assert len(sets.candidates) <= both.configurations.size
    best = sum(sets.scores_of(sets.best_single))
    for single in singles:
        alone = single.nominal.sets
        assert best >= sum(alone.scores_of(alone.best_single))
    mixed = [len(set(row[row > 0].tolist())) for row in sets.served]
    assert max(mixed) == 2


def test_drake_confirms_a_configuration_that_uses_both_arms(both):
    scores, served = both.nominal.scores, both.nominal.sets.served
    row = int(np.argmax((served == 1).any(axis=1) & (served == 2).any(axis=1)))
    h = int(both.nominal.sets.candidates[row])
    pairs = [(h, int(g)) for g in np.flatnonzero(scores.reached[h])]
    assert {int(scores.hand[pair]) for pair in pairs} == {0, 1}
    assert all(finding.is_true for finding in check_pairs(both, 0, pairs))


def test_verification_covers_both_arms(both):
    found = verify(both, pairs=40, dense=2, jobs=1)
    assert found.is_sound
    assert (found.checked, found.missed) == (40, 0)
    hand = both.nominal.scores.hand
    swapped = dataclasses.replace(both.nominal.scores, hand=1 - hand)
    sets = dataclasses.replace(both.nominal.sets, hand=1 - both.nominal.sets.hand)
    tables = dataclasses.replace(both.nominal, sets=sets, read_scores=lambda: swapped)
    assert not verify(dataclasses.replace(both, tables=(tables,)), pairs=10, dense=0).is_sound
    entries = [{**entry} for entry in both.hands]
    entries[0]["scene_digest"] = "0" * 64
    wrong = dataclasses.replace(both, metadata={**both.metadata, HANDS: entries})
    with pytest.raises(StoreError, match="other models"):
        verify(wrong, pairs=1, dense=0)


def test_members_of_a_choice_name_the_hand_of_each_goal(both):
    choice = select(both, HERE)
    for member, h in zip(
        choice.to_json("isotropy")["members"],
        (choice.indices[i] for i in choice.order),
        strict=True,
    ):
        scores = both.nominal.scores
        names = [both.hand_names[hand] for hand in scores.hand[h]]
        expected = [n if ok else None for n, ok in zip(names, scores.reached[h], strict=True)]
        assert member["hand"] == expected
    frame = score_frame(both)
    assert set(frame["hand_0"].dropna()) <= {"left", "right"}


def test_trials_and_motions_take_the_hand_of_each_goal(both, singles):
    scores = both.nominal.scores
    members = np.flatnonzero(scores.reached.any(axis=1))[:4]
    trials, rng = Trials.of(both), np.random.default_rng(0)
    exact = trials.reached(members, {"person_x": np.zeros(2)})
    np.testing.assert_array_equal(exact[:, 0], scores.reached[members])
    offsets = {name: rng.normal(0.0, 0.05, 20) for name in ("person_x", "person_y")}
    alone = [Trials.of(single).reached(members, offsets) for single in singles]
    np.testing.assert_array_equal(trials.reached(members, offsets), alone[0] | alone[1])


def test_obstacles_block_the_solutions_of_each_arm(both):
    constraints = Constraints(blocked=(Obstacle.parse("0.75 -0.45 0.2 0.2 0 0.9 1.2"),))
    tables = SelectionTables.of(both)
    found = admitted_candidates(constraints, HERE, tables, tables.index)
    lost = both.nominal.sets.reached & ~found.reached
    assert {1, 2} == set(both.nominal.sets.served[lost].tolist())
    assert found.reached.any()


def test_an_observed_environment_is_scored_with_both_arms(both, corner):
    live = LiveScorer("shaving", corner, arms="both", paper=True).score()
    for name in ("reason", "dexterity", "hand"):
        np.testing.assert_array_equal(
            getattr(live.nominal.scores, name), getattr(both.nominal.scores, name)
        )


def test_an_explanation_may_ask_for_one_arm(both, singles):
    reached = [single.nominal.scores.reached for single in singles]
    h, goal = (int(i) for i in np.argwhere(reached[1] & ~reached[0])[0])
    found = explain(both, goal, h)
    assert found.explained.is_reached
    assert found.to_json()["explained"]["hand"] == "right"
    by_left = explained_by_arm(found, "left")
    table = singles[0].nominal.scores
    assert by_left.explained.reason == Reason(table.reason[h, goal])
    assert by_left.explained.pair == (
        table.pair_names[table.pair[h, goal]] if table.pair[h, goal] >= 0 else None
    )
    assert by_left.fix.sentence == "Use the right arm."
    with pytest.raises(UnknownNameError, match="unknown arm 'middle'"):
        explained_by_arm(found, "middle")


def test_a_file_with_one_arm_for_each_configuration_is_refused_in_one_line(both):
    with pytest.raises(StoreError, match="of an earlier version") as caught:
        dataclasses.replace(both, metadata={**both.metadata, "arms": {"left": {}}})
    assert "\n" not in str(caught.value)


def test_refinement_keeps_the_hand_of_each_goal(both):
    refined = tcs.refine(both, starts=2, rounds=2, seed=1, jobs=1)
    table = refined.nominal.refined
    assert table.hand.shape == table.reached.shape
    found = verify(refined, pairs=5, dense=0, jobs=1)
    assert found.refined_checked > 0
    assert found.is_sound


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
