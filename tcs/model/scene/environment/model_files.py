"""Types of the files that models and obstacles are read from, and the check of a model file.

Drake ends the process for some numbers (an infinite size, a pose of NaN) and accepts others that no
furniture has, so every number of a model file is checked before Drake parses it.
"""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

from tcs.errors import EnvironmentFileError
from tcs.files.quantities import (
    ANGLE,
    ANGLE_DEG,
    ENTRIES,
    JOINT_LIMIT,
    MESH_SCALE,
    POSITION,
    SIZE,
    Quantity,
)
from tcs.files.xml_documents import read_xml

SUFFIXES = (".sdf", ".urdf")
"""Types of model files: SDFormat, and URDF."""
MESHES = (".obj", ".stl", ".ply", ".dae", ".glb", ".gltf")
"""Types of meshes."""
CLOUDS = (".npy", ".pcd", ".ply")
"""Types of point clouds; a PLY file with faces is a mesh."""
RESERVED = "world"
"""Name that Drake gives to the body that does not move; a link of that name would be this body."""

_SIZES = ("size", "radius", "radii", "length")
_BOUNDS = ("lower", "upper", "effort", "velocity")
"""Elements of a joint's limits: SDFormat writes infinity, or 1e16, for none."""
_UNBOUNDED = 1e15
_PARENTS_OF_AXIS = ("axis", "axis2")
_GREATEST = 1e9
"""Greatest magnitude of any other number, such as a mass or a stiffness."""


def check_model_file(path: Path, where: str, *, above: tuple[str, ...] = ()) -> None:
    """Refuse a model file with a number or a name that no furniture has.

    Args:
        path: The file.
        where: Name of the file in messages.
        above: Files that include this one.

    Raises:
        EnvironmentFileError: If the file cannot be read, is not SDFormat or URDF, or a number in it
            is out of its physical range.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise EnvironmentFileError(
            f"{where} must be an SDFormat or URDF file, with a name in {' or '.join(SUFFIXES)}; an "
            f"obstacle may also be a mesh ({', '.join(MESHES)}) or a point cloud "
            f"({', '.join(CLOUDS)})."
        )
    root = read_xml(path, where, EnvironmentFileError)
    _check_counts(root, where)
    for element in root.iter():
        _check_names(element, where)
        for name, numbers in _number_lists(element):
            _check_numbers(element, name, numbers, where)
    real = os.path.realpath(path)
    for uri in root.findall(".//include/uri"):
        inner = (uri.text or "").strip().removeprefix("file://")
        if "://" in inner:
            raise EnvironmentFileError(
                f"{where}: it includes '{inner}'. Write the path of the file beside it instead."
            )
        included = os.path.realpath(path.parent / inner)
        if included in (real, *above):
            raise EnvironmentFileError(
                f"{where}: it includes '{inner}', which includes it in turn."
            )
        check_model_file(Path(included), f"{where}, included '{inner}'", above=(*above, real))


def _check_counts(root: ElementTree.Element, where: str) -> None:
    for tag in ("link", "joint", "collision", "visual", "frame", "model"):
        count = sum(1 for _ in root.iter(tag))
        ENTRIES.check(count, f"{where}: its number of '{tag}' elements", EnvironmentFileError)


def _check_names(element: ElementTree.Element, where: str) -> None:
    name = element.get("name")
    if element.tag in ("link", "model") and name in (RESERVED, "static", ""):
        raise EnvironmentFileError(
            f"{where}: a {element.tag} is named '{name}', which is reserved. Rename it."
        )


def _number_lists(element: ElementTree.Element) -> Iterator[tuple[str, list[float]]]:
    """Yield the name and the numbers of the text and the attributes that hold numbers only."""
    texts = [(element.tag, element.text or "")] if len(element) == 0 else []
    for name, text in (*texts, *element.attrib.items()):
        numbers = []
        for word in text.split():
            try:
                numbers.append(float(word))
            except ValueError:
                break
        else:
            if numbers:
                yield name, numbers


def _check_numbers(
    element: ElementTree.Element, name: str, numbers: list[float], where: str
) -> None:
    """Refuse a number that is out of the range of what it measures."""
    here = f"{where}: a number of '{name}'"
    if name == "pose":
        _check(POSITION, numbers[:3], here)
        angles = numbers[3:]
        if element.get("rotation_format") != "quat_xyzw":
            degrees = element.get("degrees") in ("true", "1")
            _check(ANGLE_DEG if degrees else ANGLE, angles, here)
            return
        if len(angles) != 4 or not 0.5 <= math.hypot(*angles) <= 2.0:
            raise EnvironmentFileError(
                f"{here} is a quaternion {angles}, but its length must be 1."
            )
    elif name in _SIZES:
        _check(SIZE, numbers, here)
    elif name == "scale":
        _check(MESH_SCALE, numbers, here)
    elif name == "xyz" and element.tag in ("xyz", *_PARENTS_OF_AXIS):
        if not 1e-3 <= math.hypot(*numbers) <= 1e3:
            raise EnvironmentFileError(
                f"{here} is the axis {numbers}, but an axis must have a direction: a vector of "
                "length 1."
            )
    elif name == "xyz":
        _check(POSITION, numbers, here)
    elif name == "rpy":
        _check(ANGLE, numbers, here)
    elif name in _BOUNDS:
        # Infinity, and SDFormat's 1e16, stand for no limit.
        if name in ("lower", "upper"):
            _check(JOINT_LIMIT, [n for n in numbers if not abs(n) >= _UNBOUNDED], here)
        elif any(math.isnan(n) for n in numbers):
            raise EnvironmentFileError(f"{here} is not a number.")
    elif not all(abs(number) <= _GREATEST for number in numbers):
        raise EnvironmentFileError(
            f"{here} is {max(numbers, key=abs):g}, but must be {-_GREATEST:g} to {_GREATEST:g}."
        )


def _check(quantity: Quantity, numbers: list[float], where: str) -> None:
    quantity.check(numbers, where, EnvironmentFileError)
