"""Collada files without what is not geometry: a fault in a material must not hide a surface.

As ROS tools do, lengths are multiplied by the unit of the file, and its up axis is ignored.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

_APPEARANCE = frozenset(
    (
        "library_images",
        "library_effects",
        "library_materials",
        "library_cameras",
        "library_lights",
        "bind_material",
        "instance_camera",
        "instance_light",
    )
)
"""Elements that say how geometry looks, or from where it is seen."""


def geometry_only(content: bytes) -> tuple[bytes, float]:
    """Return a Collada file without materials, images, cameras and lights, and its unit [m].

    A reader of Collada leaves out geometry whose material it cannot read: the surface would be lost
    without a word.

    Args:
        content: The file.

    Raises:
        SyntaxError: If it is not XML.
        ValueError: If its unit is no length.
    """
    root = ElementTree.fromstring(content)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag.rpartition("}")[2] in _APPEARANCE:
                parent.remove(child)
    return ElementTree.tostring(root), _unit(root)


def _unit(root: ElementTree.Element) -> float:
    """Return the length of the unit of a Collada file [m], 1 if it names none."""
    found = root.find("{*}asset/{*}unit")
    text = "1" if found is None else found.get("meter", "1")
    unit = float(text)
    if not 1e-6 <= unit <= 1e3:
        raise ValueError(f"its unit is {text} m")
    return unit
