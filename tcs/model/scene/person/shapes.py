"""Shapes of one link of the person: boxes and capsules, read from and written to SDFormat."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from tcs.errors import EnvironmentFileError
from tcs.kernel.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A box or a capsule on a link L, with a frame S at its centre.

    Leading axes of the arrays count people; `nearest` is of one.
    """

    is_box: bool
    size: FloatArray
    """Half sizes of a box along x, y, z of S; radius and half length of a capsule along z [m]."""
    R_LS: FloatArray
    """Orientation, shape (3, 3)."""
    p_LoSo_L: FloatArray
    """Position [m], shape (3,)."""

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

    def reach(self, direction: FloatArray) -> FloatArray:
        """Return how far the shape extends from the origin of L along a unit vector in L [m]."""
        across = np.abs(np.vecmat(direction, self.R_LS))
        if self.is_box:
            half = np.vecdot(across, self.size)
        else:
            half = self.size[..., 0] + across[..., 2] * self.size[..., 1]
        return np.asarray(np.vecdot(direction, self.p_LoSo_L) + half)

    def extent(self, R: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the corners of the bounding box with the link at a pose R, p, each (..., 3)."""
        centre, R_S = p + np.matvec(R, self.p_LoSo_L), np.abs(R @ self.R_LS)
        if self.is_box:
            reach = np.matvec(R_S, self.size)
        else:
            reach = R_S[..., :, 2] * self.size[..., 1, None] + self.size[..., 0, None]
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
    """Write size and pose of a shape to an element with a shape of the same type."""
    pose = element.find("pose")
    if pose is None:
        pose = ElementTree.Element("pose")
        element.insert(0, pose)
    turned = not np.array_equal(read_pose(pose)[0], shape.R_LS)
    write_position(pose, shape.p_LoSo_L)
    if turned:
        pose.attrib.clear()
        pose.set("rotation_format", "quat_xyzw")
        quaternion = Rotation.from_matrix(shape.R_LS).as_quat()
        pose.text = f"{_text(shape.p_LoSo_L)} {_text(quaternion)}"
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
