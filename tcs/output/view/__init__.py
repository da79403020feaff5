"""Score files in Drake's Meshcat: sets, any other configuration, their results; and plans.

In: a score file or a plan, and its scene. Out: a live viewer, or one self-contained page.
"""

from __future__ import annotations

from tcs.output.view.controls import Controls, Slider, ViewState
from tcs.output.view.export import PlayStep, export_page, play_steps
from tcs.output.view.floor import FloorMap, floor_map
from tcs.output.view.live import Viewer, open_meshcat
from tcs.output.view.plan_view import (
    PlanView,
    make_plan_view,
    show_plan_view,
    write_plan_view,
)
from tcs.output.view.scene_objects import SceneObjects
from tcs.output.view.score_view import (
    ScoreView,
    make_score_view,
    show_score_view,
    write_score_view,
)
from tcs.output.view.viewed_set import ConfigurationResult, ViewedSet

__all__ = [
    "ConfigurationResult",
    "Controls",
    "FloorMap",
    "PlanView",
    "PlayStep",
    "SceneObjects",
    "ScoreView",
    "Slider",
    "ViewState",
    "ViewedSet",
    "Viewer",
    "export_page",
    "floor_map",
    "make_plan_view",
    "make_score_view",
    "open_meshcat",
    "play_steps",
    "show_plan_view",
    "show_score_view",
    "write_plan_view",
    "write_score_view",
]
