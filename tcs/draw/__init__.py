"""Pictures of scores and scenes, as matplotlib figures; nothing here opens a window."""

from __future__ import annotations

from tcs.draw.files import FORMATS, check_format, save_figure
from tcs.draw.map import Stand, draw_map
from tcs.draw.picture import View, draw_scene
from tcs.draw.places import PlaceMap
from tcs.draw.solids import Kind, Solid, primitive_corners

__all__ = [
    "FORMATS",
    "Kind",
    "PlaceMap",
    "Solid",
    "Stand",
    "View",
    "check_format",
    "draw_map",
    "draw_scene",
    "primitive_corners",
    "save_figure",
]
