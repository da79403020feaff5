"""Collada files without what is not geometry: a fault in a material must not hide a surface."""

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


def geometry_only(content: bytes) -> bytes:
    """Return a Collada file without materials, images, cameras and lights.

    A reader of Collada leaves out geometry whose material it cannot read: the surface would be lost
    without a word.

    Args:
        content: The file.

    Raises:
        SyntaxError: If it is not XML.
    """
    root = ElementTree.fromstring(content)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag.rpartition("}")[2] in _APPEARANCE:
                parent.remove(child)
    return ElementTree.tostring(root)
