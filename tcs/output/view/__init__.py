"""A score file in Drake's Meshcat: walk through its sets, stand elsewhere, see what is reached."""

from __future__ import annotations

from tcs.output.view.answers import Answers, Verdict
from tcs.output.view.controls import Controls, Slider, State
from tcs.output.view.export import Step, page, script
from tcs.output.view.floor import Floor, floor_of
from tcs.output.view.live import Viewer, open_meshcat
from tcs.output.view.props import Props

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
    "open_meshcat",
    "page",
    "script",
]
