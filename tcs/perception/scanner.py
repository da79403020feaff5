"""The laser scanner: beams in a horizontal plane, and the errors of their ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.errors import PerceptionError
from tcs.files.quantities import ANGLE, DEVIATION, POSITION
from tcs.kernel.arrays import FloatArray
from tcs.perception.planar_pose import PlanarPose

_MOST_BEAMS = 20_000


@dataclass(frozen=True, slots=True, kw_only=True)
class LaserScanner:
    """A scanner on the base of a robot.

    Beams are equally spaced and have no width. The range of a beam is the distance, plus an offset
    that all beams of a run share, plus noise that is new in each beam and scan, all normal.
    """

    x: float = 0.202
    """Position in the base frame B [m]."""
    height: float = 0.0945
    """Height of the plane of the beams above the floor [m]."""
    first: float = -math.radians(120.0)
    """Angle of the first beam from the x axis of B, left positive [rad]."""
    last: float = math.radians(120.0)
    """Angle of the last beam [rad]."""
    beams: int = 683
    """Number of beams."""
    nearest: float = 0.02
    """Least range [m]."""
    farthest: float = 5.6
    """Greatest range [m]."""
    noise: float = 0.01
    """Standard deviation of the noise up to `proportional_from` [m]; proportional to the range
    beyond it."""
    proportional_from: float = 1.0
    """Range beyond which the noise is proportional to it [m]."""
    offset: float = 0.01
    """Standard deviation of the offset that all ranges of a run share [m]."""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            PerceptionError: If one is out of range.
        """
        lengths = (self.x, self.height, self.nearest, self.farthest, self.proportional_from)
        POSITION.check(lengths, "the scanner: a length", PerceptionError)
        DEVIATION.check((self.noise, self.offset), "the scanner: a deviation", PerceptionError)
        ANGLE.check((self.first, self.last), "the scanner: an angle", PerceptionError)
        if not 2 <= self.beams <= _MOST_BEAMS:
            raise PerceptionError(
                f"the scanner has {self.beams} beams; must have 2 to {_MOST_BEAMS:,}."
            )
        if not 0.0 <= self.nearest < self.farthest or not self.first < self.last:
            raise PerceptionError("the scanner: the least range or angle exceeds the greatest.")
        if min(self.noise, self.offset, self.proportional_from) <= 0.0:
            raise PerceptionError("the scanner: noise and offset must be above 0.")

    @property
    def step(self) -> float:
        """Angle between neighbouring beams [rad]."""
        return (self.last - self.first) / (self.beams - 1)

    @property
    def angles(self) -> FloatArray:
        """Angle of each beam from the x axis of B [rad], shape (beams,)."""
        return np.linspace(self.first, self.last, self.beams)

    @property
    def directions(self) -> FloatArray:
        """Unit vector of each beam in B, shape (beams, 2)."""
        return np.column_stack([np.cos(self.angles), np.sin(self.angles)])

    @property
    def pose(self) -> PlanarPose:
        """X_BS, the pose of the scanner in the base."""
        return PlanarPose(self.x, 0.0, 0.0)

    def deviation(self, ranges: FloatArray) -> FloatArray:
        """Return the standard deviation of the noise at ranges [m]."""
        return np.asarray(self.noise * np.maximum(ranges / self.proportional_from, 1.0))


TIAGO = LaserScanner()
"""The scanner of TIAGo.

Source:
    The ITCM thesis, Appendix A.3, prints a rate of 10 Hz and no model. Of the scanners of TIAGo, 10
    Hz is that of the Hokuyo URG-04LX-UG01: 240 deg, 683 beams, 0.02 to 5.6 m, accuracy 30 mm up to
    1 m and 3 % of the range beyond it (data sheet). Position and height: `base_laser_link` in
    `pmb2_description` of PAL Robotics, (0.202, 0, -0.004) m in `base_link`, which is 0.0985 m above
    the floor. Taking the accuracy as three standard deviations, and both noise and offset as large,
    is ours.
"""
