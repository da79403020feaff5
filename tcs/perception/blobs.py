"""Blobs: neighbouring beams of a scan that meet one thing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray
from tcs.perception.scanner import LaserScanner

BeamArray = NDArray[np.int64]

_GAP = 0.1
"""Points of neighbouring beams farther apart belong to different blobs [m]."""
_SIGMAS = 5.0
"""The same, in standard deviations of their distance, where the noise is greater."""
_SKIPPED = 1
"""Most beams without a range between two beams of a blob."""


@dataclass(frozen=True, eq=False)
class Blob:
    """Neighbouring beams that meet one thing."""

    beams: BeamArray
    """Numbers of the beams, ascending, shape (n,)."""
    points: FloatArray
    """Their points in B [m], shape (n, 2)."""
    range: float
    """Least range [m]."""

    @property
    def centre(self) -> FloatArray:
        """Mean of the points in B [m], shape (2,)."""
        return np.asarray(self.points.mean(axis=0))

    @property
    def extent(self) -> float:
        """Distance between the outermost points [m]."""
        return float(np.hypot(*(self.points[-1] - self.points[0])))


def points_of(scanner: LaserScanner, ranges: FloatArray) -> FloatArray:
    """Return the points of ranges in B [m], shape (beams, 2); not finite where the range is not."""
    with np.errstate(invalid="ignore"):
        return np.asarray(scanner.pose.p + ranges[:, None] * scanner.directions)


def blobs_of(scanner: LaserScanner, ranges: FloatArray, scans: int = 1) -> tuple[Blob, ...]:
    """Return the blobs of a scan, from the first beam to the last.

    Args:
        scanner: The scanner.
        ranges: Range of each beam [m], shape (beams,).
        scans: Number of scans of which the ranges are the mean.
    """
    beams = np.flatnonzero(np.isfinite(ranges))
    if not len(beams):
        return ()
    points = points_of(scanner, ranges)[beams]
    noise = scanner.deviation(ranges[beams]) / math.sqrt(scans)
    allowed = np.maximum(_GAP, _SIGMAS * np.hypot(noise[1:], noise[:-1]))
    apart = np.hypot(*np.diff(points, axis=0).T) > allowed
    apart |= np.diff(beams) > _SKIPPED + 1
    parts = np.split(np.arange(len(beams)), np.flatnonzero(apart) + 1)
    return tuple(
        Blob(beams[part], points[part], float(ranges[beams[part]].min())) for part in parts
    )
