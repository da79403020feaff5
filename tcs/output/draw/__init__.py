"""Pictures of scores and scenes.

In: scores, place maps, solids and base footprints. Out: matplotlib figures, their bytes and files,
without a display.
"""

from __future__ import annotations

from tcs.output.draw.figure_files import FORMATS, as_png, as_svg, check_format, save_figure
from tcs.output.draw.floor_plan import BaseFootprint
from tcs.output.draw.goal_marks import GoalMark
from tcs.output.draw.map import draw_map
from tcs.output.draw.picture import ScenePanel, draw_scene
from tcs.output.draw.population import population_figure
from tcs.output.draw.solids import Category, Solid, primitive_corners
from tcs.output.draw.states import StatePanel, draw_states
from tcs.placement.tables.place_map import PlaceMap

__all__ = [
    "FORMATS",
    "BaseFootprint",
    "Category",
    "GoalMark",
    "PlaceMap",
    "ScenePanel",
    "Solid",
    "StatePanel",
    "as_png",
    "as_svg",
    "check_format",
    "draw_map",
    "draw_scene",
    "draw_states",
    "population_figure",
    "primitive_corners",
    "save_figure",
]
