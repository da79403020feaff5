"""The joints of the person: a model whose limbs, head and trunk move about anatomical axes.

The models `person_seated.sdf` and `person_lying.sdf` have the joints of the papers. When a posture
or an axis of the grid names another joint of the person, the model is rebuilt with all of
`tcs.model.people.joints.JOINTS`: the links keep their shapes and frames, and where no angle is
given the posture of the file. Joints are at the origins of the links, about the axes of their
parents: x down the body or out along the limb, y to the front, z to the person's right.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.errors import EnvironmentFileError
from tcs.kernel.arrays import FloatArray
from tcs.model.people.joints import OF_HEAD_AND_TRUNK, SIDES
from tcs.model.scene.person.resized import PARENTS, ROOT, Poses

TRUNK, NECK, NECK_CARRIER = "trunk_base_link", "neck_base_link", "neck_carrier_link"
"""Links without shapes: what carries the trunk of a seated person, head and neck, and what has the
place of the neck between head and trunk of a lying person."""
TRUNK_JOINTS = ("trunk_flexion", "trunk_lean")
"""Joints that a seated person has, from the hips up."""
_LIMIT = 3.2
"""Limit of each joint [rad], beyond all ranges of motion: these are checked with the angles."""

Axis = tuple[float, float, float]


@dataclass(frozen=True)
class Limb:
    """A link that moves about axes through its origin."""

    parent: str
    """The link that carries it, on which the axes are fixed in this order."""
    link: str
    axes: tuple[tuple[str, Axis], ...]
    """Name of each joint, and its axis in the frame that the joint before it turns."""
    replaces: str = ""
    """Joint of the lying person that it stands for, whose positions count from another zero."""


def limbs() -> tuple[Limb, ...]:
    """Return the limbs, each after the one that carries it."""
    found = []
    for side in SIDES:
        # Outward is to the left on the left side; z points to the right.
        out = 1.0 if side == "left" else -1.0

        def joints(*axes: tuple[str, Axis], side: str = side) -> tuple[tuple[str, Axis], ...]:
            return tuple((f"{name}_{side}", axis) for name, axis in axes)

        flexion, abduction, outward = (0.0, 0.0, 1.0), (0.0, out, 0.0), (-out, 0.0, 0.0)
        found += [
            Limb(
                "upper_body_link",
                f"arm_{side}_link",
                joints(
                    ("shoulder_flexion", flexion),
                    ("shoulder_abduction", abduction),
                    ("shoulder_rotation", outward),
                ),
                f"body_arm_{side}",
            ),
            Limb(
                f"arm_{side}_link",
                f"forearm_{side}_link",
                joints(("elbow_flexion", flexion), ("forearm_rotation", outward)),
                f"arm_forearm_{side}",
            ),
            Limb(
                "lower_body_link",
                f"quad_{side}_link",
                joints(("hip_flexion", flexion), ("hip_abduction", abduction)),
                f"body_quad_{side}",
            ),
            Limb(
                f"quad_{side}_link",
                f"calf_{side}_link",
                joints(("knee_flexion", (0.0, 0.0, -1.0))),
                f"quad_calf_{side}",
            ),
        ]
    return tuple(found)


def angles_in_file(before: Poses) -> dict[str, float]:
    """Return the angles of the joints in the posture of the model's file [rad].

    A limb points from its joint to the next one, the trunk along x of the upper body; abduction,
    rotation and lean are 0.

    Args:
        before: Poses of the links in that posture.
    """
    R_W, _ = before["upper_body_link"]
    lines = {"upper_body_link": R_W[:, 0], "lower_body_link": R_W[:, 0]}
    for side in SIDES:
        for link, further in (("arm", "forearm"), ("forearm", "hand"), ("quad", "calf"),
                              ("calf", "foot")):  # fmt: skip
            ends = [before[f"{name}_{side}_link"][1] for name in (link, further)]
            lines[f"{link}_{side}_link"] = ends[1] - ends[0]
    found = dict.fromkeys((name for limb in limbs() for name, _ in limb.axes), 0.0)
    found |= dict.fromkeys(OF_HEAD_AND_TRUNK, 0.0)
    for limb in limbs():
        (first, axis), *_ = limb.axes
        found[first] = axis[2] * _angle(lines[limb.parent], lines[limb.link], R_W)
    return found


def _angle(line: FloatArray, further: FloatArray, R: FloatArray) -> float:
    """Return the angle from one line to another about z of a frame, in its xy-plane [rad]."""
    a, b = R.T @ line, R.T @ further
    return math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def links_at_joints() -> dict[str, str]:
    """Return the link at whose origin each link without shapes of the articulated model is."""
    found = {NECK: "upper_body_link", TRUNK: "lower_body_link"}
    found |= {_mount(name): link for name, link in found.items()}
    found[NECK_CARRIER] = "neck_link"
    found |= {f"{name}_link": limb.link for limb in limbs() for name, _ in limb.axes[:-1]}
    forward, _ = TRUNK_JOINTS
    return found | {f"{forward}_link": "lower_body_link"}


def _mount(base: str) -> str:
    """Return the name of the link that carries a base."""
    return f"{base.removesuffix('_link')}_mount_link"


def is_seated(before: Poses) -> bool:
    """Return whether the trunk is upright."""
    return bool(abs(before["upper_body_link"][0][2, 0]) > 0.7)


def articulate(
    root: ElementTree.Element, before: Poses, angles: Mapping[str, float], where: str
) -> None:
    """Give a model of the person all joints, in place.

    Args:
        root: The model; its poses are replaced by relative ones.
        before: Poses of its links in the posture of the file, its joints at the positions that
            they have there with the head rest flat.
        angles: Angles of the joints in that posture [rad]: what `angles_in_file` returns for the
            papers' man, whose orientations a resized person has.
        where: Name of the model for messages.

    Raises:
        EnvironmentFileError: If the model is not of the links of the papers' person.
    """
    for name in (ROOT, *PARENTS):
        if name not in before:
            raise EnvironmentFileError(
                f"{where} has no link '{name}', so that the person has no joints to move. Use "
                "person_seated.sdf or person_lying.sdf."
            )
    tree = _Tree(root, before)
    if is_seated(before):
        _seat(tree)
    else:
        _lay(tree)
    for limb in limbs():
        tree.limb(limb, angles)


def _seat(tree: _Tree) -> None:
    """Let the trunk of a seated person lean on the hips, and the head on the trunk."""
    forward, left = (0.0, 0.0, -1.0), (0.0, -1.0, 0.0)
    axes = tuple(zip(TRUNK_JOINTS, (forward, left), strict=True))
    tree.base(TRUNK, "lower_body_link", axes)
    for link in ("upper_body_link", "mid_body_link"):
        tree.carry(link, TRUNK)
    tree.base(NECK, "upper_body_link", (("head_lean", (0.0, -1.0, 0.0)),))
    tree.carry("neck_link", NECK)
    tree.carry("head_turn_link", NECK)
    for side in SIDES:
        for link, parent in (("hand", "forearm"), ("foot", "calf")):
            tree.carry(f"{link}_{side}_link", f"{parent}_{side}_link")


def _lay(tree: _Tree) -> None:
    """Let the head of a lying person lean on the trunk, which hangs from the head."""
    tree.base(NECK, "upper_body_link", (("head_lean", (0.0, -1.0, 0.0)),), carrier="head_link")
    tree.twin("neck_link", NECK_CARRIER, "upper_body_link")
    tree.carry("neck_link", NECK)
    tree.carry("head_turn_link", NECK)


class _Tree:
    """The links and joints of a model that is being changed."""

    def __init__(self, root: ElementTree.Element, before: Poses) -> None:
        model = root.find("model")
        assert model is not None
        self._model = model
        self._links = {link.get("name", ""): link for link in model.findall("link")}
        self._joints = {joint.findtext("child", ""): joint for joint in model.findall("joint")}
        self._before = dict(before)

    def carry(self, link: str, carrier: str) -> None:
        """Attach a link to another one, at its present pose; its joint stays of its type."""
        _set(self._joints[link], "parent", carrier)
        self._place(link, carrier, *self._relative(carrier, link))

    def base(
        self,
        name: str,
        at: str,
        axes: tuple[tuple[str, Axis], ...],
        *,
        carrier: str = "",
    ) -> None:
        """Add a link without shapes that turns about the origin of a link, with the trunk's axes.

        Args:
            name: The new link.
            at: The link at whose origin it is.
            axes: Names and axes of its joints.
            carrier: The link that it is attached to, by default `at`.
        """
        self._before[name] = self._before["upper_body_link"][0], self._before[at][1]
        self._links[name] = ElementTree.SubElement(self._model, "link", name=name)
        carrier = carrier or at
        mount = _mount(name)
        self._before[mount] = self._before[name]
        self._links[mount] = ElementTree.SubElement(self._model, "link", name=mount)
        self._place(mount, carrier, *self._relative(carrier, mount))
        self._joints[mount] = self._fixed(carrier, mount)
        self._chain(mount, name, axes, np.eye(3), np.zeros(3), {})

    def twin(self, link: str, name: str, child: str) -> None:
        """Let a new link take the place of a link between its carrier and its child."""
        joint, pose = self._joints.pop(link), _pose(self._links[link])
        self._links[name] = ElementTree.SubElement(self._model, "link", name=name)
        self._links[name].append(pose)
        self._links[link].remove(pose)
        self._before[name] = self._before[link]
        _set(joint, "child", name)
        self._joints[name] = joint
        self._joints[link] = self._fixed(name, link)
        _set(self._joints[child], "parent", name)
        _pose(self._links[child]).set("relative_to", name)

    def limb(self, limb: Limb, angles: Mapping[str, float]) -> None:
        """Replace the joint of a limb by those of its axes."""
        self._model.remove(self._joints.pop(limb.link))
        R, p = self._relative(limb.parent, limb.link)
        self._chain(limb.parent, limb.link, limb.axes, R, p, angles)

    def _chain(
        self,
        parent: str,
        link: str,
        axes: tuple[tuple[str, Axis], ...],
        R: FloatArray,
        p: FloatArray,
        angles: Mapping[str, float],
    ) -> None:
        """Connect a link to its parent by joints through its origin; R and p are at `angles`."""
        turned = np.eye(3)
        for number, (name, axis) in enumerate(axes):
            is_last = number == len(axes) - 1
            child = link if is_last else f"{name}_link"
            turned = turned @ _rotation(axis, angles.get(name, 0.0))
            if not is_last:
                self._links[child] = ElementTree.SubElement(self._model, "link", name=child)
            self._place(child, parent, turned.T @ R if is_last else np.eye(3), p)
            self._joints[child] = self._revolute(name, parent, child, axis)
            parent, p = child, np.zeros(3)

    def _relative(self, carrier: str, link: str) -> tuple[FloatArray, FloatArray]:
        """Return orientation and position of a link in another."""
        (R, p), (R_link, p_link) = self._before[carrier], self._before[link]
        return R.T @ R_link, R.T @ (p_link - p)

    def _place(self, link: str, over: str, R: FloatArray, p: FloatArray) -> None:
        """Write the pose of a link relative to another."""
        pose = _pose(self._links[link])
        pose.attrib.clear()
        pose.set("relative_to", over)
        pose.set("rotation_format", "quat_xyzw")
        numbers = [*p.tolist(), *Rotation.from_matrix(R).as_quat().tolist()]
        pose.text = " ".join(map(repr, numbers))

    def _fixed(self, parent: str, child: str) -> ElementTree.Element:
        joint = ElementTree.SubElement(self._model, "joint", name=f"{child}_fixed", type="fixed")
        _set(joint, "parent", parent)
        _set(joint, "child", child)
        return joint

    def _revolute(self, name: str, parent: str, child: str, axis: Axis) -> ElementTree.Element:
        joint = ElementTree.SubElement(self._model, "joint", name=name, type="revolute")
        _set(joint, "parent", parent)
        _set(joint, "child", child)
        of_axis = ElementTree.SubElement(joint, "axis")
        direction = ElementTree.SubElement(of_axis, "xyz", expressed_in=parent)
        direction.text = " ".join(map(repr, axis))
        limit = ElementTree.SubElement(of_axis, "limit")
        _set(limit, "lower", repr(-_LIMIT))
        _set(limit, "upper", repr(_LIMIT))
        return joint


def _rotation(axis: Axis, angle: float) -> FloatArray:
    return np.asarray(Rotation.from_rotvec(angle * np.array(axis)).as_matrix())


def _pose(link: ElementTree.Element) -> ElementTree.Element:
    """Return the pose element of a link, added if it has none."""
    pose = link.find("pose")
    return ElementTree.SubElement(link, "pose") if pose is None else pose


def _set(element: ElementTree.Element, key: str, text: str) -> None:
    """Write the text of a child element, added if there is none."""
    child = element.find(key)
    child = ElementTree.SubElement(element, key) if child is None else child
    child.text = text
