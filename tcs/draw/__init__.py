"""Pictures of scores and scenes, as matplotlib figures; nothing here opens a window."""

from __future__ import annotations

from tcs.draw.boxes import Box, Group, draw_boxes
from tcs.draw.encoded import as_png, as_svg
from tcs.draw.files import FORMATS, check_format, save_figure
from tcs.draw.floor_plan import Stand
from tcs.draw.map import draw_map
from tcs.draw.picture import View, draw_scene
from tcs.draw.places import PlaceMap
from tcs.draw.scatter import Cloud, draw_clouds
from tcs.draw.solids import Kind, Solid, primitive_corners
from tcs.draw.states import StatePanel, draw_states

__all__ = [
    "FORMATS",
    "Box",
    "Cloud",
    "Group",
    "Kind",
    "PlaceMap",
    "Solid",
    "Stand",
    "StatePanel",
    "View",
    "as_png",
    "as_svg",
    "check_format",
    "draw_boxes",
    "draw_clouds",
    "draw_map",
    "draw_scene",
    "draw_states",
    "primitive_corners",
    "save_figure",
]
