"""Comparison of the kernel's results with the plain-loop reference."""

from __future__ import annotations

import numpy as np

from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED
from tcs.placement.tables import Reason
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import random_arm
from tests.reference import pairs as reference_pairs
from tests.reference.kinematics import free_joint

ROUNDING = 2e-6
"""Joints are float32: seven roundings of 1.2e-7 rad move a far corner by up to 1e-6 m."""
NEXT = (
    "If a rule was to change, change it in tests/reference too, and a distance that must be kept "
    "in `_gaps` of tcs/kernel/problem.py and `required_clearance` of tcs/model/scene/scene.py; "
    "else ask Drake, by `tcs verify`."
)
"""What to do when they disagree."""


def chain_of(seed, lowered, *, spherical_shoulder=False):
    """Return the arm of the PR2 or the Panda (spherical shoulder); a random one for odd seeds."""
    if seed % 2 == 0:
        return drake_arm("panda").chain if spherical_shoulder else lowered.arrays.chain
    chain = random_arm(np.random.default_rng(seed), spherical_shoulder=spherical_shoulder)
    # The reference walks the arcs of the free joint between limits only.
    lower, upper = chain.lower.copy(), chain.upper.copy()
    free = free_joint(chain)
    lower[free], upper[free] = -2.0, 2.5
    return chain._replace(lower=lower, upper=upper)


def is_true(scene, grid, h, g, q):
    """Return whether joints q are at the goal, within limits and free by the reference."""
    eased = scene._replace(
        margin=scene.margin - ROUNDING,
        self_margin=scene.self_margin - ROUNDING,
        environment=scene.environment._replace(
            pad=np.maximum(scene.environment.pad - ROUNDING, 0.0)
        ),
    )
    return reference_pairs.confirms(eased, grid, int(h), int(g), q.astype(np.float64))


def compare(scene, grid, scores, pairs, measure="isotropy"):
    """Compare the kernel's results with the reference's, away from contact thresholds."""
    for h, g in pairs:
        expected = reference_pairs.score(scene, grid, int(h), int(g), measure)
        reason, pair = int(scores.reason[h, g]), f"configuration {h}, goal {g}:"
        better = scores.dexterity[h, g] > expected.dexterity + 1e-6
        if reason == REACHED and (expected.reason in (ARM_BLOCKED, JOINT_LIMITS) or better):
            # The kernel divides intervals further; the reference can judge what it found.
            assert is_true(scene, grid, h, g, scores.joints[h, g]), (
                f"{pair} the kernel reaches it by joints that the reference refutes"
            )
        elif expected.clearance > 1e-6:  # at contact, rounding decides
            assert reason == expected.reason, (
                f"{pair} {Reason(reason).name} by the kernel, {Reason(expected.reason).name} by "
                f"the reference, {expected.clearance:.2e} m from a contact. {NEXT}"
            )
            # Both sample the same angles; the stored measure is that of joints rounded to float32.
            assert abs(scores.dexterity[h, g] - expected.dexterity) < 1e-6, f"{pair} {measure}"


def stratified(rng, reason, number):
    """Return up to `number` random pairs of every reason that occurs."""
    pairs = []
    for value in np.unique(reason):
        found = np.argwhere(reason == value)
        pairs.extend(found[rng.choice(len(found), min(number, len(found)), replace=False)])
    return pairs
