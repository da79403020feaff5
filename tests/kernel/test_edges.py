"""Goals that are reachable by construction, next to singular postures and in narrow windows.

benchmarks/edges.py measures the same on hundreds of goals of each type.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from tcs.kernel.scores import REACHED, TOO_FAR
from tcs.kernel.verification.plain_dexterity import isotropy
from tcs.placement.scoring import load_job
from tests.chosen import some_of
from tests.reference import pairs as reference_pairs
from tests.reference.constructed import (
    ELBOW,
    SHOULDER,
    WRIST,
    between_limits,
    near_singular_goals,
    singular_angles,
)
from tests.reference.kinematics import jacobian

ROBOTS = ["pr2", "tiago", "iiwa7", "panda"]
JOINTS = {"shoulder": SHOULDER, "elbow": ELBOW, "wrist": WRIST}
SAMPLE = 3


AWAY = some_of([0.1, 0.06, 0.01, 0.003, 1e-3], 1e-3)


@pytest.fixture(scope="module", params=some_of(ROBOTS, "tiago", "iiwa7"))
def scene(request):
    """Arrays of shaving in the wheelchair with one robot."""
    job = load_job("shaving", "wheelchair", request.param, paper=True)
    lowered = job.lowered(job.scene())
    return lowered.arrays, lowered.grid


def missed(made):
    """Return which goals are not reached, after a check that each posture reaches its goal."""
    for g, q in enumerate(made.postures):
        assert reference_pairs.confirms(made.scene, made.grid, made.configuration, g, q)
    return np.flatnonzero(made.scores().reason[0] != REACHED).tolist()


@pytest.mark.parametrize("away", AWAY)
@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
def test_goals_of_nearly_singular_postures_are_reached(scene, joint, away):
    rng = np.random.default_rng([joint, round(1e4 * away)])
    made = near_singular_goals(rng, *scene, joint, away, SAMPLE)
    if made is None:
        lower, upper = scene[0].chain.lower[joint], scene[0].chain.upper[joint]
        # The limits keep the joint from being that near to singular.
        nearest = np.add.outer(singular_angles(scene[0].chain, joint), [away, -away])
        assert not np.any((nearest >= lower) & (nearest <= upper))
        return
    assert missed(made) == []


# Of fifty goals each. The first two: joints 5 and 7 (1 and 3 of the Panda) rotate against each
# other at one angle of the free joint. The third: both samples about it are beyond limits. The
# fourth: another joint follows its limit in an interval before, which may not use up all divisions.
@pytest.mark.parametrize(
    ("scene", "joint", "away", "goal"),
    [
        ("tiago", WRIST, 0.0, 4),
        pytest.param("panda", SHOULDER, 0.0, 0, marks=pytest.mark.slow),
        ("tiago", WRIST, 1e-3, 20),
        ("iiwa7", ELBOW, 1e-3, 46),
    ],
    indirect=["scene"],
)
def test_the_measure_is_that_of_the_posture_or_better(scene, joint, away, goal):
    rng = np.random.default_rng([0, joint, round(1e4 * away)])
    made = near_singular_goals(rng, *scene, joint, away, 50)
    scores, q = made.scores(), made.postures[goal]
    assert scores.reason[0, goal] == REACHED
    assert scores.dexterity[0, goal] >= isotropy(jacobian(made.scene.chain, q)) - 1e-3


@pytest.mark.parametrize("width", some_of([0.01, 0.003, 0.001], 0.003))
def test_goals_in_windows_between_limits_are_reached(scene, width):
    rng = np.random.default_rng(round(1e4 * width))
    tries = (between_limits(rng, *scene, width) for _ in range(120))
    found = list(islice((made for made in tries if made is not None), 2))
    assert found
    assert [missed(made) for made in found] == [[]] * len(found)


def test_the_stretched_arm_is_not_too_far():
    job = load_job("shaving", "wheelchair", "iiwa7", paper=True)
    lowered = job.lowered(job.scene())
    rng = np.random.default_rng(0)
    made = near_singular_goals(rng, lowered.arrays, lowered.grid, ELBOW, 0.0, 40)
    reasons = made.scores().reason[0]
    # Rounding puts every other goal beyond what the arm spans, by 1e-16.
    assert TOO_FAR not in reasons
    assert np.all(reasons == REACHED)


def test_the_measure_next_to_a_straight_wrist_is_that_of_the_posture_or_better(scene):
    rng = np.random.default_rng(5)
    made = near_singular_goals(rng, *scene, WRIST, 0.003, 12)
    if made is None:
        return
    scores, chain = made.scores(), made.scene.chain
    for g, q in enumerate(made.postures):
        # The posture is one of many that reach the goal; 1e-3 is what sampling may lose.
        assert scores.dexterity[0, g] >= isotropy(jacobian(chain, q)) - 1e-3
