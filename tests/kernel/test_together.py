import numpy as np
import pytest

from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.together.arms import TwoArms
from tcs.model.robots import links_of_arm
from tcs.placement.scoring.job import load_jobs
from tests.chosen import some_of
from tests.environments import write_environment
from tests.reference.constructed import random_posture
from tests.reference.pairs import arms_touch, reached_together
from tests.two_arms import GRID, PAIR, write_pair


class Hands:
    """The two arms of the PR2 at one pair of goals: jobs, Drake scenes, arrays and the kernel."""

    def __init__(self, folder):
        environment = write_environment(folder, "beside", GRID)
        self.jobs = load_jobs(write_pair(folder, PAIR), environment, "pr2")
        self.scenes = [job.scene() for job in self.jobs]
        lowered = [j.lowered(s) for j, s in zip(self.jobs, self.scenes, strict=True)]
        self.arrays = tuple(one.arrays for one in lowered)
        self.names = [one.robot_bodies for one in lowered]
        self.grid = lowered[0].grid
        self.two = TwoArms(*(build_problem(a) for a in self.arrays), self.arrays)


@pytest.fixture(scope="module")
def hands(tmp_path_factory):
    return Hands(tmp_path_factory.mktemp("pair"))


def test_each_arm_is_scored_without_the_other(hands):
    for k, (names, arrays) in enumerate(zip(hands.names, hands.arrays, strict=True)):
        other = links_of_arm(hands.jobs[k].spec.robot, hands.jobs[1 - k].spec.robot.arm_joints[0])
        there = {names[i] for i in arrays.body.body}
        assert not there & other
        assert {"base_link", "torso_lift_link"} <= there
        assert arrays.arm_vs_body.shape == (len(arrays.arm.type), len(arrays.body.type))
        assert arrays.body_vs_environment.shape[0] == len(arrays.body.type)


def test_contact_of_the_arms_agrees_with_drake_and_the_reference(hands):
    rng = np.random.default_rng(3)
    first, second = hands.arrays
    q = np.array([random_posture(rng, first.chain) for _ in range(12)])
    other = np.array([random_posture(rng, second.chain) for _ in range(12)])
    # Both arms before the chest.
    q[:, 0], other[:, 0] = rng.uniform(-0.5, 0.2, 12), rng.uniform(-0.2, 0.5, 12)
    found = hands.two.contacts(np.zeros(12, np.int64), q, other)
    scene = hands.scenes[0]
    scene.set_torso(0.0)
    robot = hands.jobs[0].spec.robot
    arms = [links_of_arm(robot, job.spec.robot.arm_joints[0]) for job in hands.jobs]
    touched = 0
    for n in range(12):
        # The reference takes a second for two postures.
        if n % 6 == 0:
            touches, clearance = arms_touch(hands.arrays, 0, q[n], other[n])
            assert clearance > 1e-6
            assert (found[n, 0] >= 0) == touches
        scene.set_arm(q[n])
        scene.set_robot_joints(hands.jobs[0].other_joints, other[n])
        between = {
            (a, b) for a, b, _ in scene.violations() if {a, b} & arms[0] and {a, b} & arms[1]
        }
        assert (found[n, 0] >= 0) == bool(between)
        if found[n, 0] >= 0:
            touched += 1
            names = hands.names[0][found[n, 0]], hands.names[1][found[n, 1]]
            assert names in between
    assert 2 < touched < 11


def test_postures_of_the_best_pair_are_the_best_that_do_not_touch(hands):
    none = np.empty((0, 7))
    reached = []
    for h in range(16):
        best = hands.two.best_pair(rows_at(hands.grid, [h]), (0, 0), (none, none), 40)
        postures = [hands.two.postures(k, rows_at(hands.grid, [h]), 0, none, 40) for k in range(2)]
        (q, a), (other, b) = postures
        i, j = np.indices((len(q), len(other))).reshape(2, -1)
        found = hands.two.contacts(np.full(i.size, h % 2), q[i], other[j])
        free = np.minimum(a[i], b[j])[found[:, 0] < 0]
        assert (best is None) == (not free.size)
        if best is not None:
            assert best[0] == max(free)
            # The reference takes half a second.
            if len(reached) < 3:
                touches, clearance = arms_touch(hands.arrays, h % 2, best[1], best[2])
                assert not touches or clearance < 1e-6
            reached.append(h)
    assert 2 < len(reached) < 16


@pytest.mark.parametrize("h", some_of([0, 3], 0))
def test_the_reference_reaches_the_same_pairs(hands, h):
    none = np.empty((0, 7))
    found = hands.two.best_pair(rows_at(hands.grid, [h]), (0, 0), (none, none), 12)
    assert reached_together(hands.arrays, hands.grid, h, (0, 0), 12) == (found is not None)
