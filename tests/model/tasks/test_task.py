import dataclasses
import math
import pickle

import numpy as np
import pytest

from tcs.errors import TaskError, UnknownNameError
from tcs.model.tasks import Goal, Task

HALF = math.sqrt(0.5)


def goal(**changes: object) -> Goal:
    values = {
        "body_frame": "head",
        "position": [0.1, 0.0, -0.1],
        "quaternion": [HALF, 0.0, 0.0, HALF],
        "weight": 1.0,
    }
    return Goal(**{**values, **changes})


def task(**changes: object) -> Task:
    values = {
        "name": "wiping",
        "title": "Wiping the mouth",
        "goals": (goal(),),
        "environments": ("wheelchair",),
        "source": "made up",
    }
    return Task(**{**values, **changes})


def test_three_digits_of_a_quaternion_suffice():
    """0.707 twice has the length 0.99985."""
    found = goal(quaternion=[0.707, 0.0, 0.0, 0.707]).quaternion
    np.testing.assert_allclose(found, [HALF, 0.0, 0.0, HALF], atol=1e-12)


def test_quaternion_is_normalised():
    # An error of 7e-6 of the length, as from numbers of six digits.
    written = np.array([0.5, 0.5, 0.5, 0.5]) * (1 + 7e-6)
    length = np.linalg.norm(goal(quaternion=written).quaternion)
    assert length == pytest.approx(1.0, abs=4e-16)  # rounding of one division


def test_a_copied_goal_has_the_same_bits():
    """Goals are read from files as poses first, then copied: scores depend on the last digit."""
    for written in np.random.default_rng(0).normal(size=(200, 4)):
        once = written / np.linalg.norm(written) * (1 + 7e-6)
        made = goal(quaternion=once)
        again = dataclasses.replace(made, weight=2.0)
        assert again.quaternion.tobytes() == made.quaternion.tobytes()
        assert made.quaternion.tobytes() == (once / math.hypot(*once)).tobytes()


def test_arrays_are_read_only_copies():
    position = np.array([0.1, 0.2, 0.3])
    made = goal(position=position)
    position[0] = 9.0
    assert made.position[0] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        made.position[0] = 9.0


def test_equal_goals_are_equal_and_hash_alike():
    assert goal() == goal()
    assert len({goal(), goal(), goal(weight=2.0)}) == 2
    assert goal() != goal(position=[0.1, 0.0, -0.2])
    assert goal() != "head"


def test_weights_sum_to_one_in_proportion():
    weights = task(goals=(goal(weight=1), goal(weight=3))).weights
    assert weights.tolist() == [0.25, 0.75]


def test_tasks_can_be_pickled():
    sent = task(grids={"wheelchair": {"torso": {"count": 1}}})
    assert pickle.loads(pickle.dumps(sent)) == sent
    assert hash(sent) == hash(pickle.loads(pickle.dumps(sent)))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"body_frame": ""}, "field 'body_frame' is empty"),
        ({"name": "left\ncheek"}, "printable characters"),
        ({"name": "c" * 61}, "at most 60"),
        ({"position": [0.1, 0.2]}, "must be 3 finite numbers (x, y, z)"),
        ({"position": [0.1, math.nan, 0.2]}, "must be 3 finite numbers"),
        ({"position": ["a", 0, 0]}, "must be 3 finite numbers"),
        ({"position": [10**400, 0, 0]}, "must be 3 finite numbers"),
        ({"position": [133.7, 1.8, -109.8]}, "Write metres"),
        ({"quaternion": [1, 0, 0]}, "must be 4 finite numbers (w, x, y, z)"),
        ({"quaternion": [math.inf, 0, 0, 0]}, "must be 4 finite numbers"),
        ({"quaternion": [1, 0, 0, 0.06]}, "has length 1.0018, but must be a unit quaternion"),
        ({"quaternion": [0, 0, 0, 0]}, "has length 0, but must be a unit quaternion"),
        ({"weight": 0}, "field 'weight' is 0, but a weight must be 1e-06 to 1,000,000"),
        ({"weight": -1.0}, "field 'weight' is -1, but a weight must be"),
        ({"weight": math.nan}, "field 'weight' is nan"),
        ({"weight": math.inf}, "field 'weight' is inf"),
    ],
    ids=str,
)
def test_an_invalid_goal_is_refused(changes, expected):
    with pytest.raises(TaskError) as caught:
        goal(**changes)
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"name": ""}, "field 'name' is empty"),
        ({"goals": ()}, "needs at least one goal"),
        ({"environments": ()}, "needs at least one environment"),
        ({"environments": ("bed", "bed")}, "'bed' is repeated"),
    ],
    ids=["name", "goals", "environments", "twice"],
)
def test_an_invalid_task_is_refused(changes, expected):
    with pytest.raises(TaskError, match=expected):
        task(**changes)


def test_grid_is_changed_only_where_the_task_applies():
    changed = task(grids={"wheelchair": {"torso": {"count": 1}}})
    assert changed.grid_changes("wheelchair") == {"torso": {"count": 1}}
    assert changed.grid_changes("somewhere") == {}
    with pytest.raises(UnknownNameError, match="Did you mean 'wheelchair'"):
        task(grids={"wheelchiar": {}})
