"""Interval arithmetic: arrays of numbers and vectors, each known to lie between two ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Interval:
    """Arrays of numbers between two ends."""

    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, value: FloatArray | float) -> Self:
        """Return an exact number."""
        array = np.asarray(value, dtype=np.float64)
        return cls(array, array)

    @classmethod
    def joined(cls, a: Self, b: Self) -> Self:
        """Return the rows of two, one after the other."""
        return cls(np.concatenate([a.low, b.low]), np.concatenate([a.high, b.high]))

    def rows(self, rows: NDArray[Any]) -> Interval:
        """Return some rows."""
        return Interval(self.low[rows], self.high[rows])

    def column(self, number: int) -> Interval:
        """Return a column."""
        return Interval(self.low[:, number], self.high[:, number])

    def __add__(self, other: Interval) -> Interval:
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Interval) -> Interval:
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        return Interval(np.minimum.reduce(ends), np.maximum.reduce(ends))

    def square(self) -> Interval:
        """Return the square, which is not negative."""
        ends = np.abs(self.low), np.abs(self.high)
        crosses = (self.low <= 0.0) & (self.high >= 0.0)
        return Interval(np.where(crosses, 0.0, np.minimum(*ends)) ** 2, np.maximum(*ends) ** 2)


Vector = tuple[Interval, Interval, Interval]
"""Three numbers, between two ends each."""


def cosine(angle: Interval) -> Interval:
    """Return the cosine of angles whose intervals are narrower than pi."""
    ends = np.cos(angle.low), np.cos(angle.high)
    turn = 2.0 * np.pi
    has_top = np.floor(angle.high / turn) > np.floor(angle.low / turn)
    has_top |= np.mod(angle.low, turn) == 0.0
    has_bottom = np.floor(angle.high / turn - 0.5) > np.floor(angle.low / turn - 0.5)
    return Interval(
        np.where(has_bottom, -1.0, np.minimum(*ends)), np.where(has_top, 1.0, np.maximum(*ends))
    )


def turned(v: Vector, angle: Interval, sign: float) -> Vector:
    """Return a vector rotated about z by an angle, or by its negative."""
    c = cosine(angle)
    s = cosine(angle - Interval.of(np.pi / 2.0))
    s = s if sign > 0.0 else Interval(-s.high, -s.low)
    return c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]


def moved(R: FloatArray, p: FloatArray, v: Vector) -> Vector:
    """Return R v + p."""
    rows = []
    for row, offset in zip(R, p, strict=True):
        total = Interval.of(offset)
        for factor, part in zip(row, v, strict=True):
            if abs(factor) > 0.0:
                total = total + Interval.of(factor) * part
        rows.append(total)
    return rows[0], rows[1], rows[2]


def fixed(v: FloatArray) -> Vector:
    """Return an exact vector."""
    return Interval.of(v[0]), Interval.of(v[1]), Interval.of(v[2])


def less(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def dot(a: Vector, b: Vector) -> Interval:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def square_of(a: Vector) -> Interval:
    """Return a . a."""
    return a[0].square() + a[1].square() + a[2].square()
