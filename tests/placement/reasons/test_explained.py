import math

import numpy as np
import pytest

from tcs.errors import GridError, SelectionError, UnknownNameError
from tcs.model.grid import InitialConfiguration
from tcs.placement.reasons.explained import ExplainedConfiguration, nearest_configuration
from tcs.placement.tables import Reason
from tests.placement.tables.small import random_scores, small_grid

GRID = small_grid(nx=5, ny=4, yaws=8, torsos=3, bed=3, head=3)


def place(**changes):
    values = {"base_x": -0.3, "base_y": 0.3, "base_yaw": 0.0, "torso": 0.15}
    environment = {"head_rest": math.radians(35), "bed_height": 0.1}
    values |= {name: value for name, value in changes.items() if name in values}
    environment |= {name: value for name, value in changes.items() if name not in values}
    # Not in the order of the grid.
    return InitialConfiguration(
        **values,
        environment=tuple(environment.items()),
        environment_units=tuple("m" if "bed" in name else "rad" for name in environment),
    )


def test_nearest_is_nearest_along_every_axis():
    rng = np.random.default_rng(3)
    at = GRID.values(np.arange(GRID.size))
    low = {"base_x": -0.8, "base_y": 0.0, "base_yaw": -7.0, "torso": -0.07}
    high = {"base_x": 0.2, "base_y": 0.8, "base_yaw": 7.0, "torso": 0.37}
    low |= {"bed_height": -0.05, "head_rest": -0.3}
    high |= {"bed_height": 0.25, "head_rest": 1.52}
    for _ in range(200):
        stated = {name: rng.uniform(low[name], high[name]) for name in low}
        index, ordered = nearest_configuration(GRID, place(**stated))
        off = sum(abs(at[name] - stated[name]) for name in low if name != "base_yaw")
        off = off + np.abs(np.angle(np.exp(1j * (at["base_yaw"] - stated["base_yaw"]))))
        assert off[index] == off.min()
        assert [name for name, _ in ordered.environment] == ["bed_height", "head_rest"]
        # The stated configuration, except for full rotations.
        assert dict(ordered.environment) == {
            name: stated[name] for name in ("bed_height", "head_rest")
        }
        assert (ordered.base_x, ordered.base_y) == (stated["base_x"], stated["base_y"])
        assert math.remainder(ordered.base_yaw - stated["base_yaw"], 2 * math.pi) == pytest.approx(
            0.0, abs=1e-14
        )


def test_half_a_step_beyond_the_ends_is_near_enough():
    assert (
        nearest_configuration(GRID, place(base_x=-0.8))[0]
        == (nearest_configuration(GRID, place(base_x=-0.7))[0])
    )


def test_axis_with_a_single_value_is_always_near():
    grid = small_grid(torsos=1)
    index, ordered = nearest_configuration(
        grid, InitialConfiguration(base_x=-0.7, base_y=0.1, base_yaw=0.0, torso=0.3)
    )
    assert (index, ordered.torso) == (0, 0.3)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"base_x": 5.0}, r"base_x 5 m, beyond the grid, where it is -0.7 to 0.1 m"),
        ({"torso": -0.08}, r"torso -0.08 m"),
        ({"head_rest": 2.0}, r"head_rest 114.592 deg, beyond .* 0 to 70 deg"),
        ({"base_y": math.nan}, r"base_y is nan"),
        ({"bed_height": math.inf}, r"bed_height is inf"),
    ],
)
def test_configuration_beyond_the_grid(stated, words):
    with pytest.raises(SelectionError, match=words):
        nearest_configuration(GRID, place(**stated))


def test_heading_beyond_a_grid_that_does_not_go_round():
    from tcs.model.grid import Grid

    plain = small_grid(yaws=8).to_dict()
    (yaw,) = (axis for axis in plain["axes"] if axis["name"] == "base_yaw")
    yaw["count"] = 3
    grid = Grid.from_dict(plain)
    here = InitialConfiguration(base_x=-0.7, base_y=0.1, base_yaw=math.radians(-20), torso=0.0)
    assert nearest_configuration(grid, here)[0] == 0
    behind = InitialConfiguration(base_x=-0.7, base_y=0.1, base_yaw=math.pi, torso=0.0)
    with pytest.raises(SelectionError, match=r"base_yaw 180 deg, beyond .* 0 to 90 deg"):
        nearest_configuration(grid, behind)


def test_axes_that_are_missing_or_unknown():
    bare = InitialConfiguration(base_x=0.0, base_y=0.3, base_yaw=0.0, torso=0.0)
    with pytest.raises(SelectionError, match="lacks bed_height, head_rest"):
        nearest_configuration(GRID, bare)
    with pytest.raises(UnknownNameError, match="bed_hight"):
        nearest_configuration(GRID, place(bed_hight=0.1))


def test_the_outcome_is_that_of_the_score_table():
    scores = random_scores(GRID, 3, seed=4)
    for index in range(0, GRID.size, 97):
        found = ExplainedConfiguration.of(GRID, scores, 2, index)
        assert found.configuration == found.stated == GRID.configuration(index)
        assert found.reason == scores.reason[index, 2]
        assert found.is_reached == (found.reason == Reason.REACHED)
        assert (found.pair is None) == (scores.pair[index, 2] < 0)
        if found.pair is not None:
            assert found.pair == scores.pair_names[scores.pair[index, 2]]
        assert found.dexterity == scores.dexterity[index, 2]
        assert found.offset == {}


def test_offset_of_a_stated_configuration():
    scores = random_scores(GRID, 1, seed=4)
    stated = place(base_x=-0.27, base_yaw=math.radians(350), head_rest=math.radians(40))
    found = ExplainedConfiguration.of(GRID, scores, 0, stated)
    assert found.configuration.to_json()["base_yaw_deg"] == 0.0
    # Written with nine decimals.
    assert found.offset == pytest.approx(
        {"base_x": 0.03, "base_yaw_deg": -10.0, "head_rest_deg": 5.0}, abs=1e-8
    )


@pytest.mark.parametrize("index", [-1, GRID.size])
def test_no_such_configuration(index):
    with pytest.raises(GridError, match=rf"no configuration {index}.* 0 to {GRID.size - 1}"):
        ExplainedConfiguration.of(GRID, random_scores(GRID, 1, seed=4), 0, index)
