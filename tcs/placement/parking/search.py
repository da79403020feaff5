"""The search for the window of a stop: the largest box found in which it serves its goals."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.placement.tables.windows import MARGIN, MOST_PARKING, NARROWEST, Window

PROPORTIONS = Window(0.05, 0.05, math.radians(3.0))
"""Half widths of which a window has a multiple at first: what a navigation stack parks within."""
WIDEST = Window.wanted(MOST_PARKING)
"""Greatest half widths."""
FINENESS = 1.07
"""Ratio of a box that holds and one that does not at which the search is content."""
COARSE, FINE = 5, 9
"""Places along each side of the lattices by which a box is judged while it grows, and at last."""
RANDOM = 256
"""Random base poses in which a window is confirmed."""
BATCH = 128
"""Base poses that are scored before the next look at what is missed."""

Missed = Callable[[FloatArray], BoolArray]
"""Function of offsets of the base in x, y [m] and heading [rad], shape (n, 3). It returns which
goals are missed there, shape (n, G)."""


@cache
def lattice(count: int) -> FloatArray:
    """Return a lattice in the box from -1 to 1 as offsets, shape (n, 3).

    Its faces have `count` places along each side, corners and edges first; inside there are half as
    many. The centre is left out.
    """
    along = np.linspace(-1.0, 1.0, count)
    inner = np.linspace(-1.0, 1.0, count // 2 + 2)[1:-1]
    outer = np.array(list(itertools.product(along, repeat=3)))
    outer = outer[np.abs(outer).max(axis=1) == 1.0]
    extremes = np.count_nonzero(np.abs(outer) == 1.0, axis=1)
    inside = np.array(list(itertools.product(inner, repeat=3)))
    found = np.concatenate([outer[np.argsort(-extremes, kind="stable")], inside])
    found = found[np.any(found != 0.0, axis=1)]
    found.flags.writeable = False
    return found


@dataclass(frozen=True)
class Miss:
    """A place within the box that was searched from which goals are missed."""

    at: tuple[float, float, float]
    """Distances from the stop in x and y [m] and in heading [rad]."""
    goals: tuple[int, ...]
    """Numbers of the goals, among those of the stop."""

    def ratio(self, box: Window | None) -> float:
        """Return the scale of a box, by default of the usual proportions, that has it on a face."""
        return max(at / half for at, half in zip(self.at, box or PROPORTIONS, strict=True))


@dataclass(eq=False)
class WindowSearch:
    """The search around one stop."""

    missed: Missed
    confirming: Missed
    """The same for the random base poses, as the grid was scored."""
    rng: np.random.Generator
    scored: int = 0
    """Number of base poses that were scored."""
    misses: list[Miss] = field(default_factory=list)
    """Misses that were found."""

    def holds(self, box: Window, count: int = COARSE, held: Window | None = None) -> bool:
        """Return whether nothing is missed on a lattice in a box; the first misses are kept.

        Args:
            box: The box.
            count: Places along each side of the lattice.
            held: A box that is known to hold, where it is not judged again.
        """
        if any(_inside(miss, box) for miss in self.misses):
            return False
        offsets = lattice(count) * np.array(box)
        if held is not None:
            offsets = offsets[np.any(np.abs(offsets) > np.array(held) * (1.0 + 1e-9), axis=1)]
        return self._finds_none(offsets)

    def window(self, wanted: Window | None = None) -> Window | None:
        """Return the largest window found; None if there is none of 3 mm, or as large as wanted.

        A box grows from the stop, all sides in proportion, then each by itself. Of the box in which
        nothing is missed on a fine lattice, a margin is left off; random base poses confirm it, and
        what they miss shrinks the box.

        Args:
            wanted: What it must hold at least; the proportions are those of it.
        """
        needed = None if wanted is None else _widened(wanted)
        start = needed or _widened(PROPORTIONS)
        if not self.holds(start):
            smaller = None if wanted is not None else self._shrunk_until_held(start)
            if smaller is None:
                return None
            start = smaller
        box = self._grown(start)
        while True:
            if min(box.x, box.y) < NARROWEST / (1.0 - MARGIN):
                return None
            if needed is not None and not box.holds(needed):
                return None
            before = len(self.misses)
            if self.holds(box, FINE) and self._is_confirmed(box):
                return Window(*((1.0 - MARGIN) * half for half in box))
            assert len(self.misses) > before, "a box is refused for a miss"
            box = _without(box, self.misses[-1], needed)

    def _shrunk_until_held(self, box: Window) -> Window | None:
        """Return a smaller box of the same proportions that holds, None if none does."""
        scale = 1.0
        while min(box.x, box.y) * scale > NARROWEST / (1.0 - MARGIN):
            scale /= 2.0
            if self.holds(_scaled(box, scale)):
                return _scaled(box, scale)
        return None

    def _grown(self, box: Window) -> Window:
        """Return a box grown from one that holds, all sides in proportion and then one by one."""
        box = self._grown_by(box, lambda scale: _scaled(box, scale))
        for side in range(3):
            held = box
            box = self._grown_by(held, lambda scale: _scaled(held, scale, side))  # noqa: B023
        return box

    def _grown_by(self, box: Window, scaled: Callable[[float], Window]) -> Window:
        """Return the largest box of a family that holds, by doubling and bisection."""
        low, high = 1.0, 2.0
        while scaled(high) != scaled(low) and self.holds(scaled(high), held=scaled(low)):
            low, high = high, 2.0 * high
        while scaled(high) != scaled(low) and high / low > FINENESS:
            middle = math.sqrt(low * high)
            if self.holds(scaled(middle), held=scaled(low)):
                low = middle
            else:
                high = middle
        return scaled(low)

    def _is_confirmed(self, box: Window) -> bool:
        """Return whether random base poses miss nothing, up to half of the margin outside."""
        wide = (1.0 - MARGIN / 2.0) * np.array(box)
        return self._finds_none(self.rng.uniform(-1.0, 1.0, (RANDOM, 3)) * wide, self.confirming)

    def _finds_none(self, offsets: FloatArray, missed: Missed | None = None) -> bool:
        """Return whether nothing is missed at offsets; the first miss is kept."""
        ends = [8, 26, *range(26 + BATCH, len(offsets) + BATCH, BATCH)]
        for start, end in itertools.pairwise([0, *ends]):
            part = offsets[start:end]
            self.scored += len(part)
            found = (missed or self.missed)(part)
            lost = np.flatnonzero(found.any(axis=1))
            if lost.size:
                for row in lost:
                    x, y, yaw = np.abs(part[row]).tolist()
                    goals = tuple(np.flatnonzero(found[row]).tolist())
                    self.misses.append(Miss((x, y, yaw), goals))
                return False
        return True


def _widened(window: Window) -> Window:
    """Return the box of which a window remains when the margin is left off."""
    return Window(*(half / (1.0 - MARGIN) for half in window))


def _scaled(box: Window, scale: float, side: int | None = None) -> Window:
    """Return a box with one side scaled, or all of them, none beyond the widest."""
    widest = _widened(WIDEST)
    return Window(
        *(
            min(half * scale, most) if side in (None, i) else half
            for i, (half, most) in enumerate(zip(box, widest, strict=True))
        )
    )


def _inside(miss: Miss, box: Window) -> bool:
    return all(at <= half for at, half in zip(miss.at, box, strict=True))


def _without(box: Window, miss: Miss, needed: Window | None) -> Window:
    """Return the largest box in a box that leaves out a miss, of those that are wide enough.

    Args:
        box: The box.
        miss: A place in it.
        needed: What the result should hold.
    """
    ratio = [at / half for at, half in zip(miss.at, box, strict=True)]
    sides = range(3)
    if needed is not None:
        wide: Sequence[int] = [i for i in sides if miss.at[i] > needed[i] * (1.0 + 1e-6)]
        sides = wide or sides  # type: ignore[assignment]
    side = max(sides, key=lambda i: ratio[i])
    # Farther off than by rounding, so that the same place is not met again and again.
    halves = list(box)
    halves[side] = min(miss.at[side], halves[side]) / FINENESS
    if needed is not None and miss.at[side] > needed[side] * (1.0 + 1e-6):
        halves[side] = max(halves[side], needed[side])
    return Window(*halves)
