"""Arms of six joints: all solutions against Newton's method, scores against the reference."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tcs.errors import ArmClassError
from tcs.kernel.arrays import Chain
from tcs.kernel.dexterity import MEASURES
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR
from tcs.kernel.six_joints.arm import is_general, six_joint_arm
from tcs.kernel.six_joints.solutions import (
    MOST_SOLUTIONS,
    six_joint_solutions,
    solve_poses,
    solve_six_joints,
)
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.verification.plain_dexterity import measured
from tcs.kernel.verification.scans import dense_scan
from tests.kernel.judge import compare, is_true, stratified
from tests.kernel.shapes import around, random_arm, random_joints, rotation
from tests.kernel.toy import scores_of, toy_grid, toy_scene
from tests.reference.kinematics import jacobian, link_poses

CLASSES = ("spherical wrist", "parallel axes", "elimination")
SCENES = {"spherical wrist": 6, "parallel axes": 10, "elimination": 10}
"""Seeds of toy scenes with every reason that depends on the arm."""
FLIP = np.diag([1.0, -1.0, -1.0])
RIGHT = np.pi / 2
BENT_WRISTS = {
    # d, a and alpha of each joint: Kinova's Jaco with its bent wrist (j2n6s200), axes 4, 5 and 6 at
    # 60 degrees; an arm whose last axis passes the one before it at 0.15 m; an industrial arm with
    # a spherical wrist whose axes 1 and 2 are 0.15 m apart.
    "bent": (
        (0.2755, 0.0, RIGHT),
        (0.0, 0.41, np.pi),
        (-0.0098, 0.0, RIGHT),
        (-0.25008, 0.0, np.pi / 3),
        (-0.08556, 0.0, np.pi / 3),
        (-0.20278, 0.0, np.pi),
    ),
    "offset": (
        (0.0, 0.0, -RIGHT),
        (0.0, 0.71, np.pi),
        (0.0, 0.0, -RIGHT),
        (-0.54, 0.0, RIGHT),
        (0.15, 0.0, -RIGHT),
        (-0.16, 0.0, np.pi),
    ),
    "shoulder": (
        (0.4, 0.15, -RIGHT),
        (0.0, 0.6, 0.0),
        (0.0, 0.12, -RIGHT),
        (0.62, 0.0, RIGHT),
        (0.0, 0.0, -RIGHT),
        (0.1, 0.0, 0.0),
    ),
}
"""Arms without a closed form here, by their Denavit-Hartenberg parameters [m, rad]."""


@cache
def six_joint_chain(name, seed, limited=True):
    """Return a random arm of a class: any twists, any other offsets."""
    rng = np.random.default_rng(seed)
    chain = random_arm(rng)
    R, p = chain.R.copy(), chain.p.copy()
    R[1], p[1] = np.eye(3), 0.0
    if name == "parallel axes":
        p = rng.uniform(-0.3, 0.3, (8, 3))
        p[1] = 0.0
        for i in (3, 4):
            angle = rng.uniform(-np.pi, np.pi)
            c, s = np.cos(angle), np.sin(angle)
            turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            R[i] = turn @ FLIP if rng.random() < 0.5 else turn
        # Axes 6 and 7 of the chain meet, but not where the origins of L6 and L7 are.
        R[6] = rotation(rng)
        p[6] = 0.1 * R[6][:, 2] + [0.0, 0.0, 0.05]
    if name == "elimination":
        R = np.array([np.eye(3), np.eye(3), *(rotation(rng) for _ in range(6))])
        p = rng.uniform(-0.3, 0.3, (8, 3))
        p[1] = 0.0
    lower, upper = (np.full(7, -np.inf), np.full(7, np.inf))
    if limited:
        lower[1:], upper[1:] = chain.lower[1:], chain.upper[1:]
    return Chain(R, p, lower, upper, joints=6)


def bent_wrist(name):
    """Return an arm without joint limits from its Denavit-Hartenberg parameters."""
    R, p = np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, 3))
    for i, (d, a, alpha) in enumerate(BENT_WRISTS[name]):
        c, s = np.cos(alpha), np.sin(alpha)
        R[i + 2], p[i + 2] = [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], [a, 0.0, d]
    return Chain(R, p, np.full(7, -np.inf), np.full(7, np.inf), joints=6)


def offset_arm():
    """Return FANUC's CRX-10iA, whose last axis passes the one before it, without joint limits."""
    R, p = np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, 3))
    R[1] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    R[2] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    R[3] = np.diag([-1.0, 1.0, -1.0])
    R[4] = R[5] = R[6] = [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]
    R[7] = [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]
    p[1, 2], p[3, 0], p[5, 2], p[6, 2], p[7, 2] = 0.245, -0.54, -0.54, 0.15, -0.16
    return Chain(R, p, np.full(7, -np.inf), np.full(7, np.inf), joints=6)


def meeting_angle(chain, joint):
    """Return an angle of a joint at which its two solutions meet.

    The angle extremises the height of the next axis but one, or the distance of the axes.
    """
    before, after = chain.R[joint], chain.R[joint + 1][:, 2]
    if joint == 5:
        row = before[2]
        cosine, sine = row[0] * after[0] + row[1] * after[1], row[1] * after[0] - row[0] * after[1]
        return np.arctan2(sine, cosine)
    p, w = chain.R[joint].T @ chain.p[joint], chain.p[joint + 1]
    if np.hypot(*chain.R[joint][:2, 2]) < 1e-9:
        p, w = p * [1.0, 1.0, 0.0], w * [1.0, 1.0, 0.0]
    # |R^T p + Rz w|^2 has this single cosine.
    return np.arctan2(p[1] * w[0] - p[0] * w[1], p[0] * w[0] + p[1] * w[1])


def drawn(rng, chain):
    """Return joints within the limits and the tool pose there."""
    q = random_joints(rng, chain)
    q[0] = 0.0
    return q, link_poses(chain, q)[-1]


def is_among(q, solutions):
    return min((np.abs(around(q - other)).max() for other in solutions), default=9.0) < 1e-6


@pytest.mark.parametrize("name", CLASSES)
@pytest.mark.parametrize("seed", range(2))
def test_newtons_method_finds_no_further_solution(name, seed):
    chain = six_joint_chain(name, seed, limited=False)
    arm, rng = six_joint_arm(chain), np.random.default_rng(seed)
    q, (R, p) = drawn(rng, chain)
    found = six_joint_solutions(arm, R, p)
    assert is_among(q, found)
    expected = newton_solutions(chain, R, p)
    assert len(found) <= MOST_SOLUTIONS
    assert all(is_among(other, found) for other in expected)
    # 400 starts may miss one elbow, with both wrists, of two that nearly coincide.
    assert sum(is_among(other, expected) for other in found) >= len(found) - 2


@pytest.mark.parametrize("name", CLASSES)
def test_every_posture_is_among_the_solutions_of_its_pose(name, rng):
    for seed in range(10):
        chain = six_joint_chain(name, seed)
        arm = six_joint_arm(chain)
        for _ in range(20):
            q, (R, p) = drawn(rng, chain)
            found = six_joint_solutions(arm, R, p)
            assert is_among(q, found), seed
            for other in found:
                assert other[0] == 0.0
                assert np.all((other >= chain.lower) & (other <= chain.upper))
                S, s = link_poses(chain, other)[-1]
                np.testing.assert_allclose(S, R, atol=1e-7)
                np.testing.assert_allclose(s, p, atol=1e-7)


@pytest.mark.slow  # it compiles the sweep of these arms
@pytest.mark.parametrize("name", CLASSES)
def test_kernel_agrees_with_reference(name, rng):
    chain = six_joint_chain(name, SCENES[name])
    scene, grid = toy_scene(chain, SCENES[name], obstacles=3), toy_grid()
    scores = scores_of(scene, grid)
    assert np.sum(scores.reason == REACHED) > 5
    compare(scene, grid, scores, stratified(rng, scores.reason, 1))
    reached = np.argwhere(scores.reason == REACHED)
    for h, g in reached[rng.choice(len(reached), 5, replace=False)]:
        assert is_true(scene, grid, h, g, scores.joints[h, g])


@pytest.mark.slow  # it compiles the sweep of these arms
@pytest.mark.parametrize("name", CLASSES)
def test_dense_scan_finds_what_the_sweep_finds(name, rng):
    chain = six_joint_chain(name, SCENES[name])
    scene, grid = toy_scene(chain, SCENES[name], obstacles=3), toy_grid()
    problem, scores = build_problem(scene), scores_of(scene, grid)
    kept = np.isin(scores.reason, (REACHED, JOINT_LIMITS, ARM_BLOCKED, TOO_FAR))
    for h, g in stratified(rng, np.where(kept, scores.reason, 99), 1):
        if not kept[h, g]:
            continue
        q = np.full(7, np.nan)
        value = dense_scan(problem, rows_at(grid, [h]), g, 0, q)
        assert (value >= 0.0) == (scores.reason[h, g] == REACHED)
        if value >= 0.0:
            # The stored measure is that of joints rounded to float32.
            assert value == pytest.approx(float(scores.dexterity[h, g]), abs=1e-6)


def test_measures_leave_out_the_joint_that_remains_at_zero(rng):
    chain = six_joint_chain("parallel axes", 2)
    scene = toy_scene(chain, 2, goals=1)
    for measure in MEASURES:
        problem = build_problem(scene, measure)
        q, _ = drawn(rng, chain)
        expected = measured(jacobian(chain, q), q, chain.lower, chain.upper, measure)
        # As for seven joints, where the eigenvalues of J J^T are good to 1e-7.
        assert measure_at(problem, q) == pytest.approx(expected, abs=1e-7)


def test_limits_of_more_than_a_turn_keep_one_angle_of_each_solution():
    chain = six_joint_chain("spherical wrist", 3, limited=False)
    lower, upper = np.full(7, -2.0 * np.pi), np.full(7, 2.0 * np.pi)
    lower[0], upper[0] = -np.inf, np.inf
    _, (R, p) = drawn(np.random.default_rng(3), chain)
    wide = chain._replace(lower=lower, upper=upper)
    free = six_joint_solutions(six_joint_arm(chain), R, p)
    found = six_joint_solutions(six_joint_arm(wide), R, p)
    assert len(found) == len(free) == len(within(wide, newton_solutions(wide, R, p)))


@pytest.mark.parametrize("name", BENT_WRISTS)
def test_elimination_finds_postures_whose_second_joints_lie_close_together(name):
    chain = bent_wrist(name)
    arm, rng = six_joint_arm(chain), np.random.default_rng(0)
    assert is_general(arm)
    for _ in range(300):
        q, (R, p) = drawn(rng, chain)
        found = six_joint_solutions(arm, R, p)
        assert is_among(q, found)
        for other in found:
            np.testing.assert_allclose(link_poses(chain, other)[-1][0], R, atol=1e-7)


def test_elimination_finds_all_solutions_of_a_bent_wrist():
    chain = bent_wrist("bent")
    arm, rng = six_joint_arm(chain), np.random.default_rng(1)
    for _ in range(4):
        _, (R, p) = drawn(rng, chain)
        found, expected = six_joint_solutions(arm, R, p), newton_solutions(chain, R, p)
        assert all(is_among(other, found) for other in expected)
        assert len(found) >= len(expected)


@pytest.mark.parametrize(
    "p", [(0.1, 0.2, 0.1), (-0.1, -0.3, 0.1), (0.4, 0.1, 0.2), (0.1, -0.1, 0.5)]
)
def test_elimination_finds_the_solutions_of_a_last_axis_parallel_to_the_first(p):
    # Solutions then share the angle that elimination searches.
    chain = bent_wrist("bent")
    found = six_joint_solutions(six_joint_arm(chain), FLIP, np.array(p))
    expected = newton_solutions(chain, FLIP, np.array(p))
    assert len(expected) >= 4
    assert all(is_among(other, found) for other in expected)


def test_elimination_finds_solutions_whose_angles_differ_by_less_than_a_root_is_exact():
    # FANUC's CRX-10iA: the second joints of two pairs are 2e-8 apart, of two others 5e-7.
    chain = offset_arm()
    q = np.zeros(7)
    q[1:4] = 2.724111626476, 3.137503232577, 3.104028799456
    q[4:] = 1.557506561692, 1.556539921104, 1.642077856296
    R, p = link_poses(chain, q)[-1]
    found = six_joint_solutions(six_joint_arm(chain), R, p)
    assert len(found) == 8
    assert is_among(q, found)
    assert all(is_among(other, found) for other in newton_solutions(chain, R, p))


@pytest.mark.parametrize("name", [*CLASSES, "bent"])
def test_many_poses_have_the_solutions_of_each(name, rng):
    chain = bent_wrist(name) if name == "bent" else six_joint_chain(name, 1, limited=False)
    arm = six_joint_arm(chain)
    poses = [drawn(rng, chain)[1] for _ in range(20)]
    R, p = (np.array(values) for values in zip(*poses, strict=True))
    # A goal that no arm reaches has none.
    p[7] += 50.0
    solutions, counts = np.empty((20, MOST_SOLUTIONS, 7)), np.zeros(20, np.int64)
    solve_poses(arm, R, p, solutions, counts)
    assert counts[7] == 0
    assert counts.min(initial=9, where=np.arange(20) != 7) > 0
    for n, count in enumerate(counts):
        expected = np.empty((MOST_SOLUTIONS, 7))
        assert solve_six_joints(arm, R[n].copy(), p[n].copy(), expected) == count
        np.testing.assert_array_equal(solutions[n, :count], expected[:count])


@pytest.mark.parametrize("name", ["spherical wrist", "parallel axes"])
@pytest.mark.parametrize("off", [0.0, 1e-13, 1e-9, 1e-7, 1e-5, 1e-3])
def test_closed_forms_find_postures_next_to_straight_joints(name, off):
    # Each joint but the first at the angle where its two solutions meet, or next to it.
    chain, rng = six_joint_chain(name, 2, limited=False), np.random.default_rng(1)
    arm = six_joint_arm(chain)
    for joint in (3, 5):
        for _ in range(20):
            q, _ = drawn(rng, chain)
            q[joint] = meeting_angle(chain, joint) + off
            R, p = link_poses(chain, q)[-1]
            found = six_joint_solutions(arm, R, p)
            assert len(found) >= 1
            for other in found:
                S, s = link_poses(chain, other)[-1]
                np.testing.assert_allclose(S, R, atol=1e-7)
                np.testing.assert_allclose(s, p, atol=1e-7)
            # Closer to it, posture and mirror image are equal but for rounding.
            if off >= 1e-5:
                assert is_among(q, found)


def test_an_arm_with_the_same_axis_twice_is_refused():
    chain = six_joint_chain("elimination", 0)
    R, p = chain.R.copy(), chain.p.copy()
    R[6], p[6] = np.eye(3), 0.0
    with pytest.raises(ArmClassError, match=r"six joints.*degrees apart.*some of its axes"):
        six_joint_arm(chain._replace(R=R, p=p))
