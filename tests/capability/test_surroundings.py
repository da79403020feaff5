import dataclasses
import math

import numpy as np
import pytest

from tcs.capability import linear_task, merge
from tcs.capability.merge import BasePose
from tcs.capability.surroundings import Surroundings
from tcs.errors import SelectionError
from tcs.model.scene import EnvironmentFile

TASK = linear_task(0.2, 2, 0.65, pre_grasps=(0.1,), step=0.1)


def room(*obstacles):
    """Return an environment of boxes on a floor: name, sizes, centre."""
    axes = {
        name: {"unit": unit, "start": 0.0, "step": 0.0, "count": 1}
        for name, unit in (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"), ("torso", "m"))
    }
    boxes = [{"name": n, "box": list(size), "xyz": list(at)} for n, size, at in obstacles]
    return EnvironmentFile(
        name="boxes", title="Boxes", origin="anywhere", source="made up", grid=axes, obstacles=boxes
    )


@pytest.fixture(scope="module")
def found(ihcm):
    # The robot of the map stands on the floor at any of the map's lifts.
    return merge(ihcm, TASK)


def test_an_empty_room_takes_nothing_away(found, tiago):
    empty = Surroundings(tiago, room())
    assert empty.best(found) == (found.best(), 0)
    rows = np.linspace(0, len(found.base_poses) - 1, 40).astype(int)
    judged = [empty.judge(TASK, BasePose(*map(float, found.base_poses[r]))) for r in rows]
    assert not any(j.body_blocked for j in judged)
    # What the map says at its own cells holds at the very poses, for they are on the grid; a lift
    # between the map's own was looked at on both sides only.
    assert np.mean([j.possible for j in judged]) > 0.95


def test_what_stands_in_the_way_takes_base_poses_away(found, tiago):
    best = found.best()
    block = room(("post", (0.1, 0.1, 1.0), (best.x, best.y, 0.5)))
    around = Surroundings(tiago, block)
    judged = around.judge(TASK, best)
    assert judged.body_blocked
    assert not judged.possible
    other, taken = around.best(found)
    assert taken >= 1
    assert other.score <= best.score
    assert around.judge(TASK, other).possible


def test_a_wall_about_the_task_leaves_the_body_free_and_the_arm_not(found, tiago):
    best = found.best()
    wall = room(("lid", (0.5, 0.8, 0.5), (0.1, 0.1, 0.65)))
    judged = Surroundings(tiago, wall).judge(TASK, best)
    assert not judged.body_blocked
    assert judged.reached == (False, False)
    with pytest.raises(SelectionError, match="leaves none of the best"):
        Surroundings(tiago, wall).best(
            dataclasses.replace(
                found, score=np.where(found.score >= best.score, found.score, np.nan)
            )
        )


def test_a_pre_grasp_does_not_make_up_for_a_grasp(ihcm, tiago):
    """A bar where the fingers come to stand, and nothing where they wait before."""
    task = linear_task(0.2, 2, 0.65, headings=(0.0,), pre_grasps=(0.1,), step=0.1)
    best = merge(ihcm, task).best()
    first = task.positions[0]
    assert Surroundings(tiago, room()).judge(task, best).reached == (True, True)
    block = ("bar", (0.02, 0.14, 0.04), (first.x, first.y, first.height))
    judged = Surroundings(tiago, room(block)).judge(task, best)
    assert not judged.body_blocked
    assert judged.reached == (False, True)


def test_room_and_task_may_be_moved_together(found, tiago):
    # A base beside the task, so that both of its coordinates matter to where it comes to stand.
    beside = found.base_poses[np.abs(found.base_poses[:, 1]) >= 0.3]
    best = BasePose(*map(float, beside[np.argmax(beside[:, 4])]))
    assert abs(best.x) >= 0.2
    x, y, yaw = 1.3, -0.4, math.radians(35.0)
    c, s = math.cos(yaw), math.sin(yaw)
    moved = (x + c * best.x - s * best.y, y + s * best.x + c * best.y, 0.5)
    around = Surroundings(tiago, room(("post", (0.1, 0.1, 1.0), moved)), (x, y, yaw))
    assert around.judge(TASK, best).body_blocked
    away = Surroundings(tiago, room(("post", (0.1, 0.1, 1.0), (9.0, 9.0, 0.5))), (x, y, yaw))
    assert away.judge(TASK, best).possible
