"""What a person says to the arm, and how the arm is to take it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS

LimitBehaviour = Literal["paper", "clamped"]


class Mode(StrEnum):
    """What the person's commands move."""

    END_EFFECTOR = "end-effector"
    """The tool, in all six directions (eqs. 6-8)."""
    NULL_SPACE = "null-space"
    """One joint group, the tool's position held (eqs. 9-14)."""
    POSE = "pose"
    """The elbow, the tool's pose held: the one degree of freedom that is left."""
    ASSISTED = "assisted"
    """The tool, while the arm keeps itself away from limits and singularities."""
    DRAKE = "drake"
    """The tool, by Drake's differential inverse kinematics: the baseline off the shelf."""


NULL_SPACE_MODES = (Mode.NULL_SPACE, Mode.POSE)
"""Modes in which the arm moves and the tool stays."""
FASTEST = 100.0
"""Commands beyond this [m/s or rad/s] are no hand's, but a fault's."""


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """What the person asks for during one step.

    Attributes:
        linear: Velocity of the tool in the robot's base B [m/s], shape (3,).
        angular: Angular velocity of the tool in B [rad/s], shape (3,).
        group: The joint group to turn, 0 to 3; None for none.
        sign: Which way it turns: k of eq. (13). In `Mode.POSE` the way of the elbow.
        mode: What the command moves; None leaves the mode as it is.
        clutch: Pressed, it parts arm and person: the arm comes to rest and holds the target,
            whatever else the command says.
    """

    linear: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)
    group: int | None = None
    sign: float = 0
    mode: Mode | None = None
    clutch: bool = False

    def fault(self, groups: int) -> str:
        """Return what makes the command unusable, empty if nothing does.

        Args:
            groups: How many joint groups there are.
        """
        for name, unit in (("linear", "m/s"), ("angular", "rad/s")):
            try:
                values = np.asarray(getattr(self, name), dtype=np.float64)
            except (TypeError, ValueError):
                values = np.empty(0)
            if values.shape != (3,):
                return f"its {name} velocity must be 3 numbers [{unit}]"
            # Written so that "not a number" is refused as well.
            if not np.abs(values).max() <= FASTEST:
                return f"its {name} velocity must be finite, and {FASTEST:g} {unit} at most"
        if self.sign not in (-1, 0, 1):
            return f"its sign must be -1, 0 or 1, not {self.sign}"
        if self.group is not None and self.group not in range(groups):
            return f"there is no joint group {self.group}, only 0 to {groups - 1}"
        if self.mode not in (None, *Mode):
            return f"there is no mode {self.mode!r}, only {', '.join(Mode)}"
        return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How commands become joint motion.

    Attributes:
        period: Time of one step [s]; the paper samples at 100 Hz.
        limits: What happens at an invalid configuration: "paper" ends the motion there, "clamped"
            leaves that joint at its limit and goes on with the others.
        gain: How fast the tool returns to its target [1/s]: errors fall by 1/e in 1/gain.
        target_lead: How far the target may run ahead of the tool [m].
        target_lead_angle: The same for its orientation [rad].
        acceleration: Greatest change of a joint's rate [rad/s^2].
        group_rate: Rate of a group's lead joint at k = 1 [rad/s].
        groups: The joint groups of eq. (12), counted from 0, each with its lead joint first.
        damping: Damping of the pseudo-inverse at a singularity [m/rad]; 0 for none.
        singular: Smallest singular value of the task's Jacobian below which the posture counts as
            singular [m/rad].
        near_limit: A joint this close to a limit counts as at it [rad].
        length: A turn of 1 rad weighs as much as this way [m] where not all of a command can be
            followed, and in singular values.
        assist_rate: How fast the assistance may move the posture [rad/s].
        assist_lead_angle: How far the assisted tool may be turned off the orientation asked for
            before that gives way [rad]; up to there, it is come back to.
        timeout: Without a command for longer than this, the input counts as lost [s].
    """

    period: float = 0.01
    limits: LimitBehaviour = "clamped"
    gain: float = 20.0
    target_lead: float = 0.005
    target_lead_angle: float = 0.05
    acceleration: float = 10.0
    group_rate: float = 0.4
    groups: tuple[tuple[int, ...], ...] = ((0, 1, 2), (1, 3, 5), (0, 3, 4), (6,))
    damping: float = 0.01
    singular: float = 0.01
    near_limit: float = 0.01
    length: float = 0.1
    assist_rate: float = 0.3
    assist_lead_angle: float = 1.0
    timeout: float = 0.25

    def __post_init__(self) -> None:
        """Refuse settings that no arm can follow.

        Raises:
            TcsError: As said.
        """
        positive = (
            "period",
            "gain",
            "target_lead",
            "target_lead_angle",
            "acceleration",
            "group_rate",
        )
        for name in (*positive, "singular", "length", "assist_lead_angle", "timeout"):
            _check(name, getattr(self, name), above_zero=True)
        for name in ("damping", "near_limit", "assist_rate"):
            _check(name, getattr(self, name), above_zero=False)
        # Feedback that corrects more than the whole error in a step swings up.
        if self.gain * self.period > 1.0:
            raise TcsError(
                f"teleop settings: gain {self.gain:g} /s at a period of {self.period:g} s corrects "
                f"more than the whole error in one step. Keep the gain at most {1 / self.period:g}."
            )
        if self.limits not in ("paper", "clamped"):
            raise TcsError(
                f"teleop settings: limits is {self.limits!r}, but must be 'paper' or 'clamped'."
            )
        for group in self.groups:
            if not group or len({*group}) < len(group) or not {*group} <= {*range(JOINTS)}:
                raise TcsError(
                    f"teleop settings: joint group {group} must name joints 0 to {JOINTS - 1}, "
                    "each once, its lead joint first."
                )


def _check(name: str, value: float, *, above_zero: bool) -> None:
    """Refuse a setting that is not finite, or too small."""
    if math.isfinite(value) and (value > 0.0 or (value == 0.0 and not above_zero)):
        return
    allowed = "above 0" if above_zero else "0 or more"
    raise TcsError(f"teleop settings: {name} is {value!r}, but must be finite and {allowed}.")
