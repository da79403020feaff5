"""Certified curves against the plain-loop reference, and against plates no sample would meet."""

from __future__ import annotations

import pytest

from tcs.kernel.arrays import BOX
from tcs.kernel.motion.edges import NO_PAIR, certified, posture_contact
from tests.kernel.arms import drake_arm
from tests.kernel.motion.toys import HERE, SWING, bare, prepared, toy, within_limits
from tests.kernel.shapes import placed
from tests.kernel.toy import along, toy_grid, with_obstacle
from tests.reference.constructed import arm_base
from tests.reference.kinematics import link_poses
from tests.reference.motion import (
    is_free_along,
    least_excess,
    point_on_curve,
    samples_along,
    straight_curve,
)

NEAR = 2e-5
"""Clearance beyond the required one below which the certified check may refuse [m]: twice the
motion at which it stops halving."""


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


def test_postures_agree_with_the_reference(chain, rng):
    scene, work, plain = toy(chain, obstacles=30)
    found = []
    for _ in range(25):
        q = within_limits(rng, chain)
        excess = least_excess(plain, q)
        found.append(posture_contact(scene, work, q) == NO_PAIR)
        if abs(excess) > 1e-9:
            assert found[-1] == (excess > 0.0), excess
    assert 3 < sum(found) < 23


def test_certified_curves_are_free_and_others_blocked_where_it_is_reported(chain, rng):
    scene, work, plain = toy(chain, obstacles=30)
    arm = plain.scene.arm

    def touches(q):
        return posture_contact(scene, work, q) != NO_PAIR

    free = blocked = 0
    while min(free, blocked) < 6:
        start = within_limits(rng, chain)
        if touches(start):
            continue
        control = straight_curve(start, start + rng.normal(size=7) * 0.3)
        control[1:3] += rng.normal(size=(2, 7)) * 0.1
        until = certified(scene, work, control)
        if until == 1.0:
            samples = samples_along(chain, arm, control, 0.02)
            assert is_free_along(control, samples - 1, touches)
            free += 1
            continue
        blocked += 1
        pair = work.contacts.pair[0]
        near = scene._replace(pairs=scene.pairs._replace(gap=scene.pairs.gap + NEAR))
        assert posture_contact(near, work, point_on_curve(control, until)) >= 0
        assert 0 <= pair < len(scene.pairs.members)


def test_the_reference_finds_certified_curves_free(chain, rng):
    scene, work, plain = toy(chain)
    checked = 0
    while checked < 3:
        start = 0.5 * within_limits(rng, chain)
        control = straight_curve(start, start + rng.normal(size=7) * 0.2)
        if certified(scene, work, control) == 1.0:
            assert is_free_along(control, 4, lambda q: least_excess(plain, q) <= 0.0)
            checked += 1


def test_a_thin_plate_between_two_postures_is_never_crossed(chain, rng):
    scene = bare(chain)
    ready, work, _ = prepared(scene)
    start, end = SWING
    control = straight_curve(start, end)
    assert certified(ready, work, control) == 1.0
    R_WA, p_WA = arm_base(scene, toy_grid(), HERE)
    for t in rng.uniform(0.2, 0.8, 20):
        # A plate of 1 mm, face to face with the path of the tool.
        q, q_next = (point_on_curve(control, u) for u in (t, t + 1e-4))
        p, p_next = (R_WA @ link_poses(chain, joints)[-1][1] + p_WA for joints in (q, q_next))
        plate = placed(BOX, [0.03, 0.03, 0.0005], along(p_next - p), p)
        blocked, scratch, _ = prepared(with_obstacle(scene, plate))
        assert posture_contact(blocked, scratch, start) == NO_PAIR
        assert posture_contact(blocked, scratch, end) == NO_PAIR
        assert certified(blocked, scratch, control) < 1.0


def test_a_curve_of_length_0_is_a_posture(chain, rng):
    scene, work, _ = toy(chain)
    for _ in range(50):
        q = within_limits(rng, chain)
        free = posture_contact(scene, work, q) == NO_PAIR
        assert (certified(scene, work, straight_curve(q, q)) == 1.0) == free
