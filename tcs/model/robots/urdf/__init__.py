"""URDF: links, joints and geometry of a robot, read from its file.

In: the path or `package://` address of a URDF and of its meshes. Out: its tree as values
(`read_urdf`), poses and surfaces of its links, and the reduced text that Drake parses.
"""

from __future__ import annotations

from tcs.model.robots.urdf.model import Geometry, Joint, Mimic, Urdf, Vector
from tcs.model.robots.urdf.reading import ROOT, WORLD, read_urdf

__all__ = ["ROOT", "WORLD", "Geometry", "Joint", "Mimic", "Urdf", "Vector", "read_urdf"]
