"""How joints of the person follow a joint of the furniture: piecewise linear, as data."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from tcs.files.documents import Document, Number

Knots = Annotated[tuple[Number, ...], Field(min_length=2)]


class Posture(Document):
    """Where the joints that follow one joint stand, at some of its positions.

    Between two knots every joint moves in proportion; beyond the outer ones nothing is known, so
    the leading joint may not go there.

    >>> posture = Posture(knots_deg=(0, 40, 80), joints={"neck": (-0.1, -0.2, -0.55)})
    >>> round(posture.positions(math.radians(60))["neck"], 12)
    -0.375
    """

    knots: Knots | None = None
    """Positions of a leading joint that slides, rising [m]."""
    knots_deg: Knots | None = None
    """Positions of a leading joint that turns, rising [deg]."""
    joints: Annotated[Mapping[str, tuple[Number, ...]], Field(min_length=1)]
    """For each joint that follows its position at each knot [m or rad]."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.knots is None) == (self.knots_deg is None):
            raise ValueError("give either 'knots' [m] or 'knots_deg' [deg]")
        written = self.knots or self.knots_deg or ()
        if any(after <= before for before, after in itertools.pairwise(written)):
            raise ValueError("every knot must be greater than the one before")
        for name, positions in self.joints.items():
            if len(positions) != len(written):
                raise ValueError(
                    f"joint '{name}' has {len(positions)} positions, but there are "
                    f"{len(written)} knots; give one for each"
                )
        return self

    @property
    def turns(self) -> bool:
        """Whether the leading joint is one that turns."""
        return self.knots_deg is not None

    @property
    def leading(self) -> tuple[float, ...]:
        """Positions of the leading joint at the knots [m or rad]."""
        if self.knots_deg is not None:
            return tuple(math.radians(knot) for knot in self.knots_deg)
        return self.knots or ()

    def positions(self, at: float) -> dict[str, float]:
        """Return where each joint stands with the leading joint at `at` [m or rad]."""
        return {
            name: float(np.interp(at, self.leading, positions))
            for name, positions in self.joints.items()
        }
