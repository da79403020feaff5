"""The joints of an environment: how far they go, and which of them follow which."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from pydrake.multibody.tree import Joint

from tcs.errors import EnvironmentFileError, GridError, TcsError, UnknownNameError
from tcs.model.grid import Axis
from tcs.model.scene.error_distribution import ErrorDistribution
from tcs.model.scene.posture import Posture

_ROUNDING = 1e-9
"""How far a position may be past a limit [m or rad]: 3 * 0.1 is a hair more than 0.3, and limits
in a model file are rounded."""


@dataclass(frozen=True, slots=True)
class EnvironmentJoints:
    """Every joint of the environment that moves.

    Attributes:
        by_name: The joints.
        posture: For each leading joint what follows it.
    """

    by_name: dict[str, Joint]
    posture: Mapping[str, Posture]

    def turns(self, name: str) -> bool:
        """Return whether a joint turns (rad); else it slides (m)."""
        return bool(self.by_name[name].type_name() == "revolute")

    def limits(self, name: str) -> tuple[float, float]:
        """Return how far a joint may go [m or rad]: by its model, and by the knots it leads.

        Raises:
            EnvironmentFileError: If it is neither a turning nor a sliding joint.
        """
        joint = self.by_name[name]
        if joint.num_positions() != 1:
            raise EnvironmentFileError(
                f"joint '{name}' is {joint.type_name()}, but only joints that turn about one axis "
                "(revolute) or slide along one (prismatic) can be set."
            )
        lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if name in self.posture:
            knots = self.posture[name].leading
            lower, upper = max(lower, knots[0]), min(upper, knots[-1])
        return float(lower), float(upper)

    def positions(
        self, name: str, position: float, *, where: str, error: type[TcsError] = TcsError
    ) -> Iterator[tuple[Joint, float]]:
        """Yield the joint and every joint that follows it, with the positions they take.

        Args:
            name: The joint to move.
            position: Where to [m or rad].
            where: Where that is asked for, for the message.
            error: What to raise for a position that is none of the joint's.

        Raises:
            UnknownNameError: If there is no such joint.
            TcsError: As `error`, if the joint follows another one, or does not go that far.
        """
        self._check_free(name, where, error)
        self._check_position(name, position, f"{where}, joint '{name}'", error)
        yield self.by_name[name], position
        if name in self.posture:
            for follower, at in self.posture[name].positions(position).items():
                yield self.by_name[follower], at

    def check_axis(self, axis: Axis, *, where: str) -> None:
        """Refuse an axis whose values its joint cannot take.

        Raises:
            UnknownNameError: If no joint has the axis's name.
            GridError: If the joint follows another one, is of another unit, or does not go as far.
        """
        self._check_free(axis.name, where, GridError, kind="environment axis")
        unit = "deg" if self.turns(axis.name) else "m"
        if axis.unit != unit:
            raise GridError(
                f"{where}, axis '{axis.name}': unit is '{axis.unit}', but the joint is "
                f"{self.by_name[axis.name].type_name()}, so it must be '{unit}'."
            )
        for value in (axis.values[0], axis.values[-1]):
            self._check_position(axis.name, float(value), f"{where}, axis '{axis.name}'", GridError)

    def check_error(self, name: str, error: ErrorDistribution, *, where: str) -> None:
        """Refuse an error of a joint that cannot have it.

        Raises:
            UnknownNameError: If there is no such joint.
            EnvironmentFileError: If the joint follows another one, or the error's unit is another.
        """
        self._check_free(name, where, EnvironmentFileError)
        if self.turns(name) != error.turns:
            right = error.width_key[self.turns(name)]
            raise EnvironmentFileError(
                f"{where}, joint '{name}': it is {self.by_name[name].type_name()}, so give "
                f"'{right}'."
            )

    def check_posture(self, *, where: str) -> None:
        """Refuse a posture that names joints there are not, or asks them to go too far.

        Raises:
            UnknownNameError: If a joint is not there.
            EnvironmentFileError: If a joint's unit or limits do not fit.
        """
        for leader, posture in self.posture.items():
            here = f"{where}, field 'posture.{leader}'"
            for name in (leader, *posture.joints):
                if name not in self.by_name:
                    raise UnknownNameError("joint", name, self.by_name, where=here)
            if self.turns(leader) != posture.turns:
                key = "knots_deg" if self.turns(leader) else "knots"
                raise EnvironmentFileError(
                    f"{here}: the joint is {self.by_name[leader].type_name()}, so give '{key}'."
                )
            for name, positions in posture.joints.items():
                for position in positions:
                    self._check_position(
                        name, position, f"{here}, joint '{name}'", EnvironmentFileError
                    )

    def set_defaults(self, positions: Mapping[str, float], *, where: str) -> None:
        """Let the joints stand at these positions from the start, the others at 0.

        Raises:
            UnknownNameError: If a joint is not there.
            EnvironmentFileError: If a joint follows another one, or does not go that far.
        """
        leaders = {name: 0.0 for name in self.posture if name not in positions}
        for name, position in {**leaders, **positions}.items():
            for joint, at in self.positions(
                name, position, where=where, error=EnvironmentFileError
            ):
                joint.set_default_positions([at])

    def _check_free(
        self, name: str, where: str, error: type[TcsError], *, kind: str = "joint"
    ) -> None:
        """Refuse a joint that is not there, or not free to be set."""
        for leader, posture in self.posture.items():
            if name in posture.joints:
                raise error(
                    f"{where}: joint '{name}' follows '{leader}' (field 'posture'), so it cannot "
                    f"be set. Set '{leader}', or take '{name}' out of the posture."
                )
        if name not in self.by_name:
            raise UnknownNameError(kind, name, self.by_name, where=where)

    def _check_position(
        self, name: str, position: float, where: str, error: type[TcsError]
    ) -> None:
        """Refuse a position that a joint cannot take."""
        lower, upper = self.limits(name)
        # Written so that "not a number" is refused as well.
        if lower - _ROUNDING <= position <= upper + _ROUNDING:
            return
        unit, scale = ("deg", math.degrees(1.0)) if self.turns(name) else ("m", 1.0)
        raise error(
            f"{where}: {position * scale:g} {unit} is beyond the joint's limits, "
            f"{lower * scale:g} to {upper * scale:g} {unit}. Stay within, or widen the limits in "
            "its model."
        )
