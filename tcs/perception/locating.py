"""Finding a table in laser scans: by all its legs, or by the two nearest blobs as in the thesis."""

from __future__ import annotations

import itertools
import math

import numpy as np

from tcs.errors import PerceptionError, UnknownNameError
from tcs.kernel.arrays import FloatArray
from tcs.perception.blobs import Blob, blobs_of
from tcs.perception.fitting import Fit, ScanView, fit, fit_without_one
from tcs.perception.located import Located
from tcs.perception.planar_pose import PlanarPose, wrapped
from tcs.perception.scans import Scans
from tcs.perception.table_file import Leg, TableFile

LEGS, TWO_BLOBS = "legs", "two-blobs"
METHODS = (LEGS, TWO_BLOBS)
_TOLERANCE = 0.16
"""Greatest difference between the distance of two blobs and that of two legs [m]: the points of a
blob are on the near side of a leg, and a part of it may be hidden."""
_MOST_BLOBS = 40
"""Most blobs that are tried as legs, nearest first."""
_MOST_FITS = 150
"""Most first estimates that are fitted, those with most blobs near legs first."""
_MOST_PARTIAL = 12
"""Most first estimates that are fitted with one of the blobs near legs left out."""
_ALIKE = 0.08, math.radians(8.0)
"""First estimates closer than this lead to one fit [m, rad]."""
_SAME = 0.02, math.radians(3.0)
"""Fits closer than this are one pose [m, rad]."""
_INDISTINCT = 18.0
"""Fits whose costs differ by less are equally good: about two beams."""
_LEAST_POINTS = 3
"""Fewest points of one of the two nearest blobs: fewer may be noise."""


def locate(
    scans: Scans,
    table: TableFile,
    *,
    method: str = LEGS,
    expected: PlanarPose | None = None,
) -> Located:
    """Return the pose of a table in the base frame, and its covariance.

    Args:
        scans: Scans from one base pose, with the table at rest.
        table: The table.
        method: "legs": blobs of the mean scan are matched with all legs, and the pose is fitted to
            their outlines. "two-blobs": in each scan the two nearest blobs are the front legs, that
            of more points the wider one; the means of their points are averaged over the scans.
        expected: Rough pose of the table in B, to choose between poses that fit equally well; None
            chooses the one whose front edge faces the robot.

    Raises:
        UnknownNameError: If there is no such method.
        PerceptionError: If the scans do not show the table.

    Source:
        ITCM thesis, Appendix A.3, for "two-blobs"; "legs" is ours.
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS)
    if method == TWO_BLOBS:
        return _by_two_blobs(scans, table)
    view = ScanView.of(scans)
    candidates = _candidates(view.blobs, table)
    estimates = _first_estimates(candidates, table)
    sound: list[Fit] = []
    # A fit to more legs explains more of the scan than any fit to fewer.
    for _, group in itertools.groupby(estimates, key=lambda estimate: estimate[0]):
        fits = [fit(view, table, start) for _, start in group]
        sound = [found for found in fits if found is not None]
        if sound:
            break
    else:
        fits = [fit_without_one(view, table, start) for _, start in estimates[:_MOST_PARTIAL]]
        sound = [found for found in fits if found is not None]
    if not sound:
        raise PerceptionError(_not_found(view, candidates, table))
    best, *others = _best(sound, expected)
    return Located(
        table=table.name,
        pose=PlanarPose(best.pose.x, best.pose.y, wrapped(best.pose.yaw)),
        covariance=best.covariance,
        legs=tuple((leg.name, n) for leg, n in zip(table.legs, best.beams, strict=True)),
        alternatives=tuple(found.pose for found in others),
        scans=len(scans),
        blobs=len(view.blobs),
    )


def _candidates(blobs: tuple[Blob, ...], table: TableFile) -> list[Blob]:
    """Return the blobs that are small enough to be a leg, nearest first."""
    largest = max(math.hypot(*leg.size) for leg in table.legs)
    small = [blob for blob in blobs if len(blob.beams) > 1 and blob.extent < 1.5 * largest + 0.05]
    return sorted(small, key=lambda blob: blob.range)[:_MOST_BLOBS]


def _first_estimates(candidates: list[Blob], table: TableFile) -> list[tuple[int, PlanarPose]]:
    """Return poses that bring two legs to two blobs, each with the number of legs not near a blob.

    Those with most legs near blobs come first.
    """
    if len(candidates) < 2:
        return []
    centres = np.array([blob.centre for blob in candidates])
    legs = np.array([leg.xy for leg in table.legs])
    ranked = []
    for i, j in itertools.combinations(range(len(legs)), 2):
        apart = float(np.hypot(*(legs[j] - legs[i])))
        for a, b in itertools.permutations(range(len(centres)), 2):
            if abs(float(np.hypot(*(centres[b] - centres[a]))) - apart) > _TOLERANCE:
                continue
            pose = _through(legs[i], legs[j], centres[a], centres[b])
            gaps = np.hypot(*(pose.points(legs)[:, None] - centres).transpose(2, 0, 1)).min(axis=1)
            ranked.append((int(np.count_nonzero(gaps > _TOLERANCE)), float(gaps.sum()), pose))
    ranked.sort(key=lambda entry: entry[:2])
    lacking = {id(pose): count for count, _, pose in ranked}
    distinct = _distinct([pose for _, _, pose in ranked], _ALIKE)[:_MOST_FITS]
    return [(lacking[id(pose)], pose) for pose in distinct]


def _through(
    leg_a: FloatArray, leg_b: FloatArray, point_a: FloatArray, point_b: FloatArray
) -> PlanarPose:
    """Return X_BF that brings two points of F as near as possible to two points of B."""
    (dx, dy), (ex, ey) = leg_b - leg_a, point_b - point_a
    yaw = wrapped(math.atan2(ey, ex) - math.atan2(dy, dx))
    middle = PlanarPose(0.0, 0.0, yaw).points(0.5 * (leg_a + leg_b))
    x, y = 0.5 * (point_a + point_b) - middle
    return PlanarPose(float(x), float(y), yaw)


def _distinct(poses: list[PlanarPose], within: tuple[float, float]) -> list[PlanarPose]:
    """Return the poses without those within a distance [m] and an angle [rad] of earlier ones."""
    kept: list[PlanarPose] = []
    for pose in poses:
        if not any(
            math.hypot(pose.x - other.x, pose.y - other.y) < within[0]
            and abs(wrapped(pose.yaw - other.yaw)) < within[1]
            for other in kept
        ):
            kept.append(pose)
    return kept


def _best(sound: list[Fit], expected: PlanarPose | None) -> list[Fit]:
    """Return the fits that no other one surpasses, the most likely first."""
    ranked = sorted(sound, key=lambda found: found.cost)
    good = [found for found in ranked if found.cost < ranked[0].cost + _INDISTINCT]
    poses = _distinct([found.pose for found in good], _SAME)
    kept = [found for found in good if any(found.pose is pose for pose in poses)]
    return sorted(kept, key=lambda found: _unlikeliness(found.pose, expected))


def _unlikeliness(pose: PlanarPose, expected: PlanarPose | None) -> float:
    """Return the distance of a pose from the expected one, or of its front edge from the base."""
    if expected is not None:
        turn = abs(wrapped(pose.yaw - expected.yaw))
        return math.hypot(pose.x - expected.x, pose.y - expected.y) + turn
    return math.hypot(pose.x, pose.y)


def _not_found(view: ScanView, candidates: list[Blob], table: TableFile) -> str:
    """Return why no table was found, and what is known instead."""
    seen = f"{len(view.blobs)} blobs, {len(candidates)} of them small enough for a leg"
    if not candidates:
        return (
            f"table '{table.name}' is not in view: {seen}. Move the robot so that two legs are "
            "within the range of the scanner and not hidden."
        )
    nearest = candidates[0]
    x, y = nearest.centre
    known = f"the nearest is at x {x:.2f}, y {y:.2f} m in the base frame"
    if len(candidates) == 1:
        return (
            f"table '{table.name}' is not found: {seen}; {known}. A single leg leaves the heading "
            "open. Move the robot so that a second leg is in view."
        )
    return (
        f"table '{table.name}' is not found: {seen}; {known}. No two of them are at the distance "
        "and of the width of two legs with nothing against it. Move the robot, or check the table "
        "file."
    )


def _by_two_blobs(scans: Scans, table: TableFile) -> Located:
    """Return the pose from the two nearest blobs of each scan, as in the thesis."""
    wide, narrow = _front_legs(table)
    pairs = [pair for ranges in scans.ranges if (pair := _two_nearest(scans, ranges)) is not None]
    if not pairs:
        raise PerceptionError(
            f"table '{table.name}' is not found: no scan has two blobs. Move the robot so that the "
            "front legs are in view."
        )
    legs = (_front_of(wide), _front_of(narrow))
    points = np.array([[blob.centre for blob in pair] for pair in pairs])
    first, second = points.mean(axis=0)
    apart, found = (float(np.hypot(*(b - a))) for a, b in (legs, (first, second)))
    if abs(found - apart) > _TOLERANCE:
        raise PerceptionError(
            f"table '{table.name}' is not found: the two nearest blobs are {found:.2f} m apart, "
            f"its front legs {apart:.2f} m. Move the robot so that the front legs are nearest."
        )
    pose = _through(*legs, first, second)
    each = [_through(*legs, a, b) for a, b in points]
    errors = [[p.x - pose.x, p.y - pose.y, wrapped(p.yaw - pose.yaw)] for p in each]
    beams = {leg.name: len(b.beams) for leg, b in zip((wide, narrow), pairs[-1], strict=True)}
    return Located(
        table=table.name,
        pose=pose,
        covariance=np.cov(np.transpose(errors)) / len(each) if len(each) > 1 else np.zeros((3, 3)),
        legs=tuple((leg.name, beams.get(leg.name, 0)) for leg in table.legs),
        scans=len(scans),
        blobs=len(ScanView.of(scans).blobs),
    )


def _two_nearest(scans: Scans, ranges: FloatArray) -> tuple[Blob, Blob] | None:
    """Return the two nearest blobs of a scan, that of more points first."""
    blobs = [b for b in blobs_of(scans.scanner, ranges) if len(b.beams) >= _LEAST_POINTS]
    nearest = sorted(blobs, key=lambda blob: blob.range)[:2]
    if len(nearest) < 2:
        return None
    more, fewer = sorted(nearest, key=lambda blob: -len(blob.beams))
    return more, fewer


def _front_legs(table: TableFile) -> tuple[Leg, Leg]:
    """Return the two legs at the front edge, the wider one first."""
    front = sorted(table.legs, key=lambda leg: leg.xy[0])[:2]
    wide, narrow = sorted(front, key=lambda leg: -leg.size[1])
    if wide.size[1] == narrow.size[1]:
        raise PerceptionError(
            f"table '{table.name}': its front legs are equally wide, and the method '{TWO_BLOBS}' "
            f"distinguishes them by their width. Use the method '{LEGS}'."
        )
    return wide, narrow


def _front_of(leg: Leg) -> FloatArray:
    """Return the middle of the front face of a leg in F [m], shape (2,)."""
    return np.array([leg.xy[0] - 0.5 * leg.size[0], leg.xy[1]])
