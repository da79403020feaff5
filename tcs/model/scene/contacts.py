"""The contact rule: which pairs of shapes are checked, by Drake and by the kernel alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    GeometryId,
    SceneGraphInspector,
    Sphere,
)
from pydrake.multibody.tree import BodyIndex

from tcs.errors import EnvironmentFileError, UnknownNameError
from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, BoolArray
from tcs.model.scene.environment.environment_file import FLOOR


class Group(Enum):
    """Group to which a collision shape belongs."""

    ARM = "arm"
    """The scored arm and what it carries."""
    BODY = "body"
    """The rest of the robot."""
    ENVIRONMENT = "environment"
    """Furniture, person, obstacles, floor."""


@dataclass(frozen=True, slots=True)
class Part:
    """One collision shape of the scene, with its group and its body."""

    geometry: GeometryId
    body: BodyIndex
    group: Group
    carrier: int
    """Parent of the shape. Arm: number of the link, 1..7. Rest of the robot: 1 if mounted on the
    torso, 0 if fixed to the base. Environment: 0."""
    name: str
    """Name under which its contacts are reported, e.g. "person::head_center"."""
    pad: float
    """Greatest distance by which the true surface may exceed the shape [m]."""

    @property
    def kind(self) -> tuple[Group, int, str]:
        """What the contact rule looks at: a body has hundreds of shapes of one kind."""
        return self.group, self.carrier, self.name


@dataclass(frozen=True, slots=True)
class ContactRule:
    """Which pairs of shapes count as collision.

    Checked: the arm against itself, the rest of the robot and the environment; the rest of the
    robot against the environment, except the floor. The rest of the robot keeps its posture and the
    environment is static, so neither is checked against itself.

    Attributes:
        disabled_pairs: Pairs of robot bodies that are never checked, from the robot file.
        allowed_contacts: Pairs (robot body, environment body) that may touch, from the task.
        on_floor: Whether the robot stands on the floor; one on furniture is checked against it.
    """

    disabled_pairs: frozenset[frozenset[str]]
    allowed_contacts: frozenset[frozenset[str]]
    on_floor: bool = True

    @classmethod
    def of(
        cls,
        parts: Iterable[Part],
        disabled_pairs: Iterable[tuple[str, str]],
        allowed_contacts: Iterable[tuple[str, str]],
        *,
        where: str,
        on_floor: bool = True,
    ) -> ContactRule:
        """Return the rule for a robot's disabled pairs and a task's allowed contacts.

        Args:
            parts: Every part of the scene.
            disabled_pairs: Pairs of robot bodies that are never checked.
            allowed_contacts: Pairs (robot body, environment body) that may touch.
            where: The source of the allowed contacts, for the message.
            on_floor: Whether the robot stands on the floor.

        Raises:
            UnknownNameError: If an allowed contact names a body that has no shape in the scene.
        """
        robot_names, environment_names = set[str](), set[str]()
        for part in parts:
            (environment_names if part.group is Group.ENVIRONMENT else robot_names).add(part.name)
        allowed = []
        for robot_body, environment_body in allowed_contacts:
            if robot_body not in robot_names:
                raise UnknownNameError("robot body", robot_body, robot_names, where=where)
            if environment_body not in environment_names:
                raise UnknownNameError(
                    "environment body", environment_body, environment_names, where=where
                )
            allowed.append(frozenset((robot_body, environment_body)))
        return cls(
            disabled_pairs=frozenset(frozenset(pair) for pair in disabled_pairs),
            allowed_contacts=frozenset(allowed),
            on_floor=on_floor,
        )

    def is_checked(self, first: Part, second: Part) -> bool:
        """Return whether contact between two parts is checked, in either order."""
        groups = {first.group, second.group}
        names = frozenset((first.name, second.name))
        if groups in ({Group.ENVIRONMENT}, {Group.BODY}):
            return False
        if Group.ENVIRONMENT not in groups:
            moves_relatively = groups == {Group.ARM, Group.BODY} or first.carrier != second.carrier
            return moves_relatively and names not in self.disabled_pairs
        if self.on_floor and groups == {Group.BODY, Group.ENVIRONMENT} and FLOOR in names:
            return False
        return names not in self.allowed_contacts

    def checked(self, first: list[Part], second: list[Part]) -> BoolArray:
        """Return which pairs of parts are checked, shape (first, second)."""
        row_of, rows = kinds_of(first)
        column_of, columns = kinds_of(second)
        of_kinds = [[self.is_checked(a, b) for b in columns] for a in rows]
        table = np.array(of_kinds, dtype=np.bool_).reshape(len(rows), len(columns))
        return table[np.ix_(row_of, column_of)]


def kinds_of(parts: Sequence[Part]) -> tuple[list[int], list[Part]]:
    """Return for each part the number of its kind, and the first part of each kind."""
    first_of: dict[tuple[Group, int, str], Part] = {}
    for part in parts:
        first_of.setdefault(part.kind, part)
    number = {kind: i for i, kind in enumerate(first_of)}
    return [number[part.kind] for part in parts], list(first_of.values())


def shape_of(inspector: SceneGraphInspector, part: Part) -> tuple[int, tuple[float, float, float]]:
    """Return type and size of a part's shape, as the kernel encodes them [m].

    Raises:
        EnvironmentFileError: If the kernel does not support shapes of this type.
    """
    shape = inspector.GetShape(part.geometry)
    if isinstance(shape, Sphere):
        return SPHERE, (shape.radius(), 0.0, 0.0)
    if isinstance(shape, Capsule):
        return CAPSULE, (shape.radius(), shape.length() / 2, 0.0)
    if isinstance(shape, Box):
        return BOX, (shape.width() / 2, shape.depth() / 2, shape.height() / 2)
    raise EnvironmentFileError(
        f"'{part.name}': collision shape '{inspector.GetName(part.geometry)}' is a "
        f"{type(shape).__name__}, but must be a Box, Capsule or Sphere. "
        "Replace it by boxes or capsules that enclose it."
    )
