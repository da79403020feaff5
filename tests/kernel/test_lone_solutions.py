"""Goals that few postures reach, by construction, in scenes of shapes and arms of their own."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.arrays import SPHERE, GridArrays, SceneArrays
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import score
from tcs.kernel.verification.plain_dexterity import isotropy
from tests.kernel.judge import is_true
from tests.kernel.shapes import as_shapes, placed, random_joints, straight_arm
from tests.kernel.toy import arm_shapes
from tests.reference import pairs as reference_pairs
from tests.reference.constructed import same_branch, with_goals
from tests.reference.kinematics import free_joint, jacobian, link_poses

LIMITS = np.array([2.9, 2.0, 2.9, 2.1, 2.9, 2.1, 3.0])
FOREARM_ROLL, WRIST, WRIST_ROLL = 4, 5, 6
ROLL = 0.2
"""How far the rolls may turn from the posture at a straight wrist [rad]: to either side of the one
angle of the free joint at which it is straight, they would have to turn by a quarter or more."""
HERE = GridArrays(1, np.zeros(1), np.zeros(1), np.zeros(1), 1)
MARGIN = 0.001


def scene_of(chain, q, obstacles=(), arm=None):
    """Return a scene of an arm and obstacles, with the tool pose of posture q as the goal."""
    arm = arm_shapes(chain) if arm is None else arm
    far = placed(SPHERE, [0.01, 0, 0], p=[0, 0, -9.0])
    environment, body = as_shapes([far, *obstacles]), as_shapes([far])
    links, shapes = len(arm.type), len(environment.type)
    scene = SceneArrays(
        chain=chain,
        arm_base_R=np.eye(3)[None],
        arm_base_p=np.zeros((1, 3)),
        arm=arm,
        body=body,
        environment=environment,
        arm_vs_arm=np.zeros((links, links), bool),
        arm_vs_body=np.zeros((links, 1), bool),
        arm_vs_environment=np.ones((links, shapes), bool),
        body_vs_environment=np.zeros((1, shapes), bool),
        margin=MARGIN,
        self_margin=MARGIN,
        goal_R=np.zeros((1, 1, 3, 3)),
        goal_p=np.zeros((1, 1, 3)),
    )
    return with_goals(scene, HERE, 0, q[None])


def score_of(scene, q):
    """Return the measure of the goal, which must be reached, as it is at posture q."""
    assert reference_pairs.confirms(scene, HERE, 0, 0, q)
    scores = score(build_problem(scene), rows_at(HERE, [0]))
    assert scores.reason[0, 0] == REACHED
    assert is_true(scene, HERE, 0, 0, scores.joints[0, 0])
    return scores.dexterity[0, 0]


def at_straight_wrist(seed, offset):
    """Return an arm and a posture with a straight wrist, the rolls being limited about it."""
    chain = straight_arm(LIMITS, offset)
    q = np.random.default_rng(seed).uniform(-0.8, 0.8, 7) * LIMITS
    q[WRIST] = 0.0
    lower, upper = chain.lower.copy(), chain.upper.copy()
    for i in (FOREARM_ROLL, WRIST_ROLL):
        lower[i], upper[i] = max(lower[i], q[i] - ROLL), min(upper[i], q[i] + ROLL)
    return chain._replace(lower=lower, upper=upper), q


def best_of_rolls(chain, q):
    """Return the greatest isotropy of the postures that the rolls make of q, against each other."""
    turned = np.tile(q, (161, 1))
    turned[:, FOREARM_ROLL] += (by := np.linspace(-ROLL, ROLL, 161))
    turned[:, WRIST_ROLL] -= by
    kept = np.all((turned >= chain.lower - 1e-12) & (turned <= chain.upper + 1e-12), axis=1)
    return max(isotropy(jacobian(chain, other)) for other in turned[kept])


# The solver has to spread the postures over the free joint's angles, and to keep the joints
# determined (1, 12); rounding must not hide some of them (40, 53, 143, 540), nor must intervals
# between feasible samples in which joints run fast (18), and refinement has to go on (512, 540).
# Between two samples the wrist may pass straight twice (188, 574).
@pytest.mark.parametrize(
    ("seed", "offset"),
    [
        (1, 0.0),
        (12, 0.0),
        (40, 0.0),
        (53, 0.1),
        (540, 0.0),
        (512, 0.0),
        (18, 0.1),
        (143, 0.0),
        (188, 0.0),
        (188, 0.1),
        (574, 0.0),
    ],
    ids=str,
)
def test_the_best_posture_at_a_straight_wrist_is_found(seed, offset):
    chain, q = at_straight_wrist(seed, offset)
    # The search is within 1e-4 of it.
    assert score_of(scene_of(chain, q), q) >= best_of_rolls(chain, q) - 1e-3


def test_a_straight_wrist_is_found_where_all_candidates_of_another_branch_are_blocked():
    chain, q = at_straight_wrist(329, 0.1)
    score_of(scene_of(chain, q, [placed(SPHERE, [0.088, 0, 0], p=[-0.038, 0.093, 0.34])]), q)


WIDTH = 0.01
HALF_RANGE = 3.5 * 0.0125
"""The free joint's limits to either side of the posture [rad]: so that the window is in the middle
between two of eight samples."""
ELBOW_RADIUS, CLEAR = 0.05, 1e-6


def between_one_pair(seed):
    """Return a scene and a posture in the window that one pair leaves on both sides, or None.

    A ball at the elbow rolls round a sphere beyond the centre of its path, from which it is
    farthest at the posture. Both touch from half a WIDTH of the free joint on, to its limits.
    """
    chain = straight_arm(LIMITS, 0.1)
    q = random_joints(np.random.default_rng(seed), chain) * 0.8
    X_AG, free = link_poses(chain, q)[-1], free_joint(chain)
    elbows = []
    for side in (-0.5, 0.0, 0.5):
        R, p = link_poses(chain, same_branch(chain, X_AG, q, q[free] + side * WIDTH))[2]
        elbows.append(p + R @ chain.p[3])
    way = elbows[2] - elbows[0]
    bend = elbows[0] + elbows[2] - 2.0 * elbows[1]
    bend -= (bend @ way) / (way @ way) * way
    radius = way @ way / 4.0 / np.linalg.norm(bend)
    centre = elbows[1] + bend / np.linalg.norm(bend) * (2.0 * radius + 0.1)
    left, middle, right = (np.linalg.norm(elbow - centre) for elbow in elbows)
    if radius < 0.03 or middle < max(left, right) + CLEAR:
        return None
    lower, upper = np.maximum(chain.lower, q - 0.5), np.minimum(chain.upper, q + 0.5)
    lower[free], upper[free] = q[free] - HALF_RANGE, q[free] + HALF_RANGE
    arm = as_shapes(
        [
            placed(SPHERE, [ELBOW_RADIUS, 0, 0], p=chain.p[3], body=1),
            placed(SPHERE, [0.01, 0, 0], body=2),
        ]
    )._replace(frame=np.array([3, 7], np.int8))
    ball = placed(SPHERE, [max(left, right) - ELBOW_RADIUS - MARGIN, 0, 0], p=centre)
    scene = scene_of(chain._replace(lower=lower, upper=upper), q, [ball], arm)
    return scene._replace(arm_vs_environment=np.array([[True, True], [False, False]])), q


def test_windows_that_one_pair_leaves_are_found():
    made = [between_one_pair(seed) for seed in range(12)]
    found = [pair for pair in made if pair is not None]
    assert len(found) > 6
    for scene, q in found:
        score_of(scene, q)
