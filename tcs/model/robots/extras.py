"""The URDF of a robot extended by the frames and bodies that its robot file adds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tcs.model.robots.robot_file import BodyPrimitive, RobotFile
from tcs.model.robots.urdf import Geometry, Joint, Urdf
from tcs.model.robots.urdf.kinematic import urdf_text
from tcs.model.robots.urdf.model import fixed_joint


def model_with_extras(robot: RobotFile) -> Urdf:
    """Return the URDF with the extra frames and bodies as further links on fixed joints.

    An extra body has no mesh: its primitives serve as its surface. A capsule becomes a cylinder
    with a sphere at either end.

    Raises:
        RobotError: If the URDF cannot be used.
    """
    model = robot.model()
    links, joints = dict(model.links), dict(model.joints)
    for joint in _extra_joints(robot):
        links[joint.child] = ()
        joints[joint.name] = joint
    for body in robot.bodies:
        links[body.name] = tuple(g for shape in body.primitives for g in _geometries(shape))
    return Urdf(path=model.path, links=links, joints=joints)


def robot_urdf(robot: RobotFile, meshes: bool = False) -> str:
    """Return `urdf_text` of a robot with its extra frames and bodies as further links.

    Args:
        robot: The robot.
        meshes: Whether to keep visual geometry, its meshes converted to OBJ in the user's cache.

    Raises:
        RobotError: If the URDF or one of its meshes cannot be used.
    """
    return urdf_text(model_with_extras(robot), meshes)


def _extra_joints(robot: RobotFile) -> tuple[Joint, ...]:
    """Return the fixed joints that carry a robot's extra frames and bodies."""
    return tuple(
        fixed_joint(extra.parent, extra.name, extra.xyz, extra.rpy)
        for extra in (*robot.frames, *robot.bodies)
    )


def _geometries(shape: BodyPrimitive) -> tuple[Geometry, ...]:
    geometry = Geometry(
        role="collision",
        shape="box",
        size=shape.size,
        mesh=None,
        xyz=shape.xyz,
        rpy=shape.rpy,
        rgba=None,
    )
    if shape.kind == "box":
        return (geometry,)
    sphere = replace(geometry, shape="sphere", size=shape.size[:1])
    if shape.kind == "sphere":
        return (sphere,)
    # Imported where it is needed: it is slow to import, and few robots have capsules of their own.
    from scipy.spatial.transform import Rotation

    along = Rotation.from_euler("xyz", shape.rpy).as_matrix()[:, 2] * (shape.size[1] / 2)
    ends = np.array(shape.xyz) + np.stack([along, -along])
    caps = tuple(replace(sphere, xyz=(float(x), float(y), float(z))) for x, y, z in ends)
    return (replace(geometry, shape="cylinder"), *caps)
