"""Posture: joints of the person that follow a joint of the furniture, piecewise linearly."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from tcs.files.documents import MAX_ENTRIES, AngleDeg, Document, JointPosition, Position

MIN_SPACING = 1e-6
"""Least distance of neighbouring knots [m or deg]; below it the slope between them is undefined."""
Enough = Field(min_length=2, max_length=MAX_ENTRIES)


class Posture(Document):
    """Positions of joints that follow a leading joint, at some positions (knots) of that joint.

    Positions are interpolated linearly between knots. They are undefined beyond the outer knots,
    which therefore limit the leading joint.

    >>> posture = Posture(knots_deg=(0, 40, 80), joints={"neck": (-0.1, -0.2, -0.55)})
    >>> round(posture.positions(math.radians(60))["neck"], 12)
    -0.375
    """

    knots: Annotated[tuple[Position, ...], Enough] | None = None
    """Positions of a prismatic leading joint, ascending [m]."""
    knots_deg: Annotated[tuple[AngleDeg, ...], Enough] | None = None
    """Positions of a revolute leading joint, ascending [deg]."""
    joints: Annotated[Mapping[str, tuple[JointPosition, ...]], Field(min_length=1)]
    """Position of each following joint at each knot [m or rad]."""

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if (self.knots is None) == (self.knots_deg is None):
            raise ValueError("give either 'knots' [m] or 'knots_deg' [deg]")
        knots = self.knots or self.knots_deg or ()
        if any(after - before < MIN_SPACING for before, after in itertools.pairwise(knots)):
            raise ValueError(
                "every knot must be greater than the one before, by at least "
                f"{MIN_SPACING:g} m or deg"
            )
        for name, positions in self.joints.items():
            if len(positions) != len(knots):
                raise ValueError(
                    f"joint '{name}' has {len(positions)} positions, but there are "
                    f"{len(knots)} knots; give one for each"
                )
        return self

    @property
    def is_revolute(self) -> bool:
        """Whether the leading joint is revolute."""
        return self.knots_deg is not None

    @property
    def leading(self) -> tuple[float, ...]:
        """Positions of the leading joint at the knots [m or rad]."""
        if self.knots_deg is not None:
            return tuple(math.radians(knot) for knot in self.knots_deg)
        return self.knots or ()

    def positions(self, leading: float) -> dict[str, float]:
        """Return the position of each following joint, given the leading one's [m or rad]."""
        return {
            name: float(np.interp(leading, self.leading, positions))
            for name, positions in self.joints.items()
        }
