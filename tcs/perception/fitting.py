"""Fit of a table to a scan: least squares of ranges and silhouettes, and what contradicts it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.perception.blobs import BeamArray, Blob, blobs_of
from tcs.perception.planar_pose import PlanarPose
from tcs.perception.rays import box_distances
from tcs.perception.scans import Scans
from tcs.perception.table_file import Leg, TableFile

_NEAR = 0.2
"""Greatest distance of a blob from the leg that it may show, before the fit [m]."""
_STEPS = 12
_CONVERGED = 1e-5
"""Last step of the fit [m and rad]."""
_DIFFERENCE = 1e-5
"""Step of the numerical derivatives [m and rad]."""
_LEAST_ERRORS = 5
"""Fewest errors, the offset included, that determine a pose."""
_MOST_CONDITION = 1e12
"""Greatest condition number of the information of a fit."""
_GAIN = 9.0
"""Square of an error beyond which it would be better left out, three standard deviations."""
_LEAST_BEAMS = 2
"""Fewest beams on a leg that is seen."""
_EDGE = 0.5
"""Standard deviation of a silhouette, in steps of the beams: it is between two beams, and a beam of
some width may meet a leg that its middle passes."""
_MOST_EDGE = 0.8
"""Greatest root mean square error of the silhouettes, in steps of the beams."""
_MOST_RANGE = 1.8
"""Greatest root mean square error of the ranges, less an offset, in standard deviations."""


@dataclass(frozen=True, eq=False)
class ScanView:
    """The mean of some scans, and its blobs."""

    scans: Scans
    ranges: FloatArray
    """Mean range of each beam [m], shape (beams,)."""
    blobs: tuple[Blob, ...]

    @classmethod
    def of(cls, scans: Scans) -> ScanView:
        """Return the view of some scans."""
        ranges = scans.mean()
        return cls(scans, ranges, blobs_of(scans.scanner, ranges, len(scans)))

    @cached_property
    def directions(self) -> FloatArray:
        """Unit vector of each beam in B, shape (beams, 2)."""
        return self.scans.scanner.directions

    @cached_property
    def noise(self) -> FloatArray:
        """Standard deviation of the mean ranges [m], shape (beams,)."""
        ranges = np.where(np.isfinite(self.ranges), self.ranges, self.scans.scanner.farthest)
        return np.asarray(self.scans.scanner.deviation(ranges) / math.sqrt(len(self.scans)))

    def distances(self, leg: Leg, pose: PlanarPose, beams: BeamArray | None = None) -> FloatArray:
        """Return the distance along each beam to a leg [m], shape (beams,).

        Args:
            leg: The leg.
            pose: X_BF.
            beams: Numbers of the beams; None are all.
        """
        directions = self.directions if beams is None else self.directions[beams]
        X_FS = pose.inverse() @ self.scans.scanner.pose
        along = directions @ X_FS.R.T
        return box_distances(X_FS.p - np.array(leg.xy), along, 0.5 * np.array(leg.size))


@dataclass(frozen=True, eq=False)
class Fit:
    """A pose of a table and how well it fits a view."""

    pose: PlanarPose
    """X_BF."""
    covariance: FloatArray
    """Covariance of x, y and yaw in B [m, rad], shape (3, 3)."""
    cost: float
    """Sum of the squared errors, in standard deviations, less `_GAIN` for each of them: a pose that
    explains more of the scan costs less."""
    beams: tuple[int, ...]
    """Number of beams that meet each leg."""
    contradicted: int
    """Number of legs that are not seen although nothing hides them."""
    edge_error: float
    """Root mean square error of the silhouettes, in steps of the beams."""
    range_error: float
    """Root mean square error of the ranges, less an offset, in standard deviations."""

    @property
    def seen(self) -> int:
        """Number of legs that are seen."""
        return sum(count >= _LEAST_BEAMS for count in self.beams)

    @property
    def sound(self) -> bool:
        """Whether the view shows the table there: two or more legs, and nothing against it."""
        fits = self.edge_error <= _MOST_EDGE and self.range_error <= _MOST_RANGE
        return self.seen >= 2 and not self.contradicted and fits


def fit(view: ScanView, table: TableFile, start: PlanarPose) -> Fit | None:
    """Return the pose that fits a view best, near a first estimate; None if no pose is sound.

    Ranges of beams on a leg and the angles of its silhouettes are compared with those predicted for
    the outline of the leg, each in standard deviations, and the squares minimised (Gauss-Newton).
    The offset of the ranges is estimated with the pose, so that its covariance contains it.

    Args:
        view: The view.
        table: The table.
        start: First estimate of X_BF.
    """
    shown = _blobs_of_legs(view, table, start)
    found = _fit_to(view, table, start, shown) if len(shown) >= 2 else None
    return found if found is not None and found.sound else None


def fit_without_one(view: ScanView, table: TableFile, start: PlanarPose) -> Fit | None:
    """Return the best fit that leaves out one blob near a leg: another thing that hides the leg.

    Args:
        view: The view.
        table: The table.
        start: First estimate of X_BF.
    """
    shown = _blobs_of_legs(view, table, start)
    parts = [{i: blob for i, blob in shown.items() if i != out} for out in shown]
    fits = [_fit_to(view, table, start, part) for part in parts if len(part) >= 2]
    sound = [found for found in fits if found is not None and found.sound]
    return min(sound, key=lambda found: found.cost) if sound else None


def _fit_to(
    view: ScanView, table: TableFile, start: PlanarPose, shown: dict[int, Blob]
) -> Fit | None:
    """Return the pose that fits the blobs of some legs best; None if they determine none."""
    pose, offset = start, 0.0
    jacobian, error = np.zeros((0, 4)), np.zeros(0)
    for _ in range(_STEPS):
        jacobian, error = _linearised(view, table, pose, offset, shown)
        if len(error) < _LEAST_ERRORS:
            return None
        step, *_ = np.linalg.lstsq(jacobian, error, rcond=None)
        if not np.abs(step).max() < 2.0 * _NEAR:
            return None
        x, y, yaw, more = map(float, step)
        pose = PlanarPose(pose.x + x, pose.y + y, pose.yaw + yaw)
        offset += more
        if np.abs(step).max() < _CONVERGED:
            break
    information = jacobian.T @ jacobian
    if np.linalg.cond(information) > _MOST_CONDITION:
        return None
    beams, contradicted = _evidence(view, table, pose, frozenset(shown))
    # The last error is the offset itself; those of ranges depend on it, those of silhouettes not.
    is_range = jacobian[:-1, 3] != 0.0
    return Fit(
        pose=pose,
        covariance=np.asarray(np.linalg.inv(information)[:3, :3], np.float64),
        cost=float(error @ error) - _GAIN * len(error),
        beams=beams,
        contradicted=contradicted,
        edge_error=_EDGE * _rms(error[:-1][~is_range]),
        range_error=_rms(error[:-1][is_range]),
    )


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else 0.0


def _blobs_of_legs(view: ScanView, table: TableFile, pose: PlanarPose) -> dict[int, Blob]:
    """Return the blob of each leg that has one near, the nearest pairs first."""
    pairs = []
    for i, leg in enumerate(table.legs):
        centre = pose.points(np.array(leg.xy))
        diagonal = math.hypot(*leg.size)
        for j, blob in enumerate(view.blobs):
            distance = float(np.hypot(*(blob.centre - centre)))
            if distance < _NEAR and blob.extent < 1.5 * diagonal + 0.05:
                pairs.append((distance, i, j))
    shown: dict[int, Blob] = {}
    used: set[int] = set()
    for _, i, j in sorted(pairs):
        if i not in shown and j not in used:
            shown[i] = view.blobs[j]
            used.add(j)
    return shown


def _linearised(
    view: ScanView, table: TableFile, pose: PlanarPose, offset: float, shown: dict[int, Blob]
) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives by x, y, yaw and offset, and the errors, in standard deviations.

    Shapes (n, 4) and (n,); the last error is that of the offset.
    """
    signed = [sign * step for step in np.eye(3) for sign in (1.0, -1.0)]
    steps = _DIFFERENCE * np.array([np.zeros(3), *signed])
    poses = [PlanarPose(pose.x + a, pose.y + b, pose.yaw + c) for a, b, c in steps.tolist()]
    width = np.array([_EDGE * view.scans.scanner.step])
    parts = []
    for i, blob in shown.items():
        leg = table.legs[i]
        predicted = np.array([view.distances(leg, p, blob.beams) for p in poses])
        use = np.isfinite(predicted).all(axis=0)
        use &= np.abs(predicted[0] - view.ranges[blob.beams]) < _NEAR
        measured = view.ranges[blob.beams][use] - offset
        parts.append(_weighted(predicted[:, use], measured, view.noise[blob.beams][use], 1.0))
        for edges, edge in _silhouettes(view, leg, poses, blob):
            parts.append(_weighted(edges[:, None], np.array([edge]), width, 0.0))
    std = view.scans.scanner.offset
    parts.append((np.array([[0.0, 0.0, 0.0, 1.0 / std]]), np.array([-offset / std])))
    return np.concatenate([j for j, _ in parts]), np.concatenate([e for _, e in parts])


def _weighted(
    predicted: FloatArray, measured: FloatArray, deviation: FloatArray, by_offset: float
) -> tuple[FloatArray, FloatArray]:
    """Return derivatives and errors of predictions at a pose and three steps to both sides."""
    slope = (predicted[1::2] - predicted[2::2]) / (2.0 * _DIFFERENCE)
    columns = np.vstack([slope, np.full(len(measured), by_offset)])
    return (columns / deviation).T, (measured - predicted[0]) / deviation


def _silhouettes(
    view: ScanView, leg: Leg, poses: Sequence[PlanarPose], blob: Blob
) -> list[tuple[FloatArray, float]]:
    """Return the predicted and the measured angle of each side of a leg that nothing hides.

    A side is visible if the next beam meets something farther away, or nothing.
    """
    scanner, ranges = view.scans.scanner, view.ranges
    half = 0.5 * np.array(leg.size)
    corners = np.array(leg.xy) + half * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    angles = []
    for pose in poses:
        x, y = (pose.points(corners) - scanner.pose.p).T
        angles.append(np.arctan2(y, x))
    bearing = np.array(angles)
    # Angles of a leg behind the robot are no neighbours of each other.
    if np.ptp(bearing, axis=1).max() > math.pi:
        return []
    found = []
    for beam, beyond, side in (
        (int(blob.beams[0]), -1, bearing.min(axis=1)),
        (int(blob.beams[-1]), 1, bearing.max(axis=1)),
    ):
        other = beam + beyond
        if 0 <= other < scanner.beams and ranges[other] > ranges[beam]:
            found.append((side, scanner.first + (beam + 0.5 * beyond) * scanner.step))
    return found


def _evidence(
    view: ScanView, table: TableFile, pose: PlanarPose, shown: frozenset[int]
) -> tuple[tuple[int, ...], int]:
    """Return the beams that meet each leg, and how many legs should be seen but are not.

    Beams that meet a leg which no blob shows belong to something larger and do not count.
    """
    distances = np.array([view.distances(leg, pose) for leg in table.legs])
    first = distances.argmin(axis=0)
    scanner = view.scans.scanner
    allowed = 0.03 + 4.0 * np.hypot(view.noise, scanner.offset)
    met, contradicted = [], 0
    for i in range(len(table.legs)):
        beams = np.flatnonzero((first == i) & (distances[i] < scanner.farthest - 0.2))
        # The outermost beams may pass beside the leg.
        inner = beams[1:-1] if len(beams) > 2 else beams[:0]
        with np.errstate(invalid="ignore"):
            behind = view.ranges[beams] - distances[i, beams]
            hits = int(np.count_nonzero(np.abs(behind) <= allowed[beams]))
            through = view.ranges[inner] - distances[i, inner] > allowed[inner]
        met.append(hits if i in shown else 0)
        contradicted += bool(len(inner) and 2 * np.count_nonzero(through) > len(inner))
    return tuple(met), contradicted
