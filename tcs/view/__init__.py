"""A score file in Drake's Meshcat: walk through its sets, stand elsewhere, see what is reached."""

from __future__ import annotations

from tcs.view.answers import Answers, Verdict, legend
from tcs.view.controls import Controls, Slider, State
from tcs.view.export import Step, page, script
from tcs.view.floor import Floor, floor_of
from tcs.view.live import Viewer, open_meshcat
from tcs.view.props import Props

__all__ = [
    "Answers",
    "Controls",
    "Floor",
    "Props",
    "Slider",
    "State",
    "Step",
    "Verdict",
    "Viewer",
    "floor_of",
    "legend",
    "open_meshcat",
    "page",
    "script",
]
