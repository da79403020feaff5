"""Phases of the pick-and-place task, where the tool should be in each, and traits of an operator.

Phases follow each other as in the thesis: approach, grasp, lift, transfer, lower until the table is
felt, release, retreat.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Traits:
    """Behaviour of one operator, the same from every base pose.

    The values were set before the first run of the experiment, from the sources given or to what is
    usual for careful work, and never fitted to results. `drawn` varies them over operators.
    Distances and speeds are those of the tool, unless they are said to be of the hand.

    Attributes:
        speed: Mean speed of a submovement [m/s].
        turn_speed: Mean angular speed of a submovement [rad/s].
        submovement: Longest time of one submovement [s]: visual corrections come at about 1 Hz
            (Woodworth 1899; Meyer et al. 1988).
        reaction: Time from an event to the reaction of the hand [s]; simple reactions take 0.2 to
            0.3 s.
        touch_reaction: The same for a force that is felt [s]; touch is faster than vision.
        thinking: Time to decide what is next, and to press a button [s].
        mental_rotation: Additional time to plan a submovement, per angle between the frames of hand
            and camera [s/rad]: 400 deg/s (Georgopoulos and Massey 1987).
        learning: Fraction of the uncompensated angle that is learnt in a submovement: some twenty
            movements are needed to adapt to rotated feedback (Krakauer et al. 2000).
        adaptation: Greatest fraction of the angle that is compensated: adaptation to rotated
            feedback stays incomplete (Vaswani et al. 2015).
        extent_noise: Standard deviation of the extent of a submovement, as a fraction:
            signal-dependent noise (Harris and Wolpert 1998).
        direction_noise: Standard deviation of the direction of a submovement [rad].
        misjudging: Standard deviation of the perceived position of the tool relative to its target,
            across the view [m], where both coincide.
        weber: Increase of that deviation per distance between the two [m/m].
        depth: Ratio of the deviation along the view to that across it: one image, depth from
            shadows and heights only.
        blind: The deviation where the tool is not in the image [m].
        misjudging_angle: Standard deviation of the perceived orientation [rad].
        misjudging_memory: Time constant of the misjudgement [s].
        tremor: Standard deviation of the position of the hand [m]: 38 µm with a held instrument
            (Riviere, Rader and Khosla 1997).
        tremor_lever: Distance over which tremor becomes rotation [m]: half a stylus.
        forearm: Length over which a translation of the hand becomes an involuntary rotation [m]:
            the hand pivots about the elbow.
        patience: Number of submovements without progress after which another way is tried.
        first_try: Distance of the first recovery motion [m].
        first_turn: Rotation of joint group 1 in a recovery [rad], with null-space control.
        pointing: Time to take the device of the joint groups [s].
        regrip: Time to take the first device again [s].
    """

    speed: float = 0.08
    turn_speed: float = 0.5
    submovement: float = 1.0
    reaction: float = 0.25
    touch_reaction: float = 0.15
    thinking: float = 0.4
    mental_rotation: float = 1.0 / math.radians(400.0)
    learning: float = 0.05
    adaptation: float = 0.85
    extent_noise: float = 0.08
    direction_noise: float = 0.1
    misjudging: float = 0.002
    weber: float = 0.03
    depth: float = 3.0
    blind: float = 0.05
    misjudging_angle: float = 0.05
    misjudging_memory: float = 2.0
    tremor: float = 38e-6
    tremor_lever: float = 0.05
    forearm: float = 0.3
    patience: int = 3
    first_try: float = 0.05
    first_turn: float = 0.35
    pointing: float = 1.5
    regrip: float = 0.5

    @classmethod
    def drawn(cls, rng: np.random.Generator, usual: Traits | None = None) -> Traits:
        """Return random traits, log-normal with a standard deviation of 0.2 of the logarithm.

        Args:
            rng: Random generator.
            usual: Medians of the traits; None for the defaults.
        """
        usual = usual or cls()
        spread = np.exp(0.2 * rng.standard_normal(len(VARIED)))
        changes: dict[str, Any] = {
            name: float(getattr(usual, name) * factor)
            for name, factor in zip(VARIED, spread, strict=True)
        }
        return replace(usual, **changes)


VARIED = (
    "speed", "turn_speed", "reaction", "thinking", "mental_rotation", "learning", "extent_noise",
    "direction_noise", "misjudging", "weber", "depth", "misjudging_angle", "tremor",
)  # fmt: skip
"""Traits that vary over operators."""
