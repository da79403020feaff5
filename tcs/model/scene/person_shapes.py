"""Shapes of one link of the person: boxes and capsules that are stretched along the link's axes."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from tcs.errors import EnvironmentFileError
from tcs.kernel.arrays import FloatArray
from tcs.model.people import Scale

_THINNEST = 1e-4
"""Least length of a capsule between the centres of its caps [m]: it stays a capsule."""


DIRECTIONS = 500
"""Directions in which extents are compared: 9 deg apart, so that a centimetre is found to 0.1 mm,
and along the axes, which limbs are stretched along."""


def _spread(count: int) -> FloatArray:
    """Return unit vectors spread evenly over the sphere, on a spiral, shape (count, 3)."""
    i = np.arange(count)
    z = 1.0 - (2.0 * i + 1.0) / count
    angle = i * math.pi * (3.0 - math.sqrt(5.0))
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


_DIRECTIONS = np.concatenate([_spread(DIRECTIONS), np.eye(3)])


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A box or a capsule on a link L, with a frame S at its centre."""

    is_box: bool
    size: FloatArray
    """Half sizes of a box along x, y, z of S; radius and half length of a capsule along z [m]."""
    R_LS: FloatArray
    """Orientation, shape (3, 3)."""
    p_LoSo_L: FloatArray
    """Position [m], shape (3,)."""

    def stretch(self, scale: Scale) -> LinkShape:
        """Return the shape stretched along x, y and z of the link.

        The edges of a box keep their directions and have the lengths that they are mapped to. A
        capsule is as long, with its caps, as its axis is mapped to; its radius is the geometric
        mean of what it is mapped to across the axis.
        """
        factors = np.linalg.norm(np.array(scale)[:, None] * self.R_LS, axis=0)
        p = np.array(scale) * self.p_LoSo_L
        if self.is_box:
            return LinkShape(True, factors * self.size, self.R_LS, p)
        radius, half = self.size
        thick = radius * math.sqrt(factors[0] * factors[1])
        long = max(factors[2] * (half + radius) - thick, _THINNEST / 2)
        return LinkShape(False, np.array([thick, long]), self.R_LS, p)

    def overshoot(self, scale: Scale) -> float:
        """Return how far the surface, mapped along the link's axes, stands out of `stretch` [m].

        A capsule that is stretched unevenly becomes elliptic, and its caps longer or flatter than
        round. Both bodies are convex: it is the greatest difference of their extents over the
        directions, of which DIRECTIONS are taken.
        """
        mapped = np.array(scale)[:, None] * self.R_LS
        stretched = self.stretch(scale)
        beyond = self._extents(_DIRECTIONS @ mapped) - stretched._extents(_DIRECTIONS @ self.R_LS)
        return max(0.0, float(beyond.max()))

    def _extents(self, along: FloatArray) -> FloatArray:
        """Return the extents from the centre along directions in S, shapes (n, 3) and (n,)."""
        if self.is_box:
            return np.asarray(np.abs(along) @ self.size)
        radius, half = self.size
        return np.asarray(np.abs(along[:, 2]) * half + np.linalg.norm(along, axis=1) * radius)

    def nearest(self, point: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return the point of the surface nearest to a point of the link.

        Args:
            point: Position in L [m], shape (3,).

        Returns:
            Signed distance [m], negative inside; the surface point and the outward normal there,
            in S.
        """
        q = self.R_LS.T @ (point - self.p_LoSo_L)
        if not self.is_box:
            radius, half = self.size
            centre = np.array([0.0, 0.0, np.clip(q[2], -half, half)])
            normal = _unit(q - centre)
            return float(np.linalg.norm(q - centre) - radius), centre + radius * normal, normal
        surface = np.clip(q, -self.size, self.size)
        if np.any(surface != q):
            return float(np.linalg.norm(q - surface)), surface, _unit(q - surface)
        depth = self.size - np.abs(q)
        axis = int(np.argmin(depth))
        normal = np.zeros(3)
        normal[axis] = math.copysign(1.0, q[axis])
        surface[axis] = normal[axis] * self.size[axis]
        return -float(depth[axis]), surface, normal

    def follow(self, surface: FloatArray, normal: FloatArray, stretched: LinkShape) -> FloatArray:
        """Return where a surface point of this shape is on the same shape stretched.

        Args:
            surface: Point of the surface, in S.
            normal: Outward normal there, in S; it is also the normal at the new point.
            stretched: What `stretch` returned.

        Returns:
            The new point in L [m], shape (3,).
        """
        if self.is_box:
            moved = surface * stretched.size / self.size
        else:
            (radius, half), (thick, long) = self.size, stretched.size
            along = surface - radius * normal
            moved = along * (long / half) + thick * normal
        return np.asarray(stretched.p_LoSo_L + stretched.R_LS @ moved)

    def extent(self, R: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the corners of the bounding box with the link at a pose R, p, each shape (3,)."""
        centre, R_S = p + R @ self.p_LoSo_L, R @ self.R_LS
        if self.is_box:
            reach = np.abs(R_S) @ self.size
        else:
            reach = np.abs(R_S[:, 2]) * self.size[1] + self.size[0]
        return centre - reach, centre + reach


def read_shape(element: ElementTree.Element, where: str) -> LinkShape:
    """Return the shape of a `collision` or `visual` element of SDFormat.

    Raises:
        EnvironmentFileError: If it is neither a box nor a capsule.
    """
    R, p = read_pose(element.find("pose"))
    box, capsule = element.find("geometry/box/size"), element.find("geometry/capsule")
    if box is not None:
        return LinkShape(True, 0.5 * np.array(_numbers(box)), R, p)
    if capsule is None:
        raise EnvironmentFileError(
            f"{where}: '{element.get('name')}' is neither a box nor a capsule, so that the person "
            "cannot be resized. Remove 'sex' and the measures under 'person'."
        )
    radius, length = (float(capsule.findtext(key, "0")) for key in ("radius", "length"))
    return LinkShape(False, np.array([radius, 0.5 * length]), R, p)


def write_shape(element: ElementTree.Element, shape: LinkShape) -> None:
    """Write sizes and position of a shape to the element it was read from."""
    pose = element.find("pose")
    if pose is not None:
        write_position(pose, shape.p_LoSo_L)
    box, capsule = element.find("geometry/box/size"), element.find("geometry/capsule")
    if box is not None:
        box.text = _text(2.0 * shape.size)
    elif capsule is not None:
        for key, value in (("radius", shape.size[0]), ("length", 2.0 * shape.size[1])):
            inner = capsule.find(key)
            if inner is not None:
                inner.text = repr(float(value))


def read_pose(pose: ElementTree.Element | None) -> tuple[FloatArray, FloatArray]:
    """Return orientation, shape (3, 3), and position [m] of a `pose` element; None is identity."""
    if pose is None:
        return np.eye(3), np.zeros(3)
    numbers = np.array(_numbers(pose))
    if pose.get("rotation_format") == "quat_xyzw":
        rotation = Rotation.from_quat(numbers[3:])
    else:
        rotation = Rotation.from_euler("xyz", numbers[3:], pose.get("degrees") in ("true", "1"))
    return np.asarray(rotation.as_matrix()), numbers[:3]


def write_position(pose: ElementTree.Element, position: ArrayLike) -> None:
    """Write the position [m] of a `pose` element; its orientation stays."""
    orientation = (pose.text or "").split()[3:]
    pose.text = " ".join([_text(position), *orientation])


def _numbers(element: ElementTree.Element) -> list[float]:
    return [float(word) for word in (element.text or "").split()]


def _text(numbers: ArrayLike) -> str:
    return " ".join(repr(float(number)) for number in np.asarray(numbers))


def _unit(vector: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
