"""Where the joints before a spherical wrist can take it, within their limits.

Where the last three axes meet, the wrist depends on the four joints before them. All postures of
these are enclosed: about samples of joints 2, 3 and 4 so dense that the wrist is never farther than
a bound from that at the nearest one, and joint 1 turns each of these places about its axis. So a
place that is not marked is one to which no posture takes the wrist.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, Chain, FloatArray
from tcs.kernel.cache import inner, jit

CELL = 0.015
"""Size of a cell across the axis of joint 1 and along it [m]."""
SECTORS = 128
"""Number of cells around the axis."""
SECTOR = 2.0 * np.pi / SECTORS
AWAY = 0.99 * CELL
"""Greatest distance of the wrist from that at the nearest sample [m]: it is in the same cell or in
one next to it."""
MEETING = 1e-4
"""Greatest distance of the axes of a spherical wrist from the point that is taken for it [m]: the
solution of an iteration."""
MOST_SAMPLES = 4_000_000
"""Most samples; an arm that needs more is left without places."""


class WristPlaces(NamedTuple):
    """Cells about the axis of joint 1 that the wrist may be in."""

    marked: BoolArray
    """By distance from the axis, height and angle about it, shape (n, heights, SECTORS); empty for
    an arm whose places are not known."""
    lowest: float
    """Where the heights begin, along the axis in the frame of joint 1 [m]."""
    R: FloatArray
    """Orientation of the frame of joint 1 in the arm base A, shape (3, 3)."""
    p: FloatArray
    """Its origin in A [m], shape (3,)."""


def no_places() -> WristPlaces:
    """Return what stands for places that are not known."""
    return WristPlaces(np.empty((0, 0, 0), np.bool_), 0.0, np.eye(3), np.zeros(3))


def wrist_places(chain: Chain, wrist: FloatArray) -> WristPlaces:
    """Return the places of the wrist of an arm.

    Args:
        chain: The arm.
        wrist: The wrist in T [m], shape (3,).
    """
    if chain.joints != 7 or np.any(chain.slides):
        return no_places()
    arrays = (chain.R, chain.p, chain.lower, chain.upper, wrist)
    return _places_of(*(np.asarray(part, dtype=np.float64).tobytes() for part in arrays))


@lru_cache(maxsize=8)
def _places_of(*parts: bytes) -> WristPlaces:
    """Return the places of an arm, given its arrays as bytes."""
    flat_R, flat_p, lower, upper, wrist = (np.frombuffer(part) for part in parts)
    R, p = flat_R.reshape(8, 3, 3), flat_p.reshape(8, 3)
    at, astray = p[7] + R[7] @ wrist, 0.0
    for i in (6, 5, 4):
        # Joints 5 to 7 move the wrist by what it is beside their axes, twice that at most.
        astray += 2.0 * float(np.hypot(at[0], at[1]))
        at = p[i] + R[i] @ at
    if astray > MEETING:
        return no_places()
    low, high = np.where(upper - lower < 2.0 * np.pi, (lower, upper), ([-np.pi], [np.pi]))
    levers = _levers(R, p, at)
    each = (AWAY - MEETING) / 3.0
    count = [int(np.ceil((high[i] - low[i]) * levers[i - 1] / (2.0 * each))) + 1 for i in (1, 2, 3)]
    if np.prod(count) > MOST_SAMPLES:
        return no_places()
    # The middles of equal parts of each range.
    samples = [
        low[i] + (np.arange(n) + 0.5) / n * (high[i] - low[i])
        for i, n in zip((1, 2, 3), count, strict=True)
    ]
    farthest = float(np.linalg.norm(p[1])) + levers[0] + 2.0 * CELL
    cells = int(np.ceil(farthest / CELL)) + 1
    seen = np.zeros((cells, 2 * cells, SECTORS), np.bool_)
    _mark(R, p, at, samples[0], samples[1], samples[2], -cells * CELL, seen)
    # Cells next to those of samples.
    near = seen.copy()
    near[1:] |= seen[:-1]
    near[:-1] |= seen[1:]
    seen = near.copy()
    near[:, 1:] |= seen[:, :-1]
    near[:, :-1] |= seen[:, 1:]
    return WristPlaces(_turned(near, low[0], high[0]), -cells * CELL, R[0].copy(), p[0].copy())


def _levers(R: FloatArray, p: FloatArray, at: FloatArray) -> FloatArray:
    """Return the greatest distances of the wrist from axes 2, 3 and 4 [m], shape (3,)."""
    length = np.linalg.norm
    beside = float(np.hypot(at[0], at[1]))
    # From axis 3, the wrist is where joint 4 takes it, on a circle.
    centre = p[3] + R[3][:, 2] * at[2]
    about_3 = float(np.hypot(centre[0], centre[1])) + beside
    about_2 = float(length(p[2])) + float(length(p[3] + R[3][:, 2] * at[2])) + beside
    return np.array([about_2, about_3, beside])


def _turned(seen: BoolArray, low: float, high: float) -> BoolArray:
    """Return the cells that joint 1 turns others to, within its limits [rad]."""
    marked = np.empty_like(seen)
    for n in range(len(seen)):
        # How far a place at the inner edge of the cell may be from its sample, about the axis.
        inner_edge = n * CELL
        beside = np.arcsin(AWAY / inner_edge) if inner_edge > AWAY else np.pi
        first = int(np.floor((low - beside) / SECTOR)) - 1
        last = int(np.ceil((high + beside) / SECTOR)) + 1
        if last - first >= SECTORS:
            marked[n] = np.any(seen[n], axis=1, keepdims=True)
            continue
        total = np.cumsum(np.tile(seen[n], (1, 3)), axis=1)
        total = np.concatenate([np.zeros((seen.shape[1], 1), total.dtype), total], axis=1)
        # Cell k is reached from cells k - last to k - first.
        begin = np.mod(np.arange(SECTORS) - last, SECTORS)
        marked[n] = total[:, begin + last - first + 1] > total[:, begin]
    return np.ascontiguousarray(marked)


@jit
def _mark(
    R: FloatArray, p: FloatArray, at: FloatArray, q2: FloatArray, q3: FloatArray, q4: FloatArray,
    lowest: float, seen: BoolArray,
) -> None:  # fmt: skip
    """Mark the cells of the wrist at samples of joints 2, 3 and 4, joint 1 at 0.

    Args:
        R: Rotations of the chain, shape (8, 3, 3).
        p: Translations of the chain [m], shape (8, 3).
        at: The wrist in L4 [m], shape (3,).
        q2: Samples of joint 2 [rad].
        q3: Samples of joint 3 [rad].
        q4: Samples of joint 4 [rad].
        lowest: Where the heights begin [m].
        seen: Filled, as `WristPlaces.marked`.
    """
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    for n4 in range(len(q4)):
        _through(R, p, 3, q4[n4], at, a)
        for n3 in range(len(q3)):
            _through(R, p, 2, q3[n3], a, b)
            for n2 in range(len(q2)):
                _through(R, p, 1, q2[n2], b, c)
                i, j, k = _cell_of(c[0], c[1], c[2], lowest)
                seen[i, j, k] = True


@inner
def _through(
    R: FloatArray, p: FloatArray, i: int, angle: float, at: FloatArray, out: FloatArray
) -> None:
    """Fill a point in L(i), given it in the frame that joint i + 1 turns by an angle [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = cosine * at[0] - sine * at[1], sine * at[0] + cosine * at[1]
    for r in range(3):
        out[r] = p[i, r] + R[i, r, 0] * x + R[i, r, 1] * y + R[i, r, 2] * at[2]


@inner
def _cell_of(x: float, y: float, z: float, lowest: float) -> tuple[int, int, int]:
    """Return the cell of a point in the frame of joint 1 [m]."""
    across = int(np.sqrt(x * x + y * y) / CELL)
    along = int(np.floor((z - lowest) / CELL))
    return across, along, int((np.arctan2(y, x) + np.pi) / SECTOR) % SECTORS


@inner
def is_no_place(places: WristPlaces, x: float, y: float, z: float) -> bool:
    """Return whether no posture takes the wrist to a point in the frame of joint 1 [m]."""
    marked = places.marked
    if not len(marked):
        return False
    across, along, around = _cell_of(x, y, z, places.lowest)
    if across >= marked.shape[0] or along < 0 or along >= marked.shape[1]:
        return True
    return not marked[across, along, around]
