"""The joints of an environment: their limits, and which of them follow others."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from pydrake.multibody.tree import Joint

from tcs.errors import EnvironmentFileError, GridError, TcsError, UnknownNameError
from tcs.model.grid import Axis
from tcs.model.scene.environment.error_distribution import ErrorDistribution
from tcs.model.scene.person.posture import Posture

_ROUNDING = 1e-9
"""Tolerance of the limits [m or rad]: 3 * 0.1 is greater than 0.3, and limits in model files are
rounded."""


@dataclass(frozen=True, slots=True)
class EnvironmentJoints:
    """The movable joints of an environment.

    Attributes:
        by_name: The joints.
        posture: For each leading joint the joints that follow it.
    """

    by_name: dict[str, Joint]
    posture: Mapping[str, Posture]

    def is_revolute(self, name: str) -> bool:
        """Return whether a joint is revolute [rad]; otherwise it is prismatic [m]."""
        return bool(self.by_name[name].type_name() == "revolute")

    def limits(self, name: str) -> tuple[float, float]:
        """Return the limits of a joint [m or rad]: those of its model and of its posture's knots.

        Raises:
            EnvironmentFileError: If it is neither revolute nor prismatic.
        """
        joint = self.by_name[name]
        if joint.num_positions() != 1:
            raise EnvironmentFileError(
                f"joint '{name}' is {joint.type_name()}, but only revolute and prismatic joints "
                "can be set."
            )
        lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if name in self.posture:
            knots = self.posture[name].leading
            lower, upper = max(lower, knots[0]), min(upper, knots[-1])
        return float(lower), float(upper)

    def default(self, name: str) -> float:
        """Return the position of a joint in the state of the environment's file [m or rad]."""
        return float(self.by_name[name].default_positions()[0])

    def positions(
        self, name: str, position: float, *, where: str, error: type[TcsError] = TcsError
    ) -> Iterator[tuple[Joint, float]]:
        """Yield the joint and every joint that follows it, with their positions.

        Args:
            name: The joint to move.
            position: Its new position [m or rad].
            where: The source of the position, for the message.
            error: Class of the error to raise for a joint or position that cannot be set.

        Raises:
            UnknownNameError: If there is no such joint.
            TcsError: As `error`, if the joint follows another one, or would exceed its limits.
        """
        self._check_free(name, where, error)
        self._check_position(name, position, f"{where}, joint '{name}'", error)
        yield self.by_name[name], position
        if name in self.posture:
            for follower, at in self.posture[name].positions(position).items():
                yield self.by_name[follower], at

    def check_axis(self, axis: Axis, *, where: str) -> None:
        """Check that the joint of an axis can take the values of the axis.

        Raises:
            UnknownNameError: If no joint has the axis's name.
            GridError: If the joint follows another one, the unit differs, or a value exceeds the
                limits.
        """
        self._check_free(axis.name, where, GridError, noun="environment axis")
        unit = "deg" if self.is_revolute(axis.name) else "m"
        if axis.unit != unit:
            raise GridError(
                f"{where}, axis '{axis.name}': unit is '{axis.unit}', but the joint is "
                f"{self.by_name[axis.name].type_name()}, so it must be '{unit}'."
            )
        for value in (axis.values[0], axis.values[-1]):
            self._check_position(axis.name, float(value), f"{where}, axis '{axis.name}'", GridError)

    def check_error(self, name: str, error: ErrorDistribution, *, where: str) -> None:
        """Check that an error distribution fits its joint.

        Raises:
            UnknownNameError: If there is no such joint.
            EnvironmentFileError: If the joint follows another one, or the unit differs.
        """
        self._check_free(name, where, EnvironmentFileError)
        if self.is_revolute(name) != error.is_revolute:
            right = error.width_key[self.is_revolute(name)]
            raise EnvironmentFileError(
                f"{where}, joint '{name}': it is {self.by_name[name].type_name()}, so give "
                f"'{right}'."
            )

    def check_posture(self, *, where: str) -> None:
        """Check that every posture fits its joints.

        Raises:
            UnknownNameError: If a posture names a joint that does not exist.
            EnvironmentFileError: If a unit differs, or a position exceeds the limits of its joint.
        """
        for leader, posture in self.posture.items():
            here = f"{where}, field 'posture.{leader}'"
            for name in (leader, *posture.joints):
                if name not in self.by_name:
                    raise UnknownNameError("joint", name, self.by_name, where=here)
            if self.is_revolute(leader) != posture.is_revolute:
                key = "knots_deg" if self.is_revolute(leader) else "knots"
                raise EnvironmentFileError(
                    f"{here}: the joint is {self.by_name[leader].type_name()}, so give '{key}'."
                )
            for name, positions in posture.joints.items():
                for position in positions:
                    self._check_position(
                        name, position, f"{here}, joint '{name}'", EnvironmentFileError
                    )

    def set_defaults(self, positions: Mapping[str, float], *, where: str) -> None:
        """Set default positions: the given ones, and 0 for other joints that lead a posture.

        Raises:
            UnknownNameError: If there is no joint of a given name.
            EnvironmentFileError: If a joint follows another one, or a position exceeds its limits.
        """
        leaders = {name: 0.0 for name in self.posture if name not in positions}
        for name, position in {**leaders, **positions}.items():
            for joint, at in self.positions(
                name, position, where=where, error=EnvironmentFileError
            ):
                joint.set_default_positions([at])

    def _check_free(
        self, name: str, where: str, error: type[TcsError], *, noun: str = "joint"
    ) -> None:
        """Check that a joint exists and does not follow another one."""
        for leader, posture in self.posture.items():
            if name in posture.joints:
                raise error(
                    f"{where}: joint '{name}' follows '{leader}' (field 'posture'), so it cannot "
                    f"be set. Set '{leader}', or remove '{name}' from the posture."
                )
        if name not in self.by_name:
            raise UnknownNameError(noun, name, self.by_name, where=where)

    def _check_position(
        self, name: str, position: float, where: str, error: type[TcsError]
    ) -> None:
        """Check that a position is within the limits of a joint."""
        lower, upper = self.limits(name)
        # In this form the comparison is false for nan as well.
        if lower - _ROUNDING <= position <= upper + _ROUNDING:
            return
        unit, scale = ("deg", math.degrees(1.0)) if self.is_revolute(name) else ("m", 1.0)
        raise error(
            f"{where}: {position * scale:g} {unit} is beyond the joint's limits, "
            f"{lower * scale:g} to {upper * scale:g} {unit}. Choose a value within, or widen the "
            "limits in its model."
        )
