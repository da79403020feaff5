"""Pictures of scores and scenes, as matplotlib figures; nothing here opens a window."""

from __future__ import annotations

from tcs.output.draw.boxes import Box, Group, draw_boxes
from tcs.output.draw.encoded import as_png, as_svg
from tcs.output.draw.files import FORMATS, check_format, save_figure
from tcs.output.draw.floor_plan import Stand
from tcs.output.draw.map import draw_map
from tcs.output.draw.picture import View, draw_scene
from tcs.output.draw.scatter import Cloud, draw_clouds
from tcs.output.draw.solids import Kind, Solid, primitive_corners
from tcs.output.draw.states import StatePanel, draw_states
from tcs.placement.tables.place_map import PlaceMap

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
