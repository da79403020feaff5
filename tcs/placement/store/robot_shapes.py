"""The robot's collision shapes as stored with its scores: enough to test an obstacle seen later."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SPHERE, CAPSULE, BOX = 0, 1, 2
"""Shape types, as in the kernel. `size` holds: sphere (radius, 0, 0); capsule along its own z
(radius, half length between cap centres, 0); box (three half sizes) [m]."""

ARM_JOINTS = 7

_WHERE = "metadata 'robot_shapes'"


@dataclass(frozen=True, slots=True)
class Primitives:
    """n spheres, capsules and boxes, each in the frame of the part that carries it."""

    type: IntArray
    """SPHERE, CAPSULE or BOX, shape (n,)."""
    size: FloatArray
    """Sizes [m], shape (n, 3)."""
    pad: FloatArray
    """Greatest distance by which the true surface may exceed the shape [m], shape (n,)."""
    frame: IntArray
    """Part that carries the shape, shape (n,). Arm: number of the link, 1 to 7. Body: 0 fixed to
    the base, 1 mounted on the torso."""
    R: FloatArray
    """Orientations, shape (n, 3, 3)."""
    p: FloatArray
    """Centres [m], shape (n, 3)."""

    @property
    def inner(self) -> FloatArray:
        """Radius of the inscribed sphere about each centre [m], shape (n,)."""
        return np.where(self.type == BOX, self.size.min(axis=1, initial=np.inf), self.size[:, 0])

    @property
    def bound(self) -> FloatArray:
        """Radius of the bounding sphere about each centre [m], shape (n,)."""
        capsule = self.size[:, 0] + self.size[:, 1]
        return np.where(self.type == BOX, np.linalg.norm(self.size, axis=1), capsule)


@dataclass(frozen=True)
class RobotShapes:
    """The robot at torso level 0, as lowered from the Drake plant that was scored.

    Link frames are those of the kernel's chain: X_AL1 = F[0] Rz(q1), X_ALi = X_AL(i-1) F[i-1]
    Rz(qi), with A the arm's base.
    """

    chain_R: FloatArray
    """Rotations of F, shape (8, 3, 3)."""
    chain_p: FloatArray
    """Translations of F [m], shape (8, 3)."""
    arm_base_R: FloatArray
    """Orientation of A in the base frame B, shape (3, 3)."""
    arm_base_p: FloatArray
    """Origin of A in B [m], shape (3,)."""
    torso_shift: FloatArray
    """Displacement of the torso at each of its levels from level 0, in B [m], shape (levels, 3)."""
    arm: Primitives
    """The shapes of the scored arm, in link frames."""
    body: Primitives
    """All other shapes, in B."""
    margin: float
    """Least clearance [m]: shapes closer than this collide."""
    slides: FloatArray = field(default_factory=lambda: np.zeros(ARM_JOINTS))
    """Motion of each prismatic joint per unit [m/m], 0 for a revolute joint, shape (7,)."""
    coupled: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """Links between coupled joints, which carry shapes as links 8 and up: index of their joint, and
    the fraction of its motion that the link makes, shape (n, 2)."""
    rest: FloatArray = field(default_factory=lambda: np.zeros((0, ARM_JOINTS)))
    """Rest postures of the arm [rad], shape (n, 7)."""

    @cached_property
    def at_stop(self) -> Primitives:
        """The shapes in B at a stop: those of the body, and the arm's in each rest posture."""
        parts = [self.body]
        level = np.zeros(1, dtype=np.int64)
        for q in self.rest:
            links_R, links_p = (poses[0] for poses in self.link_poses(q[None], level))
            R, link = links_R[self.arm.frame - 1], self.arm.frame - 1
            p = links_p[link] + np.einsum("nij,nj->ni", R, self.arm.p)
            parts.append(replace(self.arm, frame=np.ones_like(link), R=R @ self.arm.R, p=p))
        return Primitives(
            **{name: np.concatenate([getattr(one, name) for one in parts]) for name in _COLUMNS}
        )

    def link_poses(self, q: FloatArray, level: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the poses of the arm's links in B.

        Args:
            q: Arm joints [rad], shape (n, 7).
            level: Torso levels, shape (n,).

        Returns:
            Shapes (n, links, 3, 3) and (n, links, 3): links 1 to 7, then the coupled ones.
        """
        links = ARM_JOINTS + len(self.coupled)
        R = np.broadcast_to(self.arm_base_R, (len(q), 3, 3))
        p = self.arm_base_p + self.torso_shift[level]
        links_R, links_p = np.empty((len(q), links, 3, 3)), np.empty((len(q), links, 3))
        for joint in range(ARM_JOINTS):
            p, R = p + R @ self.chain_p[joint], R @ self.chain_R[joint]
            if self.slides[joint]:
                p = p + self.slides[joint] * q[:, joint, None] * R[:, :, 2]
            else:
                R = R @ _rotation_z(q[:, joint])
            links_R[:, joint], links_p[:, joint] = R, p
        for i, (of, fraction) in enumerate(self.coupled, ARM_JOINTS):
            joint = int(of)
            back = (1.0 - fraction) * self.slides[joint] * q[:, joint, None]
            links_R[:, i] = links_R[:, joint]
            links_p[:, i] = links_p[:, joint] - back * links_R[:, joint, :, 2]
        return links_R, links_p

    def to_dict(self) -> dict[str, Any]:
        """Return the shapes as plain containers, for the metadata of a score file."""
        return {
            **{name: getattr(self, name).ravel().tolist() for name in (*_ARRAYS, *_ADDED)},
            **{
                part: {
                    name: getattr(getattr(self, part), name).ravel().tolist() for name in _COLUMNS
                }
                for part in ("arm", "body")
            },
            "margin": self.margin,
        }

    @classmethod
    def from_dict(cls, plain: object) -> Self:
        """Return the shapes that `to_dict` wrote.

        Raises:
            StoreError: If they are not of that form.
        """
        if not isinstance(plain, dict):
            raise StoreError(f"{_WHERE} must be a mapping.")
        margin = plain.get("margin")
        if not isinstance(margin, float) or not 0.0 <= margin < math.inf:
            raise StoreError(f"{_WHERE}: margin must be a number >= 0.")
        given = _ARRAYS | {name: shape for name, shape in _ADDED.items() if name in plain}
        arrays = {name: _array(plain, name, shape) for name, shape in given.items()}
        arm, body = (_primitives(plain.get(part)) for part in ("arm", "body"))
        coupled = arrays.get("coupled", np.zeros((0, 2)))
        links = ARM_JOINTS + len(coupled)
        if np.any((arm.frame < 1) | (arm.frame > links)) or np.any(body.frame >> 1):
            raise StoreError(f"{_WHERE}: a shape is on a part that the robot does not have.")
        if np.any((coupled[:, 0] < 0) | (coupled[:, 0] >= ARM_JOINTS)):
            raise StoreError(
                f"{_WHERE}: a link is coupled to a joint that the robot does not have."
            )
        return cls(**arrays, arm=arm, body=body, margin=margin)


_ARRAYS = {
    "chain_R": (ARM_JOINTS + 1, 3, 3),
    "chain_p": (ARM_JOINTS + 1, 3),
    "arm_base_R": (3, 3),
    "arm_base_p": (3,),
    "torso_shift": (-1, 3),
}
_ADDED = {"slides": (ARM_JOINTS,), "coupled": (-1, 2), "rest": (-1, ARM_JOINTS)}
"""Arrays that files of earlier versions do not have."""
_COLUMNS = {"type": (-1,), "size": (-1, 3), "pad": (-1,), "frame": (-1,), "R": (-1, 3, 3)} | {
    "p": (-1, 3)
}
_WHOLE = ("type", "frame")


def _primitives(plain: object) -> Primitives:
    """Return shapes of the form of `RobotShapes.to_dict`."""
    if not isinstance(plain, dict):
        raise StoreError(f"{_WHERE} must have 'arm' and 'body'.")
    columns: dict[str, Any] = {name: _array(plain, name, shape) for name, shape in _COLUMNS.items()}
    if len({len(column) for column in columns.values()}) != 1:
        raise StoreError(f"{_WHERE}: the columns of the shapes differ in length.")
    if np.any(columns["size"] < 0.0) or np.any(columns["pad"] < 0.0):
        raise StoreError(f"{_WHERE}: a size is negative.")
    for name in _WHOLE:
        columns[name] = columns[name].astype(np.int64)
    if np.any((columns["type"] < SPHERE) | (columns["type"] > BOX)):
        raise StoreError(f"{_WHERE}: a shape has an unknown type.")
    return Primitives(**columns)


def _array(plain: Mapping[str, object], name: str, shape: tuple[int, ...]) -> FloatArray:
    """Return an array of finite numbers from a flat list; -1 stands for any length."""
    values = plain.get(name)
    row = abs(math.prod(shape))
    if (
        not isinstance(values, list)
        or not all(isinstance(v, int | float) and math.isfinite(v) for v in values)
        or (len(values) % row if shape[0] == -1 else len(values) != row)
    ):
        raise StoreError(f"{_WHERE}: '{name}' must be a list of finite numbers of shape {shape}.")
    return np.array(values, dtype=np.float64).reshape(shape)


def _rotation_z(angle: FloatArray) -> FloatArray:
    """Return rotations about z, shape (m, 3, 3)."""
    R = np.zeros((len(angle), 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angle)
    R[:, 1, 0] = np.sin(angle)
    R[:, 0, 1] = -R[:, 1, 0]
    R[:, 2, 2] = 1.0
    return R
