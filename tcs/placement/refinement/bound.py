"""Upper bound of P_R + P_M over the continuous space of a score file."""

from __future__ import annotations

import numpy as np

from tcs.placement.refinement.dexterity_bound import dexterity_bound
from tcs.placement.refinement.points import PointScorer
from tcs.placement.store import ScoreFile


def upper_bound(file: ScoreFile, table: int, scorer: PointScorer) -> float:
    """Return an upper bound of P_R + P_M over every value of the axes between the grid's ends.

    A goal that some member reaches contributes its weight, and its weight times a dexterity that no
    joint angles of an arm exceed. A goal at which the gripper touches the environment is never
    reached, whatever the base pose and torso height; this holds over the continuous space where no
    axis moves the environment.

    Args:
        file: The score file.
        table: Number of its table.
        scorer: The scorer of that table.
    """
    weights = file.tables[table].sets.weights
    dexterity = max(
        dexterity_bound(arm.lowered.arrays.chain, scorer.measure) for arm in scorer.arms
    )
    return float((1.0 + dexterity) * np.sum(weights[~scorer.never_reached()]))
