import numpy as np
import pytest

from tcs.errors import GridError, UnknownNameError
from tcs.model.grid import AxisCondition, Grid, restricted

GRID = Grid.from_spec(
    {
        "bed_height": {"unit": "m", "start": 0, "step": 0.1, "count": 4},
        "head_rest": {"unit": "deg", "start": 0, "step": 35, "count": 3},
        "base_x": {"unit": "m", "start": -2, "step": 0.1, "count": 41},
        "base_y": {"unit": "m", "start": 0, "step": 0, "count": 1},
        "base_yaw": {"unit": "deg", "start": 0, "step": 90, "count": 4},
        "torso": {"unit": "m", "start": 0, "step": 0.15, "count": 3},
    }
)


@pytest.mark.parametrize(
    ("text", "admitted"),
    [
        # 3 * 0.1 is 6e-17 above 0.3.
        ("bed_height <= 0.3", [0, 1, 2, 3]),
        ("bed_height < 0.3 m", [0, 1, 2]),
        ("bed_height >= 30cm", [3]),
        ("bed_height = 200 mm", [2]),
        ("bed-height==.1", [1]),
        ("bed_height=5..25 cm", [1, 2]),
        ("bed_height = 0.1 .. 0.3", [1, 2, 3]),
        ("bed_height = 5 cm .. 25 cm", [1, 2]),
        ("headrest >= 35 deg", [1, 2]),
        ("Head Rest > 35 deg", [2]),
        ("head_rest_deg = 70", [2]),
        ("base_yaw = -90 deg", [3]),
        ("base_yaw = -90..90 deg", [0, 1, 3]),
        ("base_yaw = 360 deg", [0]),
        ("base_yaw = 0..720 deg", [0, 1, 2, 3]),
        ("base_yaw >= 180 deg", [2, 3]),
        ("torso > 1e-3", [1, 2]),
        ("base_y = 0", [0]),
    ],
)
def test_admitted_values(text, admitted):
    assert np.flatnonzero(AxisCondition.parse(text).admitted(GRID)).tolist() == admitted


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("head_rest", "is not of the form AXIS COMPARISON VALUE"),
        ("head_rest >= high", "is not of the form"),
        ("head_rest\n>= 35 deg; rm", "is not of the form"),
        ("head_rest >= 35", "lacks a unit: head_rest is an angle. Write 35 deg."),
        ("head_rest >= 35 m", "head_rest is in deg, not in m."),
        ("bed_height >= 35 deg", "bed_height is in m, not in deg."),
        ("bed_height >= 1e999", "must be a finite number"),
        ("bed_height >= 0.1..0.2", "a range follows '='"),
        ("bed_height = 0.2..0.1", "the range is reversed"),
        ("bed_height = 1 cm..2 m", "two units"),
        ("bed_height = 0.25", "leaves nothing: the grid has bed_height 0, 0.1, 0.2, 0.3 m."),
        ("base_x > 2", "leaves nothing: the grid has base_x -2 to 2 m in steps of 0.1."),
        ("base_yaw = 45 deg", "leaves nothing: the grid has base_yaw 0, 90, 180, 270 deg."),
    ],
)
def test_invalid_conditions(text, message):
    with pytest.raises(GridError, match=message):
        AxisCondition.parse(text).admitted(GRID)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hed_rest >= 35 deg", "Did you mean 'head_rest'?"),
        ("bed_height >= 3 inch", "unknown unit 'inch'. Known: cm, deg, m, mm."),
    ],
)
def test_unknown_names(text, message):
    with pytest.raises(UnknownNameError) as caught:
        AxisCondition.parse(text).admitted(GRID)
    assert message in str(caught.value)


def test_a_restricted_grid_has_only_the_admitted_values():
    grid = restricted(GRID, ["head_rest >= 35 deg", "base_x = -1..0.5", "base_x <= 0"])
    assert grid.axis("head_rest").values.tolist() == np.deg2rad([35.0, 70.0]).tolist()
    np.testing.assert_allclose(grid.axis("base_x").values, np.arange(-10, 1) / 10, atol=1e-12)
    assert grid.axis("torso") == GRID.axis("torso")
    assert restricted(GRID, []) == GRID


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["base_yaw = -90..0 deg"], "of base_yaw are not consecutive"),
        (["torso > 0.1", "torso < 0.1"], "'torso > 0.1' and 'torso < 0.1' leave nothing"),
    ],
)
def test_grids_that_cannot_be_restricted(texts, message):
    with pytest.raises(GridError, match=message):
        restricted(GRID, texts)
