"""Success of base poses under errors of the base and of the task."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tcs.capability import PoseErrors, linear_task, merge, success_under_error
from tcs.capability.pose_errors import displaced
from tcs.capability.surroundings import Surroundings
from tcs.errors import TaskError, TcsError
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.sweep import score
from tests.capability.test_surroundings import boxes
from tests.kernel.judge import compare

TASK = linear_task(0.2, 2, 0.65, pre_grasps=(0.1,), step=0.1)


@pytest.fixture(scope="module")
def best(ihcm):
    return merge(ihcm, TASK).best()


@pytest.fixture(scope="module")
def empty(tiago):
    return Surroundings(tiago, boxes())


@pytest.fixture(scope="module")
def post(tiago):
    return Surroundings(tiago, boxes(("post", (0.1, 0.1, 0.62), (0.12, -0.1, 0.31))))


def test_without_errors_every_sample_is_the_feasibility(post, best):
    found = success_under_error(post, TASK, best, PoseErrors(), samples=3)
    feasibility = post.feasibility(TASK, best)
    assert found.reached.tolist() == [list(feasibility.reached)] * 3
    assert found.complete == float(feasibility.feasible)
    assert found.to_json()["samples"] == 3


def test_in_an_empty_environment_only_the_relative_pose_counts(empty, best):
    # A base that is moved by a rigid motion sees what a base sees whose task is moved back.
    rng = np.random.default_rng(4)
    for x, y, yaw in rng.normal(0.0, (0.15, 0.15, 0.3), (20, 3)):
        c, s = math.cos(yaw), math.sin(yaw)
        moved = replace(
            best, x=x + c * best.x - s * best.y, y=y + s * best.x + c * best.y, yaw=best.yaw + yaw
        )
        back = displaced(TASK, -c * x - s * y, s * x - c * y, -yaw)
        assert empty.feasibility(TASK, moved).reached == empty.feasibility(back, best).reached


def test_larger_errors_lose_more_and_samples_are_those_of_the_seed(post, best):
    small, large = (
        success_under_error(
            post, TASK, best, PoseErrors(base_position=std, task_position=std), samples=30
        )
        for std in (0.01, 0.2)
    )
    assert small.positions > large.positions
    low, high = large.complete_ci95
    assert 0.0 <= low <= large.complete <= high <= 1.0
    base, task = PoseErrors(base_position=0.01).draw(1000, 3)
    assert not task.any()
    assert not base[:, 2].any()
    # The deviation of 2000 samples is known to 1.6 percent.
    assert base[:, :2].std() == pytest.approx(0.01, rel=0.07)
    again, _ = PoseErrors(base_position=0.02).draw(10, 3)
    np.testing.assert_allclose(again, 2.0 * base[:10])


def test_displaced_scenes_agree_with_the_plain_loop_reference(post, best):
    base, task = PoseErrors(base_position=0.1, task_yaw=0.3).draw(1, 1)
    for of_base, of_task in zip(base, task, strict=True):
        moved = displaced(TASK, *of_task)
        poses = [(g.R_FT, [p.x, p.y, p.height]) for p in moved.positions for g in p.grasps]
        R, p = (np.array(part) for part in zip(*poses, strict=True))
        lowered = post._lowered(best.torso_height)
        arrays = lowered.arrays._replace(goal_R=R[None], goal_p=p[None])
        grid = lowered.grid._replace(
            base_x=np.array([best.x + of_base[0]]),
            base_y=np.array([best.y + of_base[1]]),
            base_yaw=np.array([best.yaw + of_base[2]]),
        )
        count = len(p)
        scores = score(build_problem(arrays), grid_rows(grid))
        compare(arrays, grid, scores, [(0, g) for g in range(count)])
        grasps = replace(moved, positions=tuple(
            replace(one, grasps=tuple(replace(g, pre_grasps=()) for g in one.grasps))
            for one in moved.positions
        ))  # fmt: skip
        at = replace(best, x=best.x + of_base[0], y=best.y + of_base[1], yaw=best.yaw + of_base[2])
        reached = (scores.reason[0] == 0).reshape(len(moved.positions), -1).any(axis=1)
        assert post.feasibility(grasps, at).reached == tuple(reached.tolist())


def test_wrong_input_is_refused(empty, best):
    with pytest.raises(TaskError, match=r"errors: base_position.*-1"):
        PoseErrors(base_position=-1.0)
    with pytest.raises(TaskError, match=r"errors: task_yaw"):
        PoseErrors(task_yaw=math.nan)
    with pytest.raises(TcsError, match=r"samples is 0"):
        success_under_error(empty, TASK, best, PoseErrors(), samples=0)
