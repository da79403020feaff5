"""Where should an assistive robot stand? Task-centric selection of initial configurations.

Everything in `__all__` is a promise to users. Names are loaded when they are first used:
`import tcs` costs nothing, and choosing from a score file loads neither Drake nor a compiler.

>>> import tcs
>>> here = tcs.InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.14, torso=0.0)
>>> weights = tcs.UtilityWeights(travel=0.1)
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tcs.errors import TcsError
    from tcs.reasons import Explanation, explain
    from tcs.robustness import Evaluation, evaluate, robustify
    from tcs.scene import Observation
    from tcs.scoring import LiveScorer, Verification, score, score_observed, summary, verify
    from tcs.select import Choice, TravelWeights, UtilityWeights, select
    from tcs.store import ScoreFile
    from tcs.store import load_scores as load
    from tcs.store import save_scores as save
    from tcs.tables import InitialConfiguration

    __version__: str

__all__ = [
    "Choice",
    "Evaluation",
    "Explanation",
    "InitialConfiguration",
    "LiveScorer",
    "Observation",
    "ScoreFile",
    "TcsError",
    "TravelWeights",
    "UtilityWeights",
    "Verification",
    "__version__",
    "evaluate",
    "explain",
    "load",
    "robustify",
    "save",
    "score",
    "score_observed",
    "select",
    "summary",
    "verify",
]

_HOMES = {
    "Choice": ("tcs.select", "Choice"),
    "Evaluation": ("tcs.robustness", "Evaluation"),
    "Explanation": ("tcs.reasons", "Explanation"),
    "InitialConfiguration": ("tcs.tables", "InitialConfiguration"),
    "LiveScorer": ("tcs.scoring", "LiveScorer"),
    "Observation": ("tcs.scene", "Observation"),
    "ScoreFile": ("tcs.store", "ScoreFile"),
    "TcsError": ("tcs.errors", "TcsError"),
    "TravelWeights": ("tcs.select", "TravelWeights"),
    "UtilityWeights": ("tcs.select", "UtilityWeights"),
    "Verification": ("tcs.scoring", "Verification"),
    "evaluate": ("tcs.robustness", "evaluate"),
    "explain": ("tcs.reasons", "explain"),
    "load": ("tcs.store", "load_scores"),
    "robustify": ("tcs.robustness", "robustify"),
    "save": ("tcs.store", "save_scores"),
    "score": ("tcs.scoring", "score"),
    "score_observed": ("tcs.scoring", "score_observed"),
    "summary": ("tcs.scoring", "summary"),
    "verify": ("tcs.scoring", "verify"),
}
"""For each name the room it lives in, and what it is called there."""


def __getattr__(name: str) -> Any:
    """Return a name of `__all__`, loading the room it lives in."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("tcs")
    elif name == "select":
        return import_module("tcs.select")
    elif name in _HOMES:
        room, there = _HOMES[name]
        value = getattr(import_module(room), there)
    else:
        raise AttributeError(f"module 'tcs' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _CallableRoom(ModuleType):
    """The room `tcs.select`, which can be called like the function it is named after."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Return what `tcs.select.select` returns."""
        return self.select(*arguments, **options)


class _Package(ModuleType):
    """This package: `tcs.select` is both a room and a promised function."""

    def __setattr__(self, name: str, value: Any) -> None:
        # The import system binds a room to the package it has just loaded it for.
        if name == "select" and type(value) is ModuleType:
            value.__class__ = _CallableRoom
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
