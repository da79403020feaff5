"""Base placement for assistive robots: task-centric selection of initial configurations (TCS).

The names in `__all__` are the public interface. They are loaded on first use: `import tcs` is
immediate, and selecting from a score file loads neither Drake nor a compiler.

>>> import tcs
>>> here = tcs.InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.14, torso=0.0)
>>> weights = tcs.UtilityWeights(travel=0.1)
"""

from __future__ import annotations

import time
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tcs.errors import TcsError
    from tcs.files.blocks import BlockFolder
    from tcs.model.grid import InitialConfiguration
    from tcs.model.scene import Observation
    from tcs.motion import MotionPlan, evaluate, examine, plan, refine, robustify
    from tcs.placement.constraints import Constraints, Obstacle, Region
    from tcs.placement.parking import select
    from tcs.placement.population import Population, population
    from tcs.placement.reasons import Explanation, explain
    from tcs.placement.refinement import Placement, place
    from tcs.placement.robustness import Evaluation
    from tcs.placement.scoring import (
        LiveScorer,
        Verification,
        score,
        score_observed,
        summary,
        verify,
    )
    from tcs.placement.selection import Choice, Top, TravelWeights, UtilityWeights
    from tcs.placement.store import ScoreFile
    from tcs.placement.store import load_scores as load
    from tcs.placement.store import save_scores as save

    __version__: str

__all__ = [
    "BlockFolder",
    "Choice",
    "Constraints",
    "Evaluation",
    "Explanation",
    "InitialConfiguration",
    "LiveScorer",
    "MotionPlan",
    "Observation",
    "Obstacle",
    "Placement",
    "Population",
    "Region",
    "ScoreFile",
    "TcsError",
    "Top",
    "TravelWeights",
    "UtilityWeights",
    "Verification",
    "__version__",
    "evaluate",
    "examine",
    "explain",
    "load",
    "place",
    "plan",
    "population",
    "refine",
    "robustify",
    "save",
    "score",
    "score_observed",
    "select",
    "summary",
    "verify",
]

loaded_at = time.time()
"""When this process began to import the package [s since 1970]."""

_HOMES = {
    "BlockFolder": ("tcs.files.blocks", "BlockFolder"),
    "Choice": ("tcs.placement.selection", "Choice"),
    "Constraints": ("tcs.placement.constraints", "Constraints"),
    "Evaluation": ("tcs.placement.robustness", "Evaluation"),
    "Explanation": ("tcs.placement.reasons", "Explanation"),
    "InitialConfiguration": ("tcs.model.grid", "InitialConfiguration"),
    "LiveScorer": ("tcs.placement.scoring", "LiveScorer"),
    "MotionPlan": ("tcs.motion", "MotionPlan"),
    "Observation": ("tcs.model.scene", "Observation"),
    "Obstacle": ("tcs.placement.constraints", "Obstacle"),
    "Population": ("tcs.placement.population", "Population"),
    "Region": ("tcs.placement.constraints", "Region"),
    "ScoreFile": ("tcs.placement.store", "ScoreFile"),
    "TcsError": ("tcs.errors", "TcsError"),
    "Top": ("tcs.placement.selection", "Top"),
    "TravelWeights": ("tcs.placement.selection", "TravelWeights"),
    "UtilityWeights": ("tcs.placement.selection", "UtilityWeights"),
    "Verification": ("tcs.placement.scoring", "Verification"),
    "evaluate": ("tcs.motion", "evaluate"),
    "examine": ("tcs.motion", "examine"),
    "explain": ("tcs.placement.reasons", "explain"),
    "load": ("tcs.placement.store", "load_scores"),
    "Placement": ("tcs.placement.refinement", "Placement"),
    "place": ("tcs.placement.refinement", "place"),
    "plan": ("tcs.motion", "plan"),
    "population": ("tcs.placement.population", "population"),
    "refine": ("tcs.motion", "refine"),
    "robustify": ("tcs.motion", "robustify"),
    "save": ("tcs.placement.store", "save_scores"),
    "score": ("tcs.placement.scoring", "score"),
    "score_observed": ("tcs.placement.scoring", "score_observed"),
    "summary": ("tcs.placement.scoring", "summary"),
    "select": ("tcs.placement.parking", "select"),
    "verify": ("tcs.placement.scoring", "verify"),
}
"""Module and attribute of each public name."""


def __getattr__(name: str) -> Any:
    """Return a public name, importing its module."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("tcs")
    elif name in _HOMES:
        module, attribute = _HOMES[name]
        value = getattr(import_module(module), attribute)
    else:
        raise AttributeError(f"module 'tcs' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
