"""How far one joint of the environment may be from where the robot believes it is."""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from tcs.files.documents import Document, Length

_WIDTHS = {"normal": ("std", "std_deg"), "uniform": ("half_width", "half_width_deg")}
"""How the width of each distribution is called, of joints that slide [m] and that turn [deg]."""


class ErrorDistribution(Document):
    """The error of one joint: a distribution about zero."""

    distribution: Literal["normal", "uniform"]
    std: Length | None = None
    """Standard deviation of a sliding joint's normal error [m]."""
    std_deg: Length | None = None
    """Standard deviation of a turning joint's normal error [deg]."""
    half_width: Length | None = None
    """Greatest uniform error of a sliding joint, to either side [m]."""
    half_width_deg: Length | None = None
    """Greatest uniform error of a turning joint, to either side [deg]."""

    @model_validator(mode="after")
    def _has_one_width(self) -> Self:
        given = [
            name for both in _WIDTHS.values() for name in both if getattr(self, name) is not None
        ]
        slides, turns = _WIDTHS[self.distribution]
        if len(given) != 1 or given[0] not in (slides, turns):
            raise ValueError(
                f"give either '{slides}' [m] or '{turns}' [deg] for a {self.distribution} error, "
                "and nothing else"
            )
        return self

    @property
    def turns(self) -> bool:
        """Whether it is written as the error of a joint that turns."""
        return self.std_deg is not None or self.half_width_deg is not None

    @property
    def width_key(self) -> tuple[str, str]:
        """How the width of this distribution is called of joints that slide and that turn."""
        return _WIDTHS[self.distribution]

    @property
    def width(self) -> float:
        """Standard deviation of a normal error, half width of a uniform one [m or rad]."""
        slides, turns = (getattr(self, name) for name in _WIDTHS[self.distribution])
        return math.radians(turns) if turns is not None else float(slides)

    @property
    def standard_deviation(self) -> float:
        """Standard deviation [m or rad]."""
        return self.width / math.sqrt(3.0) if self.distribution == "uniform" else self.width

    def draw(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return so many errors [m or rad], the next of this stream, shape (count,)."""
        if self.distribution == "uniform":
            return self.width * rng.uniform(-1.0, 1.0, count)
        return self.width * rng.standard_normal(count)
