"""Small multiples of a score file: a map for each state of its environment."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from tcs.errors import SelectionError
from tcs.model.grid import Axis, Grid
from tcs.output.draw import PlaceMap, StatePanel, draw_states
from tcs.output.draw.states import Score
from tcs.output.report.score.pictures import (
    base_footprints,
    title_of,
)
from tcs.output.report.score.scene_solids import base_outline, environment_solids
from tcs.output.report.score.shown_set import ScoredScene, ShownSet, scored_scenes
from tcs.output.words import axis_name, quantity
from tcs.placement.store import ScoreFile

MOST_PANELS = 60
"""Greatest number of panels on a page; more would be too small to read."""


def has_states(file: ScoreFile) -> bool:
    """Return whether the environment has 2 to `MOST_PANELS` states."""
    return 1 < math.prod(Grid.from_dict(file.grid).environment_shape) <= MOST_PANELS


def states_figure(
    file: ScoreFile,
    shown: ShownSet,
    score: Score = "reachability",
    scored: Sequence[ScoredScene] | None = None,
) -> Figure:
    """Return the maps of all states of the environment, in rows and columns, with one scale.

    Columns are the values of the environment's last axis, rows those of the other axes, the
    greatest at the top. An environment with one axis has one row.

    Args:
        file: A score file.
        shown: The set to mark, each member in the panel of its environment state.
        score: The score that colours the base positions.
        scored: The result of `scored_scenes`, built if None. The function moves the scenes.

    Raises:
        SelectionError: If the environment has one state only, or too many to draw.
        StoreMismatchError: If the models are not those the file was made from.
    """
    grid = Grid.from_dict(file.grid)
    axes = [axis for axis in grid.environment_axes if axis.count > 1]
    states = math.prod(grid.environment_shape)
    if states == 1:
        raise SelectionError(
            f"environment '{file.environment.get('name', '')}' has a single state, so there is one "
            "map only. Draw it without --states."
        )
    if states > MOST_PANELS:
        raise SelectionError(
            f"the environment has {states} states, but at most {MOST_PANELS} can be drawn on one "
            "page. Draw the map without --states."
        )
    job, scene = (scored or scored_scenes(file, shown))[0]
    base = base_outline(scene)
    scores = file.tables[shown.table].scores
    stands = base_footprints(shown, base)

    def panel(state: int) -> StatePanel:
        at = grid.configuration(state * grid.state_size)
        for name, value in at.environment:
            scene.set_joint(name, value)
        chosen = [
            (number, stand)
            for number, (h, stand) in enumerate(zip(shown.indices, stands, strict=True), start=1)
            if grid.state_of(h) == state
        ]
        return StatePanel(
            PlaceMap.of_state(scores, grid, state), environment_solids(scene, in_mount=True), chosen
        )

    columns = axes[-1]
    numbers = range(states)
    rows = [
        [panel(state) for state in numbers[first : first + columns.count]]
        for first in reversed(numbers[:: columns.count])
    ]
    above = itertools.product(
        *([_setting(axis, i) for i in range(axis.count)] for axis in axes[:-1])
    )
    return draw_states(
        rows,
        [", ".join(setting) for setting in above][::-1],
        [_setting(columns, i) for i in range(columns.count)],
        members=stands,
        title=title_of(job, file),
        subtitle=shown.subtitle,
        score=score,
        measure=file.metadata["measure"],
    )


def _setting(axis: Axis, index: int) -> str:
    """Return the name of an axis and its value at an index."""
    key = f"{axis.name}_deg" if axis.unit == "deg" else axis.name
    return f"{axis_name(key)} {quantity(key, axis.start + index * axis.step)}"
