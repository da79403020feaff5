"""Initial configurations: base pose, torso height, and state of the environment."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tcs.errors import TcsError

ENVIRONMENT_UNITS = ("m", "rad")
"""Units of the values of environment axes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InitialConfiguration:
    """Robot and environment before the task starts: h_j in the TCS paper [m, rad].

    The base pose is that of the robot's base in the environment frame W.
    """

    base_x: float
    """x of the base in W [m]."""
    base_y: float
    """y of the base in W [m]."""
    base_yaw: float
    """Heading of the base about z of W [rad]."""
    torso: float
    """Torso height [m]."""
    environment: tuple[tuple[str, float], ...] = ()
    """Name and value of each environment axis, e.g. ("bed_height", 0.2) [m, rad]."""
    environment_units: tuple[str, ...] = ()
    """Unit of each environment axis, "m" or "rad", in the order of `environment`."""

    def __post_init__(self) -> None:
        """Check that every environment axis has a unit.

        Raises:
            TcsError: If the units do not match the axes one by one.
        """
        if len(self.environment_units) != len(self.environment):
            raise TcsError(
                f"Initial configuration: {len(self.environment)} environment axes but "
                f"{len(self.environment_units)} units. Give one of {ENVIRONMENT_UNITS} for each."
            )
        for (name, _), unit in zip(self.environment, self.environment_units, strict=True):
            if unit not in ENVIRONMENT_UNITS:
                raise TcsError(
                    f"Initial configuration: axis '{name}' has unit '{unit}'. "
                    f"Allowed: {ENVIRONMENT_UNITS}."
                )

    def __repr__(self) -> str:
        """Return the configuration with its values rounded to 12 decimals.

        Grid values such as 0.8 + 2 x 0.05 then print as 0.9.
        """
        names = ("base_x", "base_y", "base_yaw", "torso")
        values = [f"{name}={round(float(getattr(self, name)), 12)!r}" for name in names]
        if self.environment:
            rounded = tuple((name, round(float(value), 12)) for name, value in self.environment)
            values += [f"environment={rounded}", f"environment_units={self.environment_units}"]
        return f"{type(self).__name__}({', '.join(values)})"

    def to_json(self) -> dict[str, float]:
        """Return the configuration as plain numbers, angles in degrees under `..._deg` names.

        Values are rounded to nine decimals, so that 29 steps of 0.05 m print as 1.45.

        >>> InitialConfiguration(
        ...     base_x=1.0, base_y=-0.5, base_yaw=0.0, torso=0.3,
        ...     environment=(("bed_height", 0.2),), environment_units=("m",),
        ... ).to_json()
        {'base_x': 1.0, 'base_y': -0.5, 'base_yaw_deg': 0.0, 'torso': 0.3, 'bed_height': 0.2}
        """
        plain = {
            "base_x": float(self.base_x),
            "base_y": float(self.base_y),
            "base_yaw_deg": math.degrees(self.base_yaw),
            "torso": float(self.torso),
        }
        for (name, value), unit in zip(self.environment, self.environment_units, strict=True):
            if unit == "rad":
                plain[f"{name}_deg"] = math.degrees(value)
            else:
                plain[name] = float(value)
        return {name: round(value, 9) for name, value in plain.items()}
