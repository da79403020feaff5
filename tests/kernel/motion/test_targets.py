"""Random postures that the planner grows towards: in hard queries many have joints at a limit."""

from __future__ import annotations

import numpy as np

from tcs.kernel.cache import jit
from tcs.kernel.motion.connect import BEYOND, LOCAL, _draw_target
from tcs.kernel.motion.search_trees import new_trees
from tests.kernel.arms import drake_arm
from tests.kernel.motion.test_paths import walled
from tests.kernel.motion.toys import prepared

DRAWS = 2000


@jit
def draw(scene, trees, beyond, drawn):
    """Fill postures that a tree of one node would grow towards."""
    for n in range(len(drawn)):
        _draw_target(scene, trees, 0, beyond)
        for k in range(7):
            drawn[n, k] = trees.target[0, k]


def test_postures_beyond_the_limits_are_set_to_them():
    scene, trees = prepared(walled(drake_arm("pr2 left").chain))[0], new_trees(0)
    bounded = scene.limits.period == 0.0
    trees.nodes[0], trees.q[0, 0] = 1, 0.0
    trees.q[0, 0, bounded] = (scene.limits.lower[bounded] + scene.limits.upper[bounded]) / 2.0
    at_limit = []
    for beyond in (0.0, BEYOND):
        drawn = np.empty((DRAWS, 7))
        draw(scene, trees, beyond, drawn)
        drawn, lower, upper = (
            drawn[:, bounded],
            scene.limits.lower[bounded],
            scene.limits.upper[bounded],
        )
        assert np.all((drawn >= lower) & (drawn <= upper))
        at_limit.append(np.mean((drawn == lower) | (drawn == upper)))
    # Of those not drawn around a node, the part of the wider range that is beyond the limits.
    more = (1.0 - LOCAL) * 2.0 * BEYOND / (1.0 + 2.0 * BEYOND)
    # Some 10,000 joints of each: five standard deviations are 0.03.
    assert abs(at_limit[1] - at_limit[0] - more) < 0.03
