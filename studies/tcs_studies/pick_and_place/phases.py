"""Phases of the pick-and-place task, and where the tool should be in each.

They follow each other as in the thesis: approach, grasp, lift, transfer, lower until the table is
felt, release, retreat.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs_studies.pick_and_place.cup import CupState
from tcs_studies.pick_and_place.task import FARTHEST, GRASP_HEIGHT, START

GRASP = -0.02
"""Distance from the tool frame, 2 cm behind the tips of the fingers, to the axis of a cup between
them [m]."""
BEFORE = 0.13
"""Distance before the grasp at which the gripper is aligned [m]: the fingers are 3 cm from the
cup."""
LIFT = 0.05
"""Height by which the cup is lifted [m]."""
CLEARANCE = 0.05
"""Distance beyond `FARTHEST` at which the operator aims in the retreat [m]."""
RISE = 0.2
"""Height above the start towards which the operator retreats [m]."""


class Phase(StrEnum):
    """Phase of the task."""

    APPROACH = "approach"
    ALIGN = "align"
    REACH = "reach"
    CLOSE = "close"
    REOPEN = "reopen"
    LIFT = "lift"
    TRANSFER = "transfer"
    LOWER = "lower"
    OPEN = "open"
    BACK = "back"
    RETREAT = "retreat"


NEXT = {
    Phase.APPROACH: Phase.ALIGN, Phase.ALIGN: Phase.REACH, Phase.REACH: Phase.CLOSE,
    Phase.REOPEN: Phase.ALIGN, Phase.LIFT: Phase.TRANSFER, Phase.TRANSFER: Phase.LOWER,
    Phase.LOWER: Phase.OPEN, Phase.BACK: Phase.RETREAT, Phase.RETREAT: Phase.RETREAT,
}  # fmt: skip
"""The phase that follows each, where the cup does not decide."""
TOLERANCE = {
    Phase.APPROACH: 0.04, Phase.ALIGN: 0.012, Phase.REACH: 0.012, Phase.LIFT: 0.02,
    Phase.TRANSFER: 0.012, Phase.LOWER: 0.004, Phase.BACK: 0.04, Phase.RETREAT: 0.0,
}  # fmt: skip
"""Perceived distance from the target at which a phase ends [m]."""
ORIENTED = (Phase.ALIGN, Phase.REACH)
"""Phases that need the orientation of the grasp."""
FREE = (Phase.BACK, Phase.RETREAT)
"""Phases in which the orientation does not matter."""


class Seen(NamedTuple):
    """What the image shows, and what the hand feels."""

    p: FloatArray
    """Position of the tool in the base [m], shape (3,)."""
    R: FloatArray
    """Orientation of the tool in the base, shape (3, 3)."""
    cup: FloatArray
    """Position of the cup in the base [m], shape (3,)."""
    state: CupState
    """State of the cup."""
    force: float
    """Force on the hand [N]."""


def target(phase: Phase, seen: Seen, place: FloatArray, ahead: FloatArray) -> FloatArray:
    """Return where the tool should be in the base [m], shape (3,).

    Args:
        phase: The phase.
        seen: What is seen.
        place: Where the cup goes, in the base [m], shape (3,).
        ahead: Direction of the fingers in the base, horizontal, shape (3,).
    """
    cup = seen.cup
    if phase in (Phase.APPROACH, Phase.ALIGN, Phase.REACH):
        back = GRASP + (0.0 if phase is Phase.REACH else BEFORE)
        aim = cup - back * ahead
        aim[2] = START[2] if phase is Phase.APPROACH else GRASP_HEIGHT
    elif phase in (Phase.LIFT, Phase.TRANSFER):
        over = place if phase is Phase.TRANSFER else cup
        aim = seen.p + over - cup
        aim[2] = seen.p[2] + GRASP_HEIGHT + LIFT - cup[2]
    elif phase is Phase.LOWER:
        aim = seen.p + place - cup
        aim[2] = seen.p[2] + GRASP_HEIGHT - cup[2]
    elif phase is Phase.BACK:
        aim = cup - (GRASP + BEFORE) * ahead
        aim[2] = seen.p[2]
    else:
        aim = _away(place)
    return aim


def _away(place: FloatArray) -> FloatArray:
    """Return the aim of the retreat: from the place towards the start, and up."""
    off = np.array(START) - place
    off[2] += RISE
    far = (FARTHEST + CLEARANCE) / math.sqrt(off @ off)
    return np.asarray(place + far * off)
