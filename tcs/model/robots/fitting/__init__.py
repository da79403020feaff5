"""Fitting: boxes and capsules that enclose the meshes of a robot, and the check that they do.

In: a robot file and the triangles of its meshes. Out: primitives for each body (`fit_robot`), more
of them for some (`refit`) or for parts of some (`refit_parts`), tighter ones (`tightened`), those
that are less in the way of boxes (`split_where_struck`), and how those of a robot file enclose its
surface (`enclosure`).
"""

from __future__ import annotations

from tcs.model.robots.fitting.bodies import BodyFit, fit_robot, refit, refit_parts, target_of
from tcs.model.robots.fitting.bounding import enclose_axis
from tcs.model.robots.fitting.covering import Target
from tcs.model.robots.fitting.enclosure import BodyEnclosure, enclosure
from tcs.model.robots.fitting.parts import Part
from tcs.model.robots.fitting.splitting import split_where_struck
from tcs.model.robots.fitting.tightening import Spots, tightened

__all__ = [
    "BodyEnclosure",
    "BodyFit",
    "Part",
    "Spots",
    "Target",
    "enclose_axis",
    "enclosure",
    "fit_robot",
    "refit",
    "refit_parts",
    "split_where_struck",
    "target_of",
    "tightened",
]
