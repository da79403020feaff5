import dataclasses

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.placement.tables import Reason, ScoreTable


def parts():
    """Two configurations, two goals, three reached pairs."""
    return {
        "dexterity": np.array([[0.5, 0.25], [0.0, 0.75]], dtype=np.float32),
        "reason": np.array([[0, 0], [6, 0]], dtype=np.uint8),
        "pair": np.array([[-1, -1], [0, -1]], dtype=np.int32),
        "pair_names": (("forearm", "headrest"),),
        "arm_joints": np.arange(21, dtype=np.float32).reshape(3, 7),
        "weights": np.array([0.25, 0.75]),
    }


def test_scores_follow_the_equations():
    scores = ScoreTable(**parts())
    np.testing.assert_array_equal(scores.reachability(), [1.0, 0.75])
    np.testing.assert_array_equal(scores.manipulability(), [0.3125, 0.5625])
    assert (scores.configurations, scores.goals) == (2, 2)


def test_reasons_are_counted_by_name():
    assert ScoreTable(**parts()).reason_counts() == {
        "reached": 3,
        "too_far": 0,
        "joint_limits": 0,
        "body_blocked": 0,
        "gripper_blocked_by_environment": 0,
        "gripper_blocked_by_robot": 0,
        "arm_blocked": 1,
        "excluded": 0,
        "approach_limits": 0,
        "approach_blocked": 0,
        "other_goal_unreached": 0,
        "arms_blocked": 0,
    }


def test_joints_are_found_by_pair():
    scores = ScoreTable(**parts())
    np.testing.assert_array_equal(scores.joints_of(0, 1), np.arange(7, 14))
    np.testing.assert_array_equal(scores.joints_of(1, 1), np.arange(14, 21))
    assert scores.joints_of(1, 0) is None


@pytest.mark.parametrize(("h", "g"), [(2, 0), (-1, 0), (0, 2), (0, -1)])
def test_joints_of_a_pair_that_does_not_exist(h, g):
    with pytest.raises(TcsError, match=rf"No pair of configuration {h} and goal {g}"):
        ScoreTable(**parts()).joints_of(h, g)


def test_reached_with_dexterity_zero_counts_as_reached():
    singular = parts()
    singular["dexterity"] = np.zeros((2, 2), dtype=np.float32)
    scores = ScoreTable(**singular)
    np.testing.assert_array_equal(scores.reachability(), [1.0, 0.75])
    np.testing.assert_array_equal(scores.manipulability(), [0.0, 0.0])


def test_arrays_are_read_only():
    scores = ScoreTable(**parts())
    for field in dataclasses.fields(scores):
        array = getattr(scores, field.name)
        if isinstance(array, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
    with pytest.raises(ValueError, match="read-only"):
        scores.reached[...] = False


WRONG = {
    "dexterity of double precision": ("dexterity", lambda a: a.astype(np.float64), "float32"),
    "dexterity of another shape": ("dexterity", lambda a: a[:, :1].copy(), "shape"),
    "dexterity below zero": ("dexterity", lambda a: a - 1.0, "dexterity"),
    "dexterity not a number": ("dexterity", lambda a: a * np.float32(np.nan), "dexterity"),
    "dexterity where not reached": ("dexterity", lambda a: a + np.float32(0.1), "not reached"),
    "reason unknown": ("reason", lambda a: a + np.uint8(6), r"outside 0\.\.11"),
    "pair unknown": ("pair", lambda a: a + np.int32(1), r"outside -1\.\.0"),
    "joints missing": ("arm_joints", lambda a: a[:2], "2 rows of arm joints for 3"),
    "six joints": ("arm_joints", lambda a: a[:, :6].copy(), "shape"),
    "joints infinite": ("arm_joints", lambda a: a + np.float32(np.inf), "finite"),
    "weights not normalised": ("weights", lambda a: 2.0 * a, "sum to 1"),
    "weights below zero": ("weights", lambda a: a - [0.5, -0.5], ">= 0"),
    "no array": ("weights", lambda a: a.tolist(), "numpy array"),
}


@pytest.mark.parametrize(("name", "change", "message"), WRONG.values(), ids=WRONG.keys())
def test_refuses(name, change, message):
    wrong = parts()
    wrong[name] = change(wrong[name])
    with pytest.raises(TcsError, match=message):
        ScoreTable(**wrong)


def test_reason_numbers_are_those_of_stored_files():
    assert [(r.name, r.value) for r in Reason] == [
        ("REACHED", 0),
        ("TOO_FAR", 1),
        ("JOINT_LIMITS", 2),
        ("BODY_BLOCKED", 3),
        ("GRIPPER_BLOCKED_BY_ENVIRONMENT", 4),
        ("GRIPPER_BLOCKED_BY_ROBOT", 5),
        ("ARM_BLOCKED", 6),
        ("EXCLUDED", 7),
        ("APPROACH_LIMITS", 8),
        ("APPROACH_BLOCKED", 9),
        ("OTHER_GOAL_UNREACHED", 10),
        ("ARMS_BLOCKED", 11),
    ]
