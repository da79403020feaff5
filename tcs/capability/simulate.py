"""A recording without an operator: a random hand at the master, and a slave that follows it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.capability.reach import Reach
from tcs.capability.recording import Recording
from tcs.errors import DataFileError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.follow import Control, Hand

MASTER_BOX = (0.070, 0.160, 0.120)
"""Depth, width and height that a hand can move a Geomagic Touch in [m]: forward, left, up."""
PERIOD = 0.02
"""Between samples [s]: joint states come at 50 Hz, ITCM thesis, Appendix C.1."""
LONGEST = 86_400.0
"""What may be asked for [s]: a day, 27 times the thesis's recording, fits into memory."""
_JOINT_SPEED = 1.76
"""Most speed of any joint [rad/s]: that of TIAGo's slowest, the wrist's."""
_LEAD = 0.10
"""How far a hand leads the tool before it waits for it [m]."""
_PATIENCE = 1.0
"""How long it waits [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Operator:
    """What the hand at the master does, as the slave's tool is told of it.

    The defaults are those of the recording in the ITCM thesis as far as it states them: height,
    roll and pitch fixed, an hour. Scale, centre, heading and speed of the hand it does not state.
    """

    height: float = 0.41
    """Of the tool above the floor [m]."""
    seconds: float = 3200.0
    """How long is recorded: 53 min and 17 s, as in Appendix C.1."""
    scale: float = 7.5
    """Metres of the slave per metre of the master: 0.16 m become the 1.2 m that were sampled."""
    centre: tuple[float, float] = (0.65, 0.0)
    """Of the box in front of the robot, x and y in B [m]."""
    headings: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    """Between which the hand turns the tool [rad]."""
    pitch: float = 0.0
    """Of the tool [rad]; a quarter turn for top grasps."""
    speed: float = 0.15
    """Mean speed asked of the slave's tool [m/s]."""
    turn_speed: float = 0.5
    """Mean speed of turning asked of it [rad/s]."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """What the slave did."""

    recording: Recording
    position_error: FloatArray
    """From the command to the tool [m], shape (n,)."""
    turn_error: FloatArray
    """The same for the orientation [rad], shape (n,)."""
    held: BoolArray
    """Whether the arm held still as it would have touched something, shape (n,)."""


def simulate(reach: Reach, operator: Operator, *, seed: int = 0) -> Simulated:
    """Return what an operator would have recorded.

    Args:
        reach: The robot, at the lift to record at.
        operator: What the hand does.
        seed: Of the hand's motion.

    Raises:
        DataFileError: If the box lies where the arm cannot start.

    Source:
        The "complete simulation" that the ITCM thesis names as future work, Appendix C.4: scaling
        between master and slave, joint limits, self-collision. Its slave's controller is not
        published; this one is resolved-rate control with damped least squares.
    """
    rng = np.random.default_rng(seed)
    numbers = (operator.seconds, operator.height, operator.scale, *operator.centre)
    if not (np.all(np.isfinite(numbers)) and PERIOD <= operator.seconds <= LONGEST):
        raise DataFileError(
            f"a recording of {operator.seconds:g} s at {operator.height:g} m: numbers must be "
            f"finite, and the time from {PERIOD:g} to {LONGEST:,.0f} s."
        )
    count = round(operator.seconds / PERIOD)
    depth, width = (operator.scale * side for side in MASTER_BOX[:2])
    # A path from one end of the box to the other takes some seconds; no hand outruns this many.
    middle = np.array([*operator.centre, np.mean(operator.headings)])
    span = np.array([depth, width, operator.headings[1] - operator.headings[0]])
    targets = middle + span * rng.uniform(-0.5, 0.5, (count, 3))
    R_ET = _commands(operator, np.zeros(1), np.zeros(1), np.zeros(1))[0][0]
    hand = Hand(
        targets, operator.height, R_ET, operator.speed, operator.turn_speed, _LEAD, _PATIENCE
    )
    joints, commands, held = reach.follow(_start(reach, operator), hand, _control(), count)
    R_BC, p_BC = _commands(operator, *commands.T)
    R_AT, p_AT = reach.tool_poses(joints)
    off = p_BC - (p_AT @ reach.R_BA.T + reach.p_BA)
    turned = np.linalg.norm(R_BC - reach.R_BA @ R_AT, axis=(1, 2)) / math.sqrt(8.0)
    return Simulated(
        Recording(joints, np.full(count, float(reach.lift))),
        np.linalg.norm(off, axis=1),
        2.0 * np.arcsin(np.minimum(turned, 1.0)),
        held,
    )


def _control() -> Control:
    return Control(
        period=PERIOD,
        gain=4.0,
        speed=0.4,
        turn_speed=1.5,
        # Gives way on orientation first, as the thesis's slave does, and by as much: the pitch of
        # what is recorded is then 0.011 rad off, 0.013 there (Table 3).
        lever=0.6,
        damping=0.02,
        centring=0.3,
        joint_speed=np.full(7, _JOINT_SPEED),
    )


def _commands(
    operator: Operator, x: FloatArray, y: FloatArray, heading: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return commanded tool poses in B: rotations (n, 3, 3) and positions [m] (n, 3)."""
    cp, sp = math.cos(operator.pitch), math.sin(operator.pitch)
    c, s = np.cos(heading), np.sin(heading)
    R = np.zeros((len(x), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 0, 2] = c * cp, -s, c * sp
    R[:, 1, 0], R[:, 1, 1], R[:, 1, 2] = s * cp, c, s * sp
    R[:, 2, 0], R[:, 2, 2] = -sp, cp
    return R, np.column_stack([x, y, np.full(len(x), operator.height)])


def _start(reach: Reach, operator: Operator) -> FloatArray:
    """Return the best posture at one of the places in the box, nearest to its middle first."""
    depth, width = (operator.scale * side for side in MASTER_BOX[:2])
    grid = np.linspace(-0.5, 0.5, 9)
    i, j, k = (axis.ravel() for axis in np.meshgrid(grid, grid, grid, indexing="ij"))
    order = np.argsort(i**2 + j**2 + k**2, kind="stable")
    middle, span = np.mean(operator.headings), operator.headings[1] - operator.headings[0]
    R, p = _commands(
        operator,
        operator.centre[0] + depth * i[order],
        operator.centre[1] + width * j[order],
        middle + span * k[order],
    )
    solved = reach.solve(R, p)
    if not solved.reached.any():
        raise DataFileError(
            f"the arm cannot start: no place in the box of {depth:.2f} x {width:.2f} m about "
            f"x {operator.centre[0]:g}, y {operator.centre[1]:g} m at a height of "
            f"{operator.height:g} m is reached at a lift of {reach.lift:g} m."
        )
    return np.array(solved.joints[int(np.argmax(solved.reached))], dtype=np.float64)
