"""Divide triangles into parts and fit a box or capsule to each part.

Every triangle lies wholly inside one of the shapes.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.model.robots.fitting.bounding import (
    best_candidate,
    enclose,
    hull_corners,
    hull_volume,
    tightest_orientation,
)
from tcs.model.robots.primitives import Primitive, union_volume

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_BEAM = 6
"""Beam width: divisions that are kept in each step of the search."""
_SPLITS = 8
"""Splits of one part that are kept."""


@dataclass(frozen=True, slots=True)
class Target:
    """Stopping criterion of a fit.

    Attributes:
        excess: Volume of the union over the volume of the hull below which no shape is added.
        max_shapes: Largest number of shapes on one body.
        saving: Least volume that a further shape must save, as a fraction of the hull volume.
        fine: Number of triangles above which small neighbouring triangles are grouped into units;
            the division of a fine mesh would otherwise take many minutes.
        units: Most units of grouped triangles.
    """

    excess: float
    max_shapes: int
    saving: float = 0.04
    fine: int = 15_000
    units: int = 4_000


@dataclass(frozen=True, slots=True)
class Fit:
    """Primitives around one body, with their volume and that of its hull.

    Attributes:
        primitives: Shapes that enclose every triangle.
        hull: Volume of the convex hull of the triangles [m^3].
        union: Volume of the primitives together [m^3].
    """

    primitives: tuple[Primitive, ...]
    hull: float
    union: float

    @property
    def excess(self) -> float:
        """Volume of the union over that of the hull."""
        return self.union / self.hull


def fit_triangles(body: str, triangles: FloatArray, target: Target) -> Fit:
    """Return a small number of primitives that enclose every triangle closely.

    A beam search divides the triangles by planes and keeps the divisions of least volume; each part
    gets its smallest box or capsule. The search stops at the smallest number of shapes that meets
    the target.

    Args:
        body: Name of the body.
        triangles: Corners in its frame [m], shape (n, 3, 3).
        target: Stopping criterion.
    """
    hull = hull_volume(triangles)
    search = _Search(body, triangles, target)
    best: Fit | None = None
    beam: Beam = [(search.volume(search.everything), (search.everything,))]
    for count in range(1, target.max_shapes + 1):
        if count > 1:
            beam = search.divide(beam)
        fits = [_finish(parts, search, hull) for _, parts in beam]
        found = min(fits, key=lambda fit: fit.union)
        if best is None:
            best = found
        further = count - len(best.primitives)
        if found.excess < best.excess - target.saving * further:
            best = found
        if best.excess <= target.excess:
            break
    assert best is not None
    return best


Parts = tuple[IntArray, ...]
Beam = list[tuple[float, Parts]]


class _Search:
    """Divisions of triangles into parts, rated by the summed volume of boxes in given frames.

    A part is a set of units; a unit is one triangle, or several small neighbouring ones.
    """

    def __init__(self, body: str, triangles: FloatArray, target: Target) -> None:
        self._body = body
        # About six triangles share a corner of a mesh: store each corner once.
        corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        self._corners, self._index = corners, index.reshape(-1, 3)
        self._shapes: dict[bytes, Primitive] = {}
        units = _units(triangles, target)
        self._order = np.argsort(units, kind="stable")
        starts = np.flatnonzero(np.diff(units[self._order], prepend=-1))
        self._starts = np.append(starts, len(triangles))
        self.everything: IntArray = np.arange(len(starts), dtype=np.int64)
        self.orientations = _orientations(hull_corners(corners))
        # Along each axis of each frame a unit spans an interval; the box of a part spans the
        # intervals of its units.
        ordered = triangles[self._order]
        seen = [ordered @ R for R in self.orientations]
        # Shape (frames, 3, units), so that units are contiguous in memory.
        self._low = np.stack([np.minimum.reduceat(s.min(axis=1), starts).T for s in seen])
        self._high = np.stack([np.maximum.reduceat(s.max(axis=1), starts).T for s in seen])
        self._splits: dict[bytes, list[tuple[float, IntArray, IntArray]]] = {}

    def triangles_of(self, part: IntArray) -> IntArray:
        """Return the indices of a part's triangles."""
        pieces = [self._order[self._starts[unit] : self._starts[unit + 1]] for unit in part]
        return np.sort(np.concatenate(pieces))

    def tightest(self, triangles: IntArray) -> Primitive:
        """Return the smallest shape around triangles, given by their indices."""
        used = np.zeros(len(self._corners), dtype=np.bool_)
        used[self._index[triangles]] = True
        # The divisions of a beam have most parts in common.
        key = np.packbits(used).tobytes()
        if key not in self._shapes:
            points = hull_corners(self._corners[used])
            found = best_candidate(points, self.orientations)
            self._shapes[key] = enclose(self._body, points, found.kind, found.R)
        return self._shapes[key]

    def within(self, shape: Primitive) -> BoolArray:
        """Return which triangles lie wholly in a shape, by their corners: it is convex."""
        return np.asarray(shape.contains(self._corners)[self._index].all(axis=1))

    def volume(self, part: IntArray) -> float:
        """Return the volume of the smallest box around a part in the given frames [m^3]."""
        size = self._high[..., part].max(axis=2) - self._low[..., part].min(axis=2)
        return float(size.prod(axis=1).min())

    def divide(self, beam: Beam) -> Beam:
        """Return the best divisions with one more part."""
        found: dict[tuple[bytes, ...], tuple[float, Parts]] = {}
        for total, parts in beam:
            for i, part in enumerate(parts):
                rest = total - self.volume(part)
                for volume, first, second in self._splits_of(part):
                    divided = (*parts[:i], first, second, *parts[i + 1 :])
                    key = tuple(sorted(p.tobytes() for p in divided))
                    found[key] = (rest + volume, divided)
        # Keys break ties, so the result does not depend on the order of the search.
        ranked = sorted(found.items(), key=lambda item: (item[1][0], item[0]))
        return [division for _, division in ranked[:_BEAM]] or beam

    def _splits_of(self, part: IntArray) -> list[tuple[float, IntArray, IntArray]]:
        key = part.tobytes()
        if key not in self._splits:
            self._splits[key] = self._find_splits(part)
        return self._splits[key]

    def _find_splits(self, part: IntArray) -> list[tuple[float, IntArray, IntArray]]:
        """Return the best splits of a part by planes normal to the axes of the given frames."""
        if len(part) < 2:
            return []
        low, high = self._low[..., part], self._high[..., part]
        found: list[tuple[float, IntArray, IntArray]] = []
        for frame, axis in itertools.product(range(len(self.orientations)), range(3)):
            starts, ends = low[frame, axis], high[frame, axis]
            # A triangle that the plane cuts is assigned by its far end, near end or middle.
            for position in (ends, starts, starts + ends):
                order = np.argsort(position, kind="stable")
                ordered = low[..., order], high[..., order]
                near = _running_volumes(*ordered)
                far = _running_volumes(*(bound[..., ::-1] for bound in ordered))[::-1]
                total = near[:-1] + far[1:]
                i = int(np.argmin(total))
                first, second = np.sort(part[order[: i + 1]]), np.sort(part[order[i + 1 :]])
                found.append((float(total[i]), first, second))
        found.sort(key=lambda split: (split[0], split[1].tobytes()))
        distinct = {split[1].tobytes(): split for split in reversed(found)}
        return sorted(distinct.values(), key=lambda s: (s[0], s[1].tobytes()))[:_SPLITS]


def _units(triangles: FloatArray, target: Target) -> IntArray:
    """Return the unit of each triangle, numbered from 0, shape (n,)."""
    count = len(triangles)
    if count <= target.fine:
        return np.arange(count, dtype=np.int64)
    middles = triangles.mean(axis=1)
    sizes = np.ptp(triangles, axis=1).max(axis=1)
    cell = float(np.ptp(middles, axis=0).max()) / 100
    while True:
        # A triangle larger than its cell is a unit of its own: it would enlarge any other.
        alone = sizes > cell
        keys = np.floor((middles - middles.min(axis=0)) / cell).astype(np.int64)
        keys[alone] = np.array([-1, -1, 0])
        keys[alone, 2] = np.arange(int(alone.sum()))
        _, units = np.unique(keys, axis=0, return_inverse=True)
        if units.max() < target.units:
            return np.asarray(units.reshape(-1), dtype=np.int64)
        # This ends, because a cell that contains everything makes one unit.
        cell *= 1.25


def _running_volumes(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the smallest box volume around the first 1, 2, ... triangles, shape (n,)."""
    size = np.maximum.accumulate(high, axis=2) - np.minimum.accumulate(low, axis=2)
    return np.asarray((size[:, 0] * size[:, 1] * size[:, 2]).min(axis=0))


def _orientations(points: FloatArray) -> FloatArray:
    """Return the frames to search: that of the body, of its smallest box, and rotated ones."""
    rotated = [
        Rotation.from_euler(axis, angle, degrees=True).as_matrix()
        for axis in "xyz"
        for angle in (15, 30, 45, 60, 75)
    ]
    return np.stack([np.eye(3), tightest_orientation(points), *rotated])


def _finish(parts: Parts, search: _Search, hull: float) -> Fit:
    """Return the smallest primitives for a division, refitted to what no other one encloses."""
    shapes = [search.tightest(search.triangles_of(part)) for part in parts]
    best: Fit | None = None
    # The order of refitting matters; with many shapes only cyclic orders are tried.
    orders: list[tuple[int, ...]] = [
        tuple(np.roll(range(len(shapes)), shift)) for shift in range(len(shapes))
    ]
    if len(shapes) <= 3:
        orders = list(itertools.permutations(range(len(shapes))))
    for order in orders:
        refitted = _refitted(shapes, order, search)
        union = union_volume(refitted)
        if best is None or union < best.union:
            best = Fit(primitives=refitted, hull=hull, union=union)
    assert best is not None
    return best


def _refitted(
    shapes: list[Primitive], order: tuple[int, ...], search: _Search
) -> tuple[Primitive, ...]:
    """Return the shapes, each in turn refitted to the triangles that only it encloses."""
    current: list[Primitive | None] = list(shapes)
    within = [search.within(shape) for shape in shapes]
    for i in order:
        others = [w for j, w in enumerate(within) if j != i and current[j] is not None]
        alone = np.flatnonzero(~np.any(others, axis=0)) if others else np.arange(len(within[i]))
        current[i] = fitted = search.tightest(alone) if len(alone) else None
        if fitted is not None:
            within[i] = search.within(fitted)
    return tuple(shape for shape in current if shape is not None)
