"""Upper bound of P_R + P_M over the continuous space of a score file."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.model.scene import torso_at
from tcs.placement.refinement.dexterity_bound import ISOTROPIES, dexterity_bound, is_relaxable
from tcs.placement.refinement.goal_bound import GoalLimits, goal_bounds
from tcs.placement.refinement.points import PointScorer, ScoredArm
from tcs.placement.store import ScoreFile


def upper_bound(file: ScoreFile, table: int, scorer: PointScorer) -> float:
    """Return an upper bound of P_R + P_M over every value of the axes between the grid's ends.

    A goal that some member reaches contributes its weight, and its weight times a dexterity that no
    joint angles of an arm exceed, or that none exceed which reach the goal from anywhere. A goal at
    which the gripper touches the environment is never reached, whatever the base pose and torso
    height; both hold over the continuous space where no axis moves the environment.

    Args:
        file: The score file.
        table: Number of its table.
        scorer: The scorer of that table.
    """
    weights = file.tables[table].sets.weights
    dexterity = np.max([_of_arm(scorer, arm) for arm in scorer.arms], axis=0)
    return float(np.sum((weights * (1.0 + dexterity))[~scorer.never_reached()]))


def _of_arm(scorer: PointScorer, arm: ScoredArm) -> FloatArray:
    """Return an upper bound of the dexterity of an arm at each goal, shape (G,)."""
    chain = arm.lowered.arrays.chain
    anywhere = np.full(scorer.goals, dexterity_bound(chain, scorer.measure))
    if (
        scorer.grid.environment_axes
        or arm.job.task.has_freedom
        or scorer.measure not in ISOTROPIES
        or chain.joints != 7
        or not is_relaxable(chain)
    ):
        return anywhere
    torso = scorer.grid.axis("torso").values
    base = torso_at(arm.lowered, arm.scene, [float(torso[0]), float(torso[-1])])
    goal_R, goal_p = scorer.goal_poses(arm)
    limits = GoalLimits.of(chain, base.arm_base_R, base.arm_base_p, goal_R, goal_p)
    if limits is None:
        return anywhere
    return np.asarray(np.minimum(anywhere, goal_bounds(chain, limits)))
