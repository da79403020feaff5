"""Matching observations with the tables of a score file."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import InitialConfiguration
from tcs.placement.selection import SelectionTables, nearest_table, select
from tests.placement.store.example import score_file
from tests.placement.tables.small import small_grid

SHIFTS = {"name": "person_y", "unit": "m", "start": -0.1, "step": 0.05, "count": 5}
TILTS = {"name": "head_tilt", "unit": "deg", "start": -20.0, "step": 20.0, "count": 3}


def at(**environment):
    return InitialConfiguration(
        base_x=0.0,
        base_y=-2.0,
        base_yaw=0.0,
        torso=0.0,
        environment=tuple(environment.items()),
        environment_units=("m",) * len(environment),
    )


@pytest.fixture(scope="module")
def file():
    """Five shifts at two bed heights, which together determine the position of the head."""
    grid = small_grid(nx=6, ny=4, bed=2)
    head = [
        [0.3, shift, 0.7 + height]
        for shift, height in itertools.product((-0.1, -0.05, 0.0, 0.05, 0.1), (0.0, 0.1))
    ]
    frames = {"head": list(itertools.chain(*head)), "chest": [1.0] * 30}
    return score_file(grid=grid, tables=5, observed=[SHIFTS], body_frames=frames)


@pytest.mark.parametrize(
    ("person_y", "index"),
    [(0.0, 2), (0.024, 2), (0.026, 3), (-0.07, 1), (0.1, 4), (0.124, 4), (-0.125, 0)],
)
def test_the_nearest_shift_is_used(file, person_y, index):
    match = nearest_table(file, at(), {"person_y": person_y})
    assert match.index == index
    scored = -0.1 + index * 0.05
    assert match.state["person_y"] == pytest.approx(scored, abs=1e-12)
    assert match.observed_error["person_y"] == pytest.approx(person_y - scored, abs=1e-12)


def test_without_observation_the_nominal_table_is_used(file):
    match = nearest_table(file)
    assert (match.index, match.observed_error) == (file.nominal_index, {})
    assert nearest_table(score_file(), at()).index == 0


@pytest.mark.parametrize(
    ("step", "near", "far"),
    [(0.05, (0.276, 0.324), (0.274, 5.0)), (0.0, (0.21, 0.39), (0.19, -5.0))],
)
def test_a_single_value_covers_a_limited_range(step, near, far):
    alone = {**SHIFTS, "start": 0.3, "step": step, "count": 1}
    file = score_file(observed=[alone])
    assert nearest_table(file).index == 0
    for value in near:
        assert nearest_table(file, at(), {"person_y": value}).observed_error[
            "person_y"
        ] == pytest.approx(value - 0.3, abs=1e-12)
    for value in far:
        with pytest.raises(SelectionError, match=r"scored is only 0\.3 m"):
            nearest_table(file, at(), {"person_y": value})


def test_two_axes_are_matched_one_by_one():
    file = score_file(tables=15, observed=[SHIFTS, TILTS])
    match = nearest_table(file, at(), {"head_tilt": math.radians(12.0), "person_y": -0.04})
    assert match.state["person_y"] == pytest.approx(-0.05, abs=1e-12)
    assert match.state["head_tilt"] == pytest.approx(math.radians(20.0), abs=1e-12)
    assert file.observed_states[match.index] == match.state


def test_selection_uses_the_matched_table(file):
    for i, shift in enumerate((-0.1, -0.05, 0.0, 0.05, 0.1)):
        choice = select(file, at(), observed={"person_y": shift})
        alone = select(SelectionTables.of(file, i), at())
        assert (choice.indices, choice.utility) == (alone.indices, alone.utility)
        assert choice.match.index == i


@pytest.mark.parametrize(
    ("frames", "here", "index", "error"),
    [
        ({"head": (0.3, 0.06, 0.7)}, at(), 3, 0.01),
        ({"head": (0.3, 0.06, 0.8)}, at(), 3, 0.01),
        # With a known bed height, the head is expected at that height.
        ({"head": (0.3, 0.06, 0.75)}, at(bed_height=0.1), 3, math.hypot(0.01, 0.05)),
        ({"head": (0.3, -0.1, 0.7), "chest": (1.0, 1.0, 1.0)}, at(), 0, 0.0),
    ],
)
def test_observed_frames_select_the_shift(file, frames, here, index, error):
    match = nearest_table(file, here, frames=frames)
    assert match.index == index
    assert match.frame_position_error == pytest.approx(error, abs=1e-12)


@pytest.mark.parametrize(
    ("observation", "error", "message"),
    [
        ({"observed": {"person_y": 0.13}}, SelectionError, "scored are only -0.1 to 0.1 m, 5 val"),
        ({"observed": {"person_y": np.nan}}, SelectionError, "must be a finite number"),
        ({"observed": {"person_x": 0.0}}, UnknownNameError, "person_y"),
        ({"frames": {"heat": (0, 0, 0)}}, UnknownNameError, "head"),
        (
            {"frames": {"head": (0.3, 0.3, 0.7)}},
            SelectionError,
            "are 0.20 m from their scored positions",
        ),
        ({"frames": {"head": (0.3, 0.3)}}, SelectionError, "three finite numbers"),
        (
            {"frames": {"head": (0.3, 0.0, 0.7)}, "observed": {"person_y": 0.0}},
            SelectionError,
            "Give one of them",
        ),
    ],
)
def test_observations_beyond_the_scored_states_are_refused(file, observation, error, message):
    with pytest.raises(error, match=message):
        nearest_table(file, at(), **observation)


def test_a_single_table_takes_no_observation(file):
    with pytest.raises(SelectionError, match="Give the file"):
        select(SelectionTables.of(file), at(), observed={"person_y": 0.0})
