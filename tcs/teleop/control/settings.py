"""Control modes, the operator's command, and the settings of the controller."""

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
    """Control mode: what the commands move, and what is held."""

    END_EFFECTOR = "end-effector"
    """The tool, in all six directions (eqs. 6-8)."""
    NULL_SPACE = "null-space"
    """One joint group, while the tool's position is held (eqs. 10-14)."""
    POSE = "pose"
    """The elbow, while the tool's pose is held: self-motion."""
    ASSISTED = "assisted"
    """The tool, while the redundancy avoids limits and singularities."""
    DRAKE = "drake"
    """The tool, by Drake's differential inverse kinematics: the baseline."""
    JOINT = "joint"
    """Every joint on its own, to a set-point; the tool is not held (eq. 9)."""


NULL_SPACE_MODES = (Mode.NULL_SPACE, Mode.POSE)
"""Modes that move the arm in the null space of the tool."""
FASTEST = 100.0
"""Greatest velocity of a valid command [m/s or rad/s]."""
_DAMPING = 0.01
"""Damping of the pseudo-inverse with "clamped" limits [m/rad]: at most 5 rad/s at 0.1 m/s."""


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """Command of the operator for one control period.

    Attributes:
        linear: Velocity of the tool in the robot's base B [m/s], shape (3,).
        angular: Angular velocity of the tool in B [rad/s], shape (3,).
        group: The joint group to move, 0 to 3; None for none.
        sign: Direction of the group, -1, 0 or 1: k of eq. (13). In `Mode.POSE` the direction of the
            elbow.
        mode: The control mode; None keeps the current one.
        joints: Set-point of the joints in `Mode.JOINT` [rad], shape (7,); None for the present
            posture, in which the joints come to rest.
        clutch: Whether the clutch decouples master and slave: the arm comes to rest and holds the
            target, whatever the rest of the command.
    """

    linear: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)
    group: int | None = None
    sign: float = 0
    mode: Mode | None = None
    joints: FloatArray | tuple[float, ...] | None = None
    clutch: bool = False

    def fault(self, groups: int) -> str:
        """Return a message about what makes the command invalid, empty if it is valid.

        Args:
            groups: Number of joint groups.
        """
        for name, unit in (("linear", "m/s"), ("angular", "rad/s")):
            try:
                values = np.asarray(getattr(self, name), dtype=np.float64)
            except (OverflowError, TypeError, ValueError):
                values = np.empty(0)
            if values.shape != (3,):
                return f"its {name} velocity must be 3 numbers [{unit}]"
            # In this form the comparison is false for nan as well.
            if not np.abs(values).max() <= FASTEST:
                return f"its {name} velocity must be finite, and {FASTEST:g} {unit} at most"
        if self.sign not in (-1, 0, 1):
            return f"its sign must be -1, 0 or 1, not {self.sign}"
        if self.group is not None and self.group not in range(groups):
            return f"there is no joint group {self.group}, only 0 to {groups - 1}"
        if self.mode not in (None, *Mode):
            return f"there is no mode {self.mode!r}, only {', '.join(Mode)}"
        if self.joints is not None and not _is_posture(self.joints):
            return f"its set-point must be {JOINTS} finite numbers [rad]"
        return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Settings of the controller.

    Attributes:
        period: Time of one step [s]; the paper samples at 100 Hz.
        limits: Behaviour at an invalid joint configuration: "paper" ends the motion, "clamped"
            leaves that joint at its limit and continues with the others.
        gain: Feedback gain of the pose error [1/s]; its inverse is the time constant of errors.
        target_lead: Target lead limit: greatest distance from tool to target [m].
        target_lead_angle: Target lead limit of the orientation [rad].
        acceleration: Greatest change of a joint's rate [rad/s^2].
        group_rate: Rate of a group's lead joint at k = 1 [rad/s].
        joint_rate: Greatest rate of a joint on its way to a set-point [rad/s].
        groups: The joint groups of eq. (12), counted from 0, each with its lead joint first.
        damping: Damping of the pseudo-inverse at a singularity [m/rad]; 0 for none. None is 0.01
            with "clamped" limits, and 0 with "paper", as in eq. (7).
        singular: Smallest singular value of the task's Jacobian below which the posture counts as
            singular [m/rad].
        near_limit: Distance from a limit within which a joint is reported as at the limit [rad].
        length: Distance that has the weight of a rotation of 1 rad [m] where a command cannot be
            followed completely, and in singular values.
        assist_rate: Greatest joint rate of the assistance in the null space [rad/s].
        assist_lead_angle: Target lead limit of the orientation in assisted mode [rad]: a smaller
            orientation error is recovered.
        timeout: Time without a command after which the input counts as lost [s].
    """

    period: float = 0.01
    limits: LimitBehaviour = "clamped"
    gain: float = 20.0
    target_lead: float = 0.005
    target_lead_angle: float = 0.05
    acceleration: float = 10.0
    group_rate: float = 0.4
    joint_rate: float = 0.5
    groups: tuple[tuple[int, ...], ...] = ((0, 1, 2), (1, 3, 5), (0, 3, 4), (6,))
    damping: float | None = None
    singular: float = 0.01
    near_limit: float = 0.01
    length: float = 0.1
    assist_rate: float = 0.3
    assist_lead_angle: float = 1.0
    timeout: float = 0.25

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            TcsError: If a setting is out of its range.
        """
        positive = (
            "period",
            "gain",
            "target_lead",
            "target_lead_angle",
            "acceleration",
            "group_rate",
            "joint_rate",
        )
        for name in (*positive, "singular", "length", "assist_lead_angle", "timeout"):
            _check(name, getattr(self, name), above_zero=True)
        for name in ("near_limit", "assist_rate"):
            _check(name, getattr(self, name), above_zero=False)
        _check("damping", self.inverse_damping, above_zero=False)
        # Feedback that corrects more than the whole error in a step is unstable.
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

    @property
    def inverse_damping(self) -> float:
        """Damping of the pseudo-inverse [m/rad], that of `limits` where `damping` is None."""
        if self.damping is not None:
            return self.damping
        return _DAMPING if self.limits == "clamped" else 0.0


def _is_posture(joints: FloatArray | tuple[float, ...]) -> bool:
    """Return whether a set-point is one finite number for each joint."""
    try:
        values = np.asarray(joints, dtype=np.float64)
    except (OverflowError, TypeError, ValueError):
        return False
    return values.shape == (JOINTS,) and bool(np.isfinite(values).all())


def _check(name: str, value: float, *, above_zero: bool) -> None:
    """Check that a setting is finite and large enough."""
    if math.isfinite(value) and (value > 0.0 or (value == 0.0 and not above_zero)):
        return
    allowed = "above 0" if above_zero else "0 or more"
    raise TcsError(f"teleop settings: {name} is {value!r}, but must be finite and {allowed}.")
