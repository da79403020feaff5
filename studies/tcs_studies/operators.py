"""Scripted operators: models of people in the trajectory-following experiment.

Their results prove nothing about people. They make the experiment repeatable and show the effect of
a controller on identical behaviour.

An operator behaves in the same way with every controller: it pursues the line with a reaction delay
and tremor; when the arm stops, it thinks and tries a recovery; if that does not help, it tries
another, larger one. The controller determines only the type of recovery (`Recovery`):

- end-effector control: hand motions in random directions with random rotations;
- the novel controller: motion of joint group 1 in either direction.

A successful recovery is remembered and tried first the next time. Nothing else is learnt, and
operators begin without experience.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.control.resolved_rate import pose_error
from tcs.teleop.control.session import Step
from tcs.teleop.control.settings import Command, Mode, Settings
from tcs.teleop.line import Line


class Recovery(StrEnum):
    """Recovery of an operator when the arm stops."""

    HAND = "hand"
    """Translation and rotation of the hand."""
    GROUP = "group"
    """Motion of joint group 1, counted from 1, while the tool is held."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatorTraits:
    """Behaviour of one operator, the same with every controller.

    The values were set before the first run, to those usual for adults at slow and careful work,
    and never fitted to results. `drawn` varies them over operators.

    Attributes:
        speed: Speed of the hand [m/s]: 1 m in 17 s, for "as accurately as possible".
        reaction: Time from an event to the reaction of the hand [s]; simple reactions take 0.2 to
            0.3 s.
        thinking: Time from the perceived stop of the arm to the next recovery [s].
        pointing: Time to take the other device, point at the joint on the interface and press [s].
        regrip: Time to take the first device again [s].
        muscle: Time constant of the hand's speed [s].
        lookahead: Distance ahead on the line at which the operator aims [m].
        misjudging: Standard deviation of the perceived tool position, each coordinate [m].
        misjudging_memory: Time constant of the misjudgement [s].
        tremor: Standard deviation of the hand's speed as a fraction of the speed:
            signal-dependent noise (Harris and Wolpert, Nature 394, 1998).
        tremor_rest: Speed added to the speed of the hand before that fraction is taken, for tremor
            at rest [m/s].
        tremor_memory: Time constant of the tremor [s].
        first_try: Distance of the first recovery motion of the hand [m].
        turn_per_metre: Rotation of the hand per distance in a recovery [rad/m].
        first_turn: Rotation of group 1 in the first recovery [rad].
        growth: Growth factor from one recovery to the next.
    """

    speed: float = 0.06
    reaction: float = 0.25
    thinking: float = 1.0
    pointing: float = 1.5
    regrip: float = 0.5
    muscle: float = 0.15
    lookahead: float = 0.1
    misjudging: float = 0.008
    misjudging_memory: float = 2.0
    tremor: float = 0.1
    tremor_rest: float = 0.01
    tremor_memory: float = 0.2
    first_try: float = 0.05
    turn_per_metre: float = 5.0
    first_turn: float = 0.35
    growth: float = 1.3

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> OperatorTraits:
        """Return random traits, log-normal with a standard deviation of 0.2 of the logarithm."""
        usual = cls()
        varied = (
            "speed", "reaction", "thinking", "pointing", "regrip", "misjudging", "tremor",
            "first_try", "first_turn",
        )  # fmt: skip
        spread = np.exp(0.2 * rng.standard_normal(len(varied)))
        changes = {
            name: float(getattr(usual, name) * factor)
            for name, factor in zip(varied, spread, strict=True)
        }
        return replace(usual, **changes)


@dataclass(slots=True)
class Experience:
    """Successful recoveries with one controller, by the number of the obstacle on the line."""

    motions: dict[int, FloatArray] = field(default_factory=dict)
    """Rotation and translation of the tool from its pose at the stop [rad; m], shape (6,)."""
    turns: dict[int, float] = field(default_factory=dict)
    """Rotation of group 1 [rad]."""


class _Phase(StrEnum):
    READY = "ready"
    FOLLOW = "follow"
    THINK = "think"
    TRY = "try"
    TO_GROUP = "to group"
    TURN = "turn"
    TO_TOOL = "to tool"


_PAST = 0.05
"""Fraction of the line beyond an obstacle at which the obstacle is passed."""
_FARTHEST_TRY = 0.3
"""Greatest distance of a recovery [m]: a third of the arm's reach."""
_FARTHEST_TURN = 1.6
"""Greatest rotation of the group in a recovery [rad]: a right angle."""


class ScriptedOperator:
    """One operator in one trial: returns a command for each step of the arm."""

    def __init__(
        self,
        traits: OperatorTraits,
        habits: Experience,
        line: Line,
        *,
        approach: Recovery,
        mode: Mode,
        settings: Settings,
        rng: np.random.Generator,
    ) -> None:
        """Prepare for a trial.

        Args:
            traits: Traits of the operator.
            habits: Successful recoveries so far; updated in place.
            line: The line to follow.
            approach: Recovery when the arm stops.
            mode: The mode in which the hand moves the tool.
            settings: Settings of the controller.
            rng: Random generator.
        """
        self._traits, self._habits, self._line = traits, habits, line
        self._approach, self._mode, self._settings = approach, mode, settings
        self._rng = rng
        period = settings.period
        self._seen: deque[Step] = deque(maxlen=1 + round(traits.reaction / period))
        self._misjudged = GaussMarkovProcess(
            rng, std=traits.misjudging, memory=traits.misjudging_memory, period=period
        )
        self._trembling = GaussMarkovProcess(
            rng, std=1.0, memory=traits.tremor_memory, period=period
        )
        self._velocity, self._spin = np.zeros(3), np.zeros(3)
        self._time = 0.0
        # The reaction to the start signal comes before the hand moves.
        self._begin(_Phase.READY, traits.reaction)
        self._obstacle, self._tries, self._farthest = -1, 0, -np.inf
        self._where: Step | None = None
        """Step at which the arm stopped at the current obstacle."""
        self._motion, self._moved = np.zeros(6), np.zeros(6)
        self._turn, self._turned = 0.0, 0.0

    def command(self, step: Step) -> Command:
        """Return the command of the next period, after the arm's last step."""
        self._time = step.time
        self._seen.append(step)
        self._misjudged.advance()
        self._trembling.advance()
        seen = self._seen[0]
        # A stop observed before this phase began has been handled.
        stopped = seen.stopped and seen.time > self._began
        over = self._time - self._began >= self._lasts - 0.5 * self._settings.period
        aim, spin = np.zeros(3), np.zeros(3)
        if self._phase is _Phase.FOLLOW:
            place = seen.p + self._misjudged.value
            fraction = float(self._line.fraction_at(place))
            if stopped:
                self._stop(seen, fraction)
            else:
                self._learn(fraction)
                aim = self._pursue(place, fraction)
        elif self._phase is _Phase.TRY:
            spin, aim = self._motion[:3] / self._lasts, self._motion[3:] / self._lasts
            if over or stopped:
                self._end_try(step, stopped=stopped)
        elif self._phase is _Phase.TURN:
            if over or stopped:
                self._end_turn(stopped=stopped)
        elif over:
            self._go_on()
        return self._commanded(aim, spin)

    def _commanded(self, aim: FloatArray, spin: FloatArray) -> Command:
        """Return the command: the intended motion after muscle dynamics and tremor."""
        traits = self._traits
        fraction = self._settings.period / (traits.muscle + self._settings.period)
        self._velocity = self._velocity + fraction * (aim - self._velocity)
        self._spin = self._spin + fraction * (spin - self._spin)
        if self._phase in (_Phase.TO_GROUP, _Phase.TO_TOOL):
            return Command(clutch=True)
        if self._phase is _Phase.TURN:
            return Command(group=0, sign=int(np.sign(self._turn)), mode=Mode.NULL_SPACE)
        strength = traits.tremor * (float(np.linalg.norm(self._velocity)) + traits.tremor_rest)
        linear = self._velocity + strength * self._trembling.value
        return Command(linear=linear, angular=self._spin, mode=self._mode)

    def _begin(self, phase: _Phase, lasts: float = math.inf) -> None:
        self._phase, self._began, self._lasts = phase, self._time, lasts

    def _pursue(self, place: FloatArray, fraction: float) -> FloatArray:
        """Return the velocity towards a point ahead on the line [m/s]."""
        traits, line = self._traits, self._line
        ahead = line.at(min(1.0, max(0.0, fraction) + traits.lookahead / line.length)) - place
        distance = float(np.linalg.norm(ahead))
        # Within `speed` x 1 s of the aim, the speed decreases in proportion to the distance.
        return np.asarray(ahead * (min(traits.speed, distance) / max(distance, 1e-9)))

    def _stop(self, seen: Step, fraction: float) -> None:
        """Record a stop of the arm, at the same obstacle as before or at the next one."""
        if fraction > self._farthest + _PAST:
            self._obstacle += 1
            self._tries = 0
            self._where = seen
            self._turn, self._turned = 0.0, 0.0
        self._farthest = max(self._farthest, fraction)
        self._begin(_Phase.THINK, self._traits.thinking)

    def _learn(self, fraction: float) -> None:
        """Remember a successful recovery, once the obstacle is passed."""
        if self._tries and fraction > self._farthest + _PAST:
            if self._approach is Recovery.GROUP:
                self._habits.turns[self._obstacle] = self._turned
            else:
                self._habits.motions[self._obstacle] = self._moved
            self._tries = 0

    def _go_on(self) -> None:
        """Begin the phase that follows one whose time is over."""
        if self._phase is _Phase.THINK:
            self._tries += 1
            if self._approach is Recovery.GROUP:
                self._turn = self._next_turn()
                self._begin(_Phase.TO_GROUP, self._traits.pointing)
            else:
                self._motion = self._next_motion()
                rotation, distance = (
                    float(np.linalg.norm(part)) for part in np.split(self._motion, 2)
                )
                pace = self._traits.speed
                lasts = max(distance / pace, rotation / (pace * self._traits.turn_per_metre))
                # A remembered motion may be tiny, but takes some time.
                self._begin(_Phase.TRY, max(lasts, self._traits.muscle))
        elif self._phase is _Phase.TO_GROUP:
            self._begin(_Phase.TURN, abs(self._turn) / self._settings.group_rate)
        else:
            self._begin(_Phase.FOLLOW)

    def _next_motion(self) -> FloatArray:
        """Return the next recovery motion of the hand, rotation and translation, shape (6,)."""
        if self._tries == 1 and self._obstacle in self._habits.motions:
            return self._habits.motions[self._obstacle]
        traits = self._traits
        distance = min(_FARTHEST_TRY, traits.first_try * traits.growth ** (self._tries - 1))
        directions = self._rng.standard_normal((2, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return np.concatenate(
            [distance * traits.turn_per_metre * directions[0], distance * directions[1]]
        )

    def _next_turn(self) -> float:
        """Return the next rotation of group 1 [rad]."""
        if self._tries == 1 and self._obstacle in self._habits.turns:
            return self._habits.turns[self._obstacle]
        traits = self._traits
        more = min(_FARTHEST_TURN, traits.first_turn * traits.growth ** (self._tries - 1))
        if self._turn and abs(self._turned) + more <= math.pi:
            return math.copysign(more, self._turn)
        # Reverse at the first try, if the direction is blocked, or if half a turn does not help.
        direction = (
            -math.copysign(1.0, self._turned) if self._turned else self._rng.choice([-1.0, 1.0])
        )
        return float(direction * (abs(self._turned) + more))

    def _end_try(self, now: Step, *, stopped: bool) -> None:
        """Resume the line after a recovery; think again if the arm stopped during it."""
        assert self._where is not None
        self._moved = pose_error(now.R, now.p, self._where.R, self._where.p)
        if stopped:
            self._begin(_Phase.THINK, self._traits.thinking)
        else:
            self._begin(_Phase.FOLLOW)

    def _end_turn(self, *, stopped: bool) -> None:
        """Return to the tool after a group motion; a blocked direction is not tried again."""
        turned = (self._time - self._began) * self._settings.group_rate
        self._turned += math.copysign(turned, self._turn)
        if stopped:
            self._turn = 0.0
        self._begin(_Phase.TO_TOOL, self._traits.regrip)


class GaussMarkovProcess:
    """A stationary second-order Gauss-Markov process of three independent coordinates.

    Each coordinate is a critically damped second-order system driven by white noise, in the steady
    state from the first sample on: its variance depends neither on time nor on the sampling period.
    """

    def __init__(
        self, rng: np.random.Generator, *, std: float, memory: float, period: float
    ) -> None:
        """Draw the initial state from the steady state.

        Args:
            rng: Generator of the noise.
            std: Standard deviation of each coordinate.
            memory: Time constant of the correlation [s].
            period: Sampling period [s].
        """
        a = 1.0 / memory
        fade = math.exp(-a * period)
        self._rng = rng
        # The exact solution over one period of x'' = -2 a x' - a^2 x + noise.
        self._transition = fade * np.array(
            [[1.0 + a * period, period], [-a * a * period, 1.0 - a * period]]
        )
        steady = std * std * np.diag([1.0, a * a])
        noise = steady - self._transition @ steady @ self._transition.T
        # Rounding may leave an eigenvalue slightly below zero where periods are short.
        values, vectors = np.linalg.eigh(noise)
        self._spread = vectors * np.sqrt(np.maximum(values, 0.0))
        self._state = std * np.array([[1.0], [a]]) * rng.standard_normal((2, 3))

    @property
    def value(self) -> FloatArray:
        """Current value, shape (3,)."""
        return np.array(self._state[0])

    @property
    def rate(self) -> FloatArray:
        """Current rate of change [1/s], shape (3,)."""
        return np.array(self._state[1])

    def advance(self) -> None:
        """Advance by one period."""
        drive = self._spread @ self._rng.standard_normal((2, 3))
        self._state = self._transition @ self._state + drive
