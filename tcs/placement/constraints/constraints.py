"""Constraints that every member of a selected set satisfies, and preferences."""

from __future__ import annotations

from dataclasses import dataclass, fields

from tcs.errors import SelectionError
from tcs.model.grid import AxisCondition
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.constraints.preferences import check_preference
from tcs.placement.constraints.regions import Region


@dataclass(frozen=True, slots=True, kw_only=True)
class Constraints:
    """Constraints that every member of a selected set satisfies, and preferences."""

    only: tuple[str, ...] = ()
    """Conditions on axes of the grid, e.g. "head_rest >= 35 deg"; see `AxisCondition`."""
    keep: tuple[str, ...] = ()
    """Axes that stay as they are now, e.g. "bed_height"."""
    forbid: tuple[Region, ...] = ()
    """Regions of the floor on which the robot must not stand."""
    blocked: tuple[Obstacle, ...] = ()
    """Obstacles that neither the robot's body nor its arm may touch."""
    prefer: tuple[str, ...] = ()
    """Preferences, each of which a set may violate at a cost (`UtilityWeights.preference`): a side
    of the person, "left", "right", "head" or "foot", or a condition on an axis."""

    def __post_init__(self) -> None:
        """Turn lists into tuples, and check the form of the constraints.

        Raises:
            SelectionError: If a field is a single text, or holds another type than it should.
            GridError: If a condition is not of the form of `AxisCondition`.
            UnknownNameError: If a condition has an unknown unit.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, str):
                raise SelectionError(
                    f"Constraint {field.name} is the text '{value}'; must be a tuple of them."
                )
            object.__setattr__(self, field.name, tuple(value))
        for name, type_ in (
            ("only", str),
            ("keep", str),
            ("forbid", Region),
            ("blocked", Obstacle),
        ):
            for value in getattr(self, name):
                if not isinstance(value, type_):
                    raise SelectionError(
                        f"Constraint {name} holds {value!r}; must be of type {type_.__name__}."
                    )
        for text in self.only:
            AxisCondition.parse(text)
        for text in self.prefer:
            check_preference(text)

    @property
    def exclude(self) -> bool:
        """Whether any set may be excluded, rather than disliked."""
        return bool(self.only or self.keep or self.forbid or self.blocked)
