"""Which joints the person of an environment has, and where they are: posture, angles, followers."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from tcs.errors import EnvironmentFileError
from tcs.model.people.joints import JOINTS, posture_named
from tcs.model.scene.environment.environment_file import EnvironmentFile
from tcs.model.scene.person.articulated import (
    TRUNK_JOINTS,
    angles_in_file,
    articulate,
    is_seated,
    limbs,
)
from tcs.model.scene.person.posture import Posture
from tcs.model.scene.person.resized import Poses, link_poses, model_file

OF_EVERY_MODEL = ("head_turn", "head_tilt")
"""Joints of the person that the models' files have."""


@dataclass(frozen=True)
class PersonJoints:
    """Positions of the joints of an environment whose person has a posture."""

    in_file: Mapping[str, float]
    """Angles of the person's joints in the posture of the model's file [rad]; {} if the model has
    the joints of its file only."""
    joints: Mapping[str, float]
    """Joint positions that differ from 0, as `joints` of the environment file [m or rad]."""
    posture: Mapping[str, Posture]
    """Joints that follow others, as `posture` of the environment file."""

    @property
    def is_articulated(self) -> bool:
        """Whether the model of the person has all joints."""
        return bool(self.in_file)


@lru_cache(maxsize=16)
def person_joints(environment: EnvironmentFile) -> PersonJoints:
    """Return the joints of an environment, with those of its person.

    Args:
        environment: The environment.

    Raises:
        EnvironmentFileError: If the person cannot have the posture, or the model has not the links
            of the papers' person.
        UnknownNameError: If there is no posture of a name.
    """
    person = environment.person
    angles = {name: math.radians(angle) for name, angle in _angles(environment).items()}
    stated = named_joints(environment)
    if stated <= set(OF_EVERY_MODEL):
        return PersonJoints({}, {**environment.joints, **angles}, environment.posture)
    root, where = model_file(environment)
    before = link_poses(root, _followers_at_zero(environment))
    articulate(root, before, angles_in_file(before), where)
    in_file = angles_in_file(before)
    if not is_seated(before):
        _check_lying(stated, where)
        in_file = {name: at for name, at in in_file.items() if name not in TRUNK_JOINTS}
    elif person is not None and person.posture is not None:
        if posture_named(person.posture, where).lying:
            raise EnvironmentFileError(
                f"{where}: posture '{person.posture}' is that of a person who lies. Choose "
                "another, or give angles."
            )
    posture = {}
    following: set[str] = set()
    for leader, of_leader in environment.posture.items():
        joints = _renamed(of_leader, in_file, stated)
        following |= set(joints)
        if joints:
            posture[leader] = of_leader.model_copy(update={"joints": joints})
    positions = {name: at for name, at in in_file.items() if name not in following}
    return PersonJoints(in_file, {**positions, **environment.joints, **angles}, posture)


def named_joints(environment: EnvironmentFile) -> set[str]:
    """Return the joints of the person that the environment names, in any of its fields."""
    fields = (environment.joints, environment.grid, environment.observed, environment.errors)
    found = {name for field in fields for name in field}
    return (found | set(_angles(environment))) & set(JOINTS)


def _angles(environment: EnvironmentFile) -> dict[str, float]:
    """Return the angles that the person and the back rest of the wheelchair give joints [deg]."""
    found: dict[str, float] = {}
    chair = environment.wheelchair
    if chair is not None and chair.back_angle_deg:
        found["trunk_flexion"] = -chair.back_angle_deg
    return found if environment.person is None else {**found, **environment.person.angles}


def articulated_model(environment: EnvironmentFile, text: str, where: str) -> str:
    """Return a model of the person with all joints.

    Args:
        environment: The environment whose person it is.
        text: The model as SDFormat, of the size of the person.
        where: Name of the model for messages.
    """
    root = ElementTree.fromstring(text)
    before = link_poses(root, _followers_at_zero(environment))
    articulate(root, before, person_joints(environment).in_file, where)
    return ElementTree.tostring(root, encoding="unicode")


def reference_poses(environment: EnvironmentFile) -> tuple[Poses, Poses]:
    """Return the poses of the links of the papers' man in the model frame, joints at 0.

    Joints of the person that the environment names are at the angles of the file.

    Returns:
        Poses of the links of the model's file, and of the model with the joints that the
        environment names; the same where it names none.
    """
    root, where = model_file(environment)
    followers = _followers_at_zero(environment)
    in_file = link_poses(root, followers)
    found = person_joints(environment)
    if not found.is_articulated:
        return in_file, in_file
    articulate(root, in_file, found.in_file, where)
    return in_file, link_poses(root, followers | dict(found.in_file))


def _followers_at_zero(environment: EnvironmentFile) -> dict[str, float]:
    """Return the positions of the joints that follow others, which are at 0 [m or rad]."""
    found: dict[str, float] = {}
    for posture in environment.posture.values():
        found |= posture.positions(0.0)
    return found


def _renamed(
    posture: Posture, in_file: Mapping[str, float], stated: set[str]
) -> dict[str, tuple[float, ...]]:
    """Return the joints that follow, under their names in the articulated model.

    A joint that is stated follows no longer.
    """
    found = dict(posture.joints)
    at_zero = posture.positions(0.0)
    for limb in limbs():
        if limb.replaces not in found:
            continue
        positions = found.pop(limb.replaces)
        first = limb.axes[0][0]
        if first not in stated:
            shift = in_file[first] - at_zero[limb.replaces]
            found[first] = tuple(position + shift for position in positions)
    return found


def _check_lying(stated: set[str], where: str) -> None:
    """Refuse joints that a lying person has not."""
    for name in TRUNK_JOINTS:
        if name in stated:
            raise EnvironmentFileError(
                f"{where}: '{name}' is a joint of a seated person; the trunk of a lying one "
                "follows the head rest. Remove it."
            )
