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


def boxes(*obstacles):
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
    return merge(ihcm, TASK)


def test_an_empty_environment_leaves_every_base_pose_feasible(found, tiago):
    empty = Surroundings(tiago, boxes())
    assert empty.best(found) == (found.best(), 0)
    rows = np.linspace(0, len(found.base_poses) - 1, 40).astype(int)
    verdicts = [empty.feasibility(TASK, BasePose(*map(float, found.base_poses[r]))) for r in rows]
    assert not any(verdict.body_blocked for verdict in verdicts)
    # The task is on the grid, so the cells are the exact poses; torso heights between the checked
    # ones may differ.
    assert np.mean([verdict.feasible for verdict in verdicts]) > 0.95


def test_an_obstacle_makes_base_poses_infeasible(found, tiago):
    best = found.best()
    block = boxes(("post", (0.1, 0.1, 1.0), (best.x, best.y, 0.5)))
    around = Surroundings(tiago, block)
    verdict = around.feasibility(TASK, best)
    assert verdict.body_blocked
    assert not verdict.feasible
    other, rejected = around.best(found)
    assert rejected >= 1
    assert other.score <= best.score
    assert around.feasibility(TASK, other).feasible


def test_a_wall_about_the_task_blocks_the_arm_and_not_the_body(found, tiago):
    best = found.best()
    wall = boxes(("lid", (0.5, 0.8, 0.5), (0.1, 0.1, 0.65)))
    verdict = Surroundings(tiago, wall).feasibility(TASK, best)
    assert not verdict.body_blocked
    assert verdict.reached == (False, False)
    with pytest.raises(SelectionError, match=r"none of the best .* is feasible"):
        Surroundings(tiago, wall).best(
            dataclasses.replace(
                found, score=np.where(found.score >= best.score, found.score, np.nan)
            )
        )


def test_a_pre_grasp_does_not_replace_a_grasp(ihcm, tiago):
    """A bar at the grasp, and nothing at the pre-grasp."""
    task = linear_task(0.2, 2, 0.65, headings=(0.0,), pre_grasps=(0.1,), step=0.1)
    best = merge(ihcm, task).best()
    first = task.positions[0]
    assert Surroundings(tiago, boxes()).feasibility(task, best).reached == (True, True)
    block = ("bar", (0.02, 0.14, 0.04), (first.x, first.y, first.height))
    verdict = Surroundings(tiago, boxes(block)).feasibility(task, best)
    assert not verdict.body_blocked
    assert verdict.reached == (False, True)


def test_environment_and_task_move_together(found, tiago):
    # A base beside the task, so that both of its coordinates matter.
    beside = found.base_poses[np.abs(found.base_poses[:, 1]) >= 0.3]
    best = BasePose(*map(float, beside[np.argmax(beside[:, 4])]))
    assert abs(best.x) >= 0.2
    x, y, yaw = 1.3, -0.4, math.radians(35.0)
    c, s = math.cos(yaw), math.sin(yaw)
    moved = (x + c * best.x - s * best.y, y + s * best.x + c * best.y, 0.5)
    around = Surroundings(tiago, boxes(("post", (0.1, 0.1, 1.0), moved)), (x, y, yaw))
    assert around.feasibility(TASK, best).body_blocked
    away = Surroundings(tiago, boxes(("post", (0.1, 0.1, 1.0), (9.0, 9.0, 0.5))), (x, y, yaw))
    assert away.feasibility(TASK, best).feasible
