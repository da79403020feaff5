"""A URDF as values: links with their geometry, and joints with their limits."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from tcs.errors import RobotError, UnknownNameError

Vector = tuple[float, float, float]

MOVABLE = ("revolute", "continuous", "prismatic")
"""Joint types with one degree of freedom; beside them only `fixed` is supported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mimic:
    """Coupling of a mimic joint to its leader: q = multiplier * q_leader + offset."""

    leader: str
    multiplier: float
    offset: float


DRIVE = "drive"
"""Name of the joint of a robot that drives with its arm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """One joint of a URDF [m or rad]."""

    name: str
    type: str
    parent: str
    child: str
    xyz: Vector
    """Origin of the joint in the parent link [m]."""
    rpy: Vector
    """Roll, pitch, yaw about the parent's fixed axes [rad]."""
    axis: Vector
    hard: tuple[float, float]
    """Limits of the `limit` element; infinite for a continuous joint."""
    soft: tuple[float, float]
    """Limits of the `safety_controller` element, within the hard ones; `hard` if there is none."""
    mimic: Mimic | None
    velocity: float = math.inf
    """Speed limit of the `limit` element [m/s or rad/s]; infinite if there is none."""
    locked: float | None = None
    """Position at which a joint is fixed that the URDF calls movable, but whose limits are one
    value [rad or m]; None for all others. The origin includes it."""

    @property
    def is_movable(self) -> bool:
        """Whether the joint has a degree of freedom."""
        return self.type in MOVABLE


def fixed_joint(parent: str, child: str, xyz: Vector, rpy: Vector) -> Joint:
    """Return a fixed joint, named after its child, given the child's pose in the parent."""
    return Joint(
        name=f"{child}_joint",
        type="fixed",
        parent=parent,
        child=child,
        xyz=xyz,
        rpy=rpy,
        axis=(1.0, 0.0, 0.0),
        hard=(0.0, 0.0),
        soft=(0.0, 0.0),
        mimic=None,
    )


SurfacesOf = Literal["all", "visual", "collision"]
"""What counts as the surface of a link: all its geometry, or one kind alone if it has any."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """One visual or collision geometry of a link."""

    role: Literal["visual", "collision"]
    shape: Literal["mesh", "box", "cylinder", "sphere"]
    size: tuple[float, ...]
    """Mesh: scale (3). Box: full sizes (3) [m]. Cylinder: radius, length [m]. Sphere: radius."""
    mesh: Path | None
    xyz: Vector
    """Origin in the link [m]."""
    rpy: Vector
    """Roll, pitch, yaw about the link's fixed axes [rad]."""
    rgba: tuple[float, float, float, float] | None
    fault: str = ""
    """Why there is no mesh at `mesh`, "" if it was found."""
    is_surface: bool = True
    """Whether it is part of the surface that may touch; if not, it is only drawn."""


@dataclass(frozen=True)
class Urdf:
    """The kinematic tree of a robot: links with their geometry, and joints."""

    path: Path
    links: Mapping[str, tuple[Geometry, ...]]
    joints: Mapping[str, Joint]

    @cached_property
    def parent_joints(self) -> Mapping[str, Joint]:
        """The joint that carries each link, by link name; the root has none."""
        return {joint.child: joint for joint in self.joints.values()}

    @property
    def root(self) -> str:
        """Name of the link without a parent joint."""
        return next(link for link in self.links if link not in self.parent_joints)

    def mounted_on(
        self, link: str, xyz: Vector, rpy: Vector, drive: tuple[float, float] | None = None
    ) -> Urdf:
        """Return the tree with its root fixed to a new root link.

        Args:
            link: Name of the new root.
            xyz: Position of the present root in the new one [m].
            rpy: Its roll, pitch, yaw about the fixed axes of the new one [rad].
            drive: How far the present root moves along its x axis [m], by the joint DRIVE; None if
                it is fixed.
        """
        joint = replace(fixed_joint(link, self.root, xyz, rpy), name=f"{link}_mount")
        if drive is not None:
            joint = replace(joint, name=DRIVE, type="prismatic", hard=drive, soft=drive)
        links = {link: (), **self.links}
        return Urdf(path=self.path, links=links, joints={joint.name: joint, **self.joints})

    def with_surfaces(self, *, of: SurfacesOf, ignored: Collection[str]) -> Urdf:
        """Return the tree with fewer surfaces; what is left out is still drawn.

        Args:
            of: Whether the visual or the collision geometry of a link, if there is any, is its
                whole surface.
            ignored: Links without a surface.
        """

        def kept(link: str, geometry: Geometry) -> bool:
            replaced = of != "all" and any(g.role == of for g in self.links[link])
            return link not in ignored and not (replaced and geometry.role != of)

        links = {
            link: tuple(replace(g, is_surface=g.is_surface and kept(link, g)) for g in geometries)
            for link, geometries in self.links.items()
        }
        return Urdf(path=self.path, links=links, joints=self.joints)

    def require_surfaces(self) -> None:
        """Refuse surfaces whose mesh was not found; one that is only drawn may be missing.

        Raises:
            RobotError: If there is one.
        """
        for geometries in self.links.values():
            for geometry in geometries:
                if geometry.is_surface and geometry.fault:
                    raise RobotError(geometry.fault)

    def joint(self, name: str, where: str) -> Joint:
        """Return a joint by name.

        Raises:
            UnknownNameError: If there is none; its message starts with `where`.
        """
        try:
            return self.joints[name]
        except KeyError:
            raise UnknownNameError("joint", name, self.joints, where=where) from None

    def links_moved_by(self, joint: str) -> frozenset[str]:
        """Return every link that a joint moves."""
        first = self.joints[joint].child
        return frozenset(link for link in self.links if self.chain(first, link) is not None)

    def chain(self, base: str, tip: str) -> tuple[Joint, ...] | None:
        """Return the joints from link `base` to link `tip`, None if `base` does not carry `tip`."""
        joints: list[Joint] = []
        link = tip
        while link != base:
            joint = self.parent_joints.get(link)
            if joint is None:
                return None
            joints.append(joint)
            link = joint.parent
        return tuple(reversed(joints))
