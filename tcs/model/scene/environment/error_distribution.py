"""Error distributions of joints: the difference of a joint from its assumed position."""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from tcs.files.documents import Deviation, DeviationDeg, Document

_WIDTHS = {"normal": ("std", "std_deg"), "uniform": ("half_width", "half_width_deg")}
"""Key of the width of each distribution, for prismatic [m] and for revolute joints [deg]."""


class ErrorDistribution(Document):
    """The distribution of one joint's error, with mean zero."""

    distribution: Literal["normal", "uniform"]
    std: Deviation | None = None
    """Standard deviation of a prismatic joint's normal error [m]."""
    std_deg: DeviationDeg | None = None
    """Standard deviation of a revolute joint's normal error [deg]."""
    half_width: Deviation | None = None
    """Largest magnitude of a prismatic joint's uniform error [m]."""
    half_width_deg: DeviationDeg | None = None
    """Largest magnitude of a revolute joint's uniform error [deg]."""

    @model_validator(mode="after")
    def _has_one_width(self) -> Self:
        given = [
            name for both in _WIDTHS.values() for name in both if getattr(self, name) is not None
        ]
        prismatic, revolute = _WIDTHS[self.distribution]
        if len(given) != 1 or given[0] not in (prismatic, revolute):
            raise ValueError(
                f"give either '{prismatic}' [m] or '{revolute}' [deg] for a {self.distribution} "
                "error, and nothing else"
            )
        return self

    @property
    def is_revolute(self) -> bool:
        """Whether it is the error of a revolute joint."""
        return self.std_deg is not None or self.half_width_deg is not None

    @property
    def width_key(self) -> tuple[str, str]:
        """Keys of the width of this distribution, for prismatic and for revolute joints."""
        return _WIDTHS[self.distribution]

    @property
    def width(self) -> float:
        """Standard deviation of a normal error, half width of a uniform one [m or rad]."""
        prismatic, revolute = (getattr(self, name) for name in _WIDTHS[self.distribution])
        return math.radians(revolute) if revolute is not None else float(prismatic)

    @property
    def standard_deviation(self) -> float:
        """Standard deviation [m or rad]."""
        return self.width / math.sqrt(3.0) if self.distribution == "uniform" else self.width

    def draw(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return the next `count` samples of the stream [m or rad], shape (count,)."""
        if self.distribution == "uniform":
            return self.width * rng.uniform(-1.0, 1.0, count)
        return self.width * rng.standard_normal(count)
