"""A scripted operator of the pick-and-place task.

Its results prove nothing about people: they show the effect of a base pose on one behaviour.

The operator moves the hand in submovements. Each is planned from the image, which shows the tool
late, misjudged along the view and not at all where the tool is outside of it. The operator plans in
the camera's frame and turns the plan into the base's by the angle that it has learnt so far: what
it has not learnt misdirects the hand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.control.resolved_rate import rotation_vector
from tcs_studies.pick_and_place.cup import CLOSING_TIME, CupState
from tcs_studies.pick_and_place.master import Coupling, Master
from tcs_studies.pick_and_place.phases import (
    FREE,
    NEXT,
    ORIENTED,
    TOLERANCE,
    Phase,
    Seen,
    Traits,
    target,
)
from tcs_studies.pick_and_place.slave import Control, orientation
from tcs_studies.pick_and_place.task import CIRCLE_RADIUS, CUP_RADIUS, Condition
from tcs_studies.pick_and_place.view import HeadCamera

_FELT = 0.3
"""Force that is felt as a contact [N]."""
_NEAR = 0.10
"""Distance from the target below which the operator waits for the effect of a submovement [m]."""
_SHORTEST = 0.3
"""Least time of a submovement [s]."""
_LEVEL = 0.15
"""Greatest perceived error of the orientation at which the cup is grasped [rad]."""
_PROGRESS = 0.95
"""Fraction of the smallest error so far below which an error is progress."""
_ANGLE_WEIGHT = 0.1
"""Distance that has the weight of a rotation of 1 rad in that error [m]."""
_FARTHEST_TRY, _GROWTH = 0.15, 1.3
"""Greatest distance of a recovery motion [m], and its growth from one to the next."""
_GROUP_TRIES = 2
"""Motions of joint group 1 in a phase, one in each direction, before the hand tries again."""
_HINDERED, _HINDERED_TURN = 0.03, 0.3
"""Distance [m] and rotation [rad] between hand and tool from which the tool visibly lags."""


@dataclass(slots=True)
class Experience:
    """What an operator has learnt."""

    turn: float = 0.0
    """Angle from the master's frame to the camera's that the operator compensates [rad]."""

    def learn(self, traits: Traits, angle: float) -> None:
        """Learn from one submovement.

        Args:
            traits: Traits of the operator.
            angle: The angle [rad].
        """
        self.turn += traits.learning * (traits.adaptation * angle - self.turn)


class Group(NamedTuple):
    """A motion of joint group 1, which replaces the motion of the hand for a time."""

    pause: float
    """Time until the group moves [s]."""
    turn: float
    """Rotation of the lead joint [rad]."""
    regrip: float
    """Time from its end until the hand moves [s]."""


class Operator:
    """One operator in one repetition: moves the hand, and opens and closes the gripper."""

    def __init__(
        self,
        traits: Traits,
        experience: Experience,
        condition: Condition,
        camera: HeadCamera,
        shoulder: FloatArray,
        *,
        control: Control,
        coupling: Coupling,
        rng: np.random.Generator,
    ) -> None:
        """Prepare for a repetition.

        Args:
            traits: Traits of the operator.
            experience: What the operator has learnt so far; updated in place.
            condition: The base pose.
            camera: The view.
            shoulder: Position of the first joint of the arm in the base [m], shape (3,).
            control: Control of the slave.
            coupling: Coupling of master and slave.
            rng: Random generator.
        """
        self.phase = Phase.APPROACH
        """The phase."""
        self.closing = False
        """Whether the gripper is commanded to close."""
        self.actions: list[float] = []
        """Times at which the gripper was commanded [s]; it closes first."""
        self.corrections = 0
        """Number of times that the cup stood partly outside the circle."""
        self.group: Group | None = None
        """Motion of joint group 1 to perform now; the performer sets it to None."""
        self._traits, self._condition, self._camera = traits, condition, camera
        self._experience = experience
        self._control, self._scale, self._rng = control, coupling.scale, rng
        self._round_trip = coupling.latency.command + coupling.latency.picture
        x, y, _ = condition.cup - shoulder
        self._heading = math.atan2(y, x)
        self._perception = Perception(traits, camera, rng)
        self._wait = traits.reaction
        self._from = self._by = (np.zeros(3), np.zeros(3))
        self._began = self._lasts = 0.0
        self._turned = 1.0
        self._accepted = False
        self._begin_phase(Phase.APPROACH)

    def advance(self, now: float, seen: Seen, master: Master) -> None:
        """Move the hand for one period.

        Args:
            now: Time since the start [s].
            seen: What the image shows and the hand feels.
            master: The master to move.
        """
        if now < self._began + self._lasts:
            if self.phase is Phase.LOWER and seen.force > _FELT:
                # The hand stops where it is; the reaction follows.
                self._began, self._lasts = now, 0.0
                self._wait = now + self._traits.touch_reaction
                self._felt = True
                return
            u = (now - self._began) / self._lasts
            s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
            master.move(self._from[0] + s * self._by[0], self._from[1] + s * self._by[1])
        elif now >= self._wait:
            self._act(now, seen, master)

    def _act(self, now: float, seen: Seen, master: Master) -> None:
        """Act on what is seen: press the gripper's button, or plan a submovement."""
        if self.phase is Phase.CLOSE:
            self._after_closing(now, seen)
        elif self.phase is Phase.OPEN:
            self._after_opening(now, seen)
        elif self.phase is Phase.REOPEN:
            self._begin_phase(Phase.ALIGN)
        else:
            self._plan(now, seen, master)

    def _plan(self, now: float, seen: Seen, master: Master) -> None:
        """Begin the next submovement, or the next phase where the target is reached."""
        traits = self._traits
        off = self._perception.displacement(now, self._target(seen) - seen.p, seen)
        turn = np.zeros(3)
        if self.phase not in FREE:
            turn = self._perception.rotation(seen, self._heading)
        distance, angle = (math.sqrt(part @ part) for part in (off, turn))
        oriented = angle <= _LEVEL or self.phase not in ORIENTED or self._accepted
        there = distance <= TOLERANCE[self.phase]
        if (there and oriented) or (self.phase is Phase.LOWER and self._felt):
            self._finish_phase(now, seen)
            return
        error = distance + (0.0 if oriented else _ANGLE_WEIGHT * angle)
        if self._is_stuck(error) and _hindered(seen, master):
            self._least, self._vain = math.inf, 0
            if self._control is Control.NULL_SPACE and self._groups_moved < _GROUP_TRIES:
                self._groups_moved += 1
                self._turned = -self._turned
                group_turn = math.copysign(traits.first_turn, self._turned)
                self.group = Group(traits.pointing, group_turn, traits.regrip)
                return
            if there:
                self._accepted = True
                return
            off = self._detour()
        lasts = max(_SHORTEST, distance / traits.speed, angle / traits.turn_speed)
        part = min(1.0, traits.submovement / lasts)
        self._move(now, part * off, part * turn, min(lasts, traits.submovement), master)
        # Far from the target, one submovement follows the other.
        pause = 0.0
        if (1.0 - part) * distance < _NEAR:
            pause = traits.reaction + self._round_trip
            pause += traits.mental_rotation * abs(self._camera.angle)
        self._wait = now + self._lasts + pause

    def _move(
        self, now: float, off: FloatArray, turn: FloatArray, lasts: float, master: Master
    ) -> None:
        """Begin a submovement of the hand, misdirected and with noise."""
        traits, rng = self._traits, self._rng
        misdirection = self._camera.angle - self._experience.turn
        self._experience.learn(traits, self._camera.angle)
        extent = 1.0 + traits.extent_noise * rng.standard_normal(2)
        tilt = traits.direction_noise * rng.standard_normal(3)
        by = extent[0] * _misdirected(off, misdirection)
        by = by + np.cross(tilt, by)
        turned = extent[1] * _misdirected(turn, misdirection)
        lever = math.sqrt(by @ by) / (self._scale * traits.forearm)
        turned = turned + lever * rng.standard_normal(3)
        # Roll and pitch are about the axes of the heading.
        c, s = math.cos(master.angles[2]), math.sin(master.angles[2])
        angles = np.array([c * turned[0] + s * turned[1], c * turned[1] - s * turned[0], turned[2]])
        self._from, self._by = (master.p, master.angles), (by, angles)
        self._began, self._lasts = now, lasts

    def _target(self, seen: Seen) -> FloatArray:
        """Return where the tool should be [m], shape (3,)."""
        ahead = np.array([math.cos(self._heading), math.sin(self._heading), 0.0])
        if self._accepted or self.phase is Phase.BACK:
            ahead = np.array([seen.R[0, 0], seen.R[1, 0], 0.0])
            ahead /= max(math.hypot(ahead[0], ahead[1]), 1e-9)
        return target(self.phase, seen, self._condition.place, ahead)

    def _finish_phase(self, now: float, seen: Seen) -> None:
        """Begin the next phase."""
        self._begin_phase(NEXT[self.phase])
        self._wait = now
        if self.phase is Phase.CLOSE:
            self._press(now, closing=True)
        elif self.phase is Phase.OPEN:
            self._press(now, closing=False)

    def _begin_phase(self, phase: Phase) -> None:
        if phase in (Phase.APPROACH, Phase.ALIGN):
            self._accepted = False
        self.phase = phase
        self._felt = False
        self._least, self._vain = math.inf, 0
        self._try = self._traits.first_try
        self._groups_moved = 0

    def _press(self, now: float, *, closing: bool) -> None:
        """Command the gripper, and wait until its motion is seen to be over."""
        self.closing = closing
        self.actions.append(now)
        self._wait = now + CLOSING_TIME + self._round_trip + self._traits.thinking

    def _after_closing(self, now: float, seen: Seen) -> None:
        """Lift a cup that is held; else open again."""
        if seen.state is CupState.HELD:
            self._begin_phase(Phase.LIFT)
        else:
            self._begin_phase(Phase.REOPEN)
            self._press(now, closing=False)

    def _after_opening(self, now: float, seen: Seen) -> None:
        """Retreat if the cup is in the circle, else grasp it again (thesis, III.C.1)."""
        off = seen.cup[:2] - self._condition.place[:2]
        if math.hypot(off[0], off[1]) <= CIRCLE_RADIUS - CUP_RADIUS:
            self._begin_phase(Phase.BACK)
            return
        self.corrections += 1
        self._begin_phase(Phase.CLOSE)
        self._press(now, closing=True)

    def _is_stuck(self, error: float) -> bool:
        """Return whether several submovements have brought no progress."""
        if error < _PROGRESS * self._least:
            self._least, self._vain = error, 0
        else:
            self._vain += 1
        return self._vain >= self._traits.patience

    def _detour(self) -> FloatArray:
        """Return a recovery motion in a random direction, larger each time [m], shape (3,)."""
        direction = self._rng.standard_normal(3)
        distance, self._try = self._try, min(_FARTHEST_TRY, _GROWTH * self._try)
        return np.asarray(direction * (distance / math.sqrt(direction @ direction)))


def _misdirected(off: FloatArray, angle: float) -> FloatArray:
    """Return a plan as the hand performs it: rotated by what the operator has not learnt."""
    # The image turns the other way than the camera.
    c, s = math.cos(angle), -math.sin(angle)
    return np.array([c * off[0] - s * off[1], s * off[0] + c * off[1], off[2]])


def _hindered(seen: Seen, master: Master) -> bool:
    """Return whether the tool is seen not to follow the hand."""
    off = master.p - seen.p
    turn = rotation_vector(orientation(*master.angles) @ seen.R.T)
    return bool(off @ off > _HINDERED**2 or turn @ turn > _HINDERED_TURN**2)


class Perception:
    """Perceived displacement and rotation of the tool, with errors that fade with time."""

    def __init__(self, traits: Traits, camera: HeadCamera, rng: np.random.Generator) -> None:
        """Draw the first errors.

        Args:
            traits: Traits of the operator.
            camera: The view.
            rng: Random generator of the errors.
        """
        self._traits, self._camera, self._rng = traits, camera, rng
        self._noise, self._time = rng.standard_normal(6), 0.0

    def displacement(self, now: float, off: FloatArray, seen: Seen) -> FloatArray:
        """Return the perceived displacement from the tool to its target [m], shape (3,).

        Args:
            now: Time since the start [s].
            off: The true displacement in the base [m], shape (3,).
            seen: What the image shows.
        """
        traits = self._traits
        kept = math.exp(-(now - self._time) / traits.misjudging_memory)
        fresh = self._rng.standard_normal(6)
        self._noise = kept * self._noise + math.sqrt(1.0 - kept * kept) * fresh
        self._time = now
        noise = self._noise[:3]
        if not self._camera.sees(seen.p):
            return off + traits.blind * noise
        std = traits.misjudging + traits.weber * math.sqrt(off @ off)
        return np.asarray(off + self._camera.R @ (std * noise * (traits.depth, 1.0, 1.0)))

    def rotation(self, seen: Seen, heading: float) -> FloatArray:
        """Return the perceived rotation from the tool to its orientation [rad], shape (3,).

        Args:
            seen: What the image shows.
            heading: Heading of the fingers about z in the base [rad].
        """
        turn = rotation_vector(orientation(0.0, 0.0, heading) @ seen.R.T)
        return turn + self._traits.misjudging_angle * self._noise[3:]
