import itertools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcs.errors import GridError, UnknownNameError
from tcs.model.grid import MAX_CONFIGURATIONS, Axis, Grid

WHEELCHAIR = {
    "base_x": {"unit": "m", "start": -1.5, "step": 0.05, "count": 61},
    "base_y": {"unit": "m", "start": -1.5, "step": 0.05, "count": 61},
    "base_yaw": {"unit": "deg", "start": 0, "step": 45, "count": 8},
    "torso": {"unit": "m", "start": 0, "step": 0.15, "count": 3},
}
BED = {
    "bed_height": {"unit": "m", "start": 0, "step": 0.1, "count": 4},
    "head_rest": {"unit": "deg", "start": 0, "step": 35, "count": 3},
    "base_x": {"unit": "m", "start": -2, "step": 0.1, "count": 41},
    "base_y": {"unit": "m", "start": -2, "step": 0.1, "count": 41},
    "base_yaw": {"unit": "deg", "start": 0, "step": 90, "count": 4},
    "torso": {"unit": "m", "start": 0, "step": 0.15, "count": 3},
}


def changed(axis: str, **values: object) -> dict:
    return {**WHEELCHAIR, axis: {**WHEELCHAIR[axis], **values}}


@st.composite
def grids(draw):
    small = st.integers(1, 6)
    environment = [
        Axis(name, draw(st.sampled_from(["m", "deg"])), 0.0, 0.5, draw(small))
        for name in draw(st.sampled_from([[], ["bed_height"], ["bed_height", "head_rest"]]))
    ]
    robot = [
        Axis("base_x", "m", draw(st.floats(-3, 3)), 0.1, draw(small)),
        Axis("base_y", "m", draw(st.floats(-3, 3)), 0.1, draw(small)),
        Axis("base_yaw", "deg", draw(st.floats(-180, 180)), 45.0, draw(small)),
        Axis("torso", "m", 0.0, 0.15, draw(small)),
    ]
    return Grid((*environment, *robot))


@pytest.mark.parametrize(
    ("spec", "size", "environment_shape"),
    # Counts of the paper's grids: 61 x 61 x 8 x 3 and 4 x 3 x 41 x 41 x 4 x 3.
    [(WHEELCHAIR, 89_304, ()), (BED, 242_064, (4, 3))],
    ids=["wheelchair", "bed"],
)
def test_grids_of_the_paper_have_their_size(spec, size, environment_shape):
    grid = Grid.from_spec(spec)
    assert grid.size == size
    assert grid.environment_shape == environment_shape
    assert grid.shape[-4:] == tuple(
        spec[name]["count"] for name in ("base_x", "base_y", "base_yaw", "torso")
    )


@given(grids(), st.data())
def test_index_round_trip(grid, data):
    flat = data.draw(st.lists(st.integers(0, grid.size - 1), max_size=20))
    along = grid.indices(np.array(flat, dtype=np.int64))
    assert along.shape == (len(flat), len(grid.axes))
    assert grid.flat(along).tolist() == flat


@given(grids())
def test_plain_form_round_trip(grid):
    assert Grid.from_dict(grid.to_dict()) == grid
    assert pickle.loads(pickle.dumps(grid)) == grid


@given(grids())
def test_flat_order_is_nested_loops_over_the_axes(grid):
    nested = list(itertools.product(*(axis.values.tolist() for axis in grid.axes)))
    at = grid.values(np.arange(grid.size))
    assert np.column_stack([at[axis.name] for axis in grid.axes]).tolist() == [
        list(row) for row in nested
    ]


def test_torso_changes_fastest_and_the_bed_slowest():
    grid = Grid.from_spec(BED)
    assert [axis.name for axis in grid.axes] == list(BED)
    assert grid.values(1)["torso"] == 0.15
    assert grid.indices(grid.size // 4).tolist() == [1, 0, 0, 0, 0, 0]


def test_indices_have_the_shape_of_their_argument():
    grid = Grid.from_spec(WHEELCHAIR)
    assert grid.indices(5).shape == (4,)
    assert grid.indices([[0, 1], [2, 3]]).shape == (2, 2, 4)
    assert grid.values([[0, 1], [2, 3]])["base_x"].shape == (2, 2)
    assert grid.values([])["torso"].shape == (0,)
    assert grid.flat([[[0, 0, 0, 1]]]).tolist() == [[1]]


def test_robot_axes_of_a_spec_may_be_in_any_order():
    shuffled = {name: WHEELCHAIR[name] for name in ("torso", "base_y", "base_yaw", "base_x")}
    assert Grid.from_spec(shuffled) == Grid.from_spec(WHEELCHAIR)


def test_configuration_is_in_metres_and_radians():
    grid = Grid.from_spec(BED)
    configuration = grid.configuration(int(grid.flat([2, 1, 20, 25, 3, 2])))
    assert configuration.base_x == pytest.approx(0.0, abs=1e-15)  # -2 + 20 * 0.1 rounds
    assert configuration.base_y == pytest.approx(0.5, abs=1e-15)
    assert configuration.base_yaw == math.radians(270)
    assert configuration.torso == 0.3
    assert configuration.environment == (("bed_height", 0.2), ("head_rest", math.radians(35)))
    assert configuration.environment_units == ("m", "rad")


@given(grids(), st.data())
def test_configuration_has_the_values_of_its_index(grid, data):
    flat = data.draw(st.integers(0, grid.size - 1))
    for given_as in (flat, np.int32(flat), np.int64(flat)):
        one = grid.configuration(given_as)
        values = {axis.name: getattr(one, axis.name, None) for axis in grid.axes}
        values |= dict(one.environment)
        assert values == {name: float(value) for name, value in grid.values(flat).items()}
        assert all(type(value) is float for value in values.values())


def test_axis_by_name():
    grid = Grid.from_spec(WHEELCHAIR)
    assert grid.axis("torso") == Axis("torso", "m", 0, 0.15, 3)
    with pytest.raises(UnknownNameError, match="Did you mean 'torso'"):
        grid.axis("torsoo")


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        (changed("base_x", count=0), "axis 'base_x': count is 0, so the grid would be empty"),
        (
            changed("base_x", step=2e-5, count=1_000_000),
            "would be 1,464,000,000 configurations (1000000 x 61 x 8 x 3), "
            "but at most 100,000,000 are allowed",
        ),
        (changed("base_x", unit="deg"), "axis 'base_x': unit is 'deg', but must be 'm'"),
        (changed("base_yaw", count=9), "exceed a full turn and repeat headings. Give at most 8"),
        ({k: v for k, v in WHEELCHAIR.items() if k != "torso"}, "needs axis torso"),
        ({}, "needs axis base_x, base_y, base_yaw, torso"),
        ({**WHEELCHAIR, "torso": 3}, "axis 'torso' is 3, but needs unit, start, step and count"),
    ],
    ids=["empty", "enormous", "unit", "full-turn-twice", "missing", "nothing", "no-axis"],
)
def test_an_invalid_grid_is_refused(spec, expected):
    with pytest.raises(GridError) as caught:
        Grid.from_spec(spec, where="file 'own.yaml'")
    assert expected in str(caught.value)
    assert str(caught.value).startswith("file 'own.yaml': ")
    assert "\n" not in str(caught.value)


def test_a_full_turn_of_any_step_is_allowed():
    # 360 / 7 is rounded, so seven of them are not exactly a turn.
    for count in (7, 8, 360):
        assert Grid.from_spec(changed("base_yaw", start=10, step=360 / count, count=count))


def test_the_largest_grid_is_allowed_and_one_more_is_not():
    one = {name: {**spec, "count": 1} for name, spec in WHEELCHAIR.items()}
    full = {
        **one,
        "base_x": {**WHEELCHAIR["base_x"], "step": 1e-5, "count": MAX_CONFIGURATIONS // 100},
        "base_y": {**WHEELCHAIR["base_y"], "step": 0.01, "count": 100},
    }
    assert Grid.from_spec(full).size == MAX_CONFIGURATIONS
    full["base_x"]["count"] += 1
    with pytest.raises(GridError, match="would be 100,000,100 configurations"):
        Grid.from_spec(full)


def test_axes_may_not_repeat_or_be_out_of_order():
    axes = Grid.from_spec(WHEELCHAIR).axes
    with pytest.raises(GridError, match="axis 'base_x' is repeated"):
        Grid((axes[0], *axes))
    with pytest.raises(GridError, match="must end with base_x, base_y, base_yaw, torso"):
        Grid(axes[::-1])


@pytest.mark.parametrize("flat", [-1, 89_304, [0, 89_304], 10**15], ids=str)
def test_a_configuration_that_is_not_there(flat):
    with pytest.raises(GridError, match=r"no configuration .* indices are 0 to 89303"):
        Grid.from_spec(WHEELCHAIR).indices(flat)


def test_configurations_are_never_identified_by_floats():
    grid = Grid.from_spec(WHEELCHAIR)
    with pytest.raises(GridError, match="whole number"):
        grid.values(0.5)
    with pytest.raises(GridError, match="whole-number indices"):
        grid.flat([0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("along", [[0, 0, 0], [0, 0, 8, 0], [0, -1, 0, 0], 3], ids=str)
def test_indices_off_the_grid(along):
    with pytest.raises(GridError):
        Grid.from_spec(WHEELCHAIR).flat(along)


def test_task_changes_some_axes_only():
    grid = Grid.from_spec(WHEELCHAIR)
    coarse = grid.overridden({"base_yaw": {"step": 90, "count": 4}}, where="task 'shaving'")
    assert coarse.shape == (61, 61, 4, 3)
    assert coarse.axis("base_x") == grid.axis("base_x")
    assert grid.overridden({}) == grid


def test_changes_that_make_an_invalid_grid_are_reported_with_their_source():
    grid = Grid.from_spec(WHEELCHAIR)
    with pytest.raises(
        UnknownNameError, match=r"task 'a': unknown axis 'base_z'.*Did you mean 'base_"
    ):
        grid.overridden({"base_z": {"count": 2}}, where="task 'a'")
    with pytest.raises(GridError, match=r"^task 'a': grid: would be [\d,]+ configurations"):
        grid.overridden({"torso": {"step": 1e-5, "count": 10**6}}, where="task 'a'")
    with pytest.raises(GridError, match=r"^task 'a': axis 'torso': count is 1000000000, but a num"):
        grid.overridden({"torso": {"count": 10**9}}, where="task 'a'")


@pytest.mark.parametrize("plain", [{}, {"axes": 3}, {"axes": ["base_x"]}], ids=str)
def test_an_invalid_plain_form_is_refused(plain):
    with pytest.raises(GridError, match="needs 'axes', a list of axes"):
        Grid.from_dict(plain)


def test_environment_states_are_those_of_the_flat_order():
    grid = Grid.from_spec(BED)
    states = list(grid.environment_states())
    assert len(states) == math.prod(grid.environment_shape) == 12
    each = grid.size // len(states)
    for i, state in enumerate(states):
        assert dict(grid.configuration(i * each).environment) == state
