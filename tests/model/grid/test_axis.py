import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcs.errors import GridError, UnknownNameError
from tcs.model.grid import Axis


@st.composite
def axes(draw):
    count, unit = draw(st.integers(1, 500)), draw(st.sampled_from(["m", "deg"]))
    # 500 values stay within the physical range of either unit.
    low, high = (-40.0, 0.0) if unit == "m" else (-720.0, 200.0)
    greatest = 0.08 if unit == "m" else 1.04
    step = draw(st.floats(1e-6, greatest)) if count > 1 else draw(st.floats(0, 1e3))
    return Axis("any", unit, draw(st.floats(low, high)), step, count)


@given(axes())
def test_plain_form_round_trip(axis):
    assert Axis.from_dict(axis.to_dict()) == axis


@given(axes())
def test_value_i_is_start_plus_i_steps(axis):
    one_by_one = [axis.start + i * axis.step for i in range(axis.count)]
    if axis.unit == "deg":
        one_by_one = [math.radians(value) for value in one_by_one]
    # numpy and math may round the factor pi/180 differently, by one unit in the last place.
    np.testing.assert_allclose(axis.values, one_by_one, rtol=4e-16, atol=0)


def test_headings_are_exact_fractions_of_a_turn():
    values = Axis("base_yaw", "deg", 0, 45, 8).values
    assert values.tolist() == [math.radians(45 * i) for i in range(8)]


def test_metres_stay_as_they_are():
    axis = Axis("torso", "m", 0, 0.15, 3)
    assert axis.values.tolist() == [0.0, 0.15, 0.3]
    assert axis.held_unit == "m"


def test_a_single_value_needs_no_step():
    assert Axis("torso", "m", 0.2, 0, 1).values.tolist() == [0.2]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"unit": "cm"}, "unit is 'cm', but must be one of m, deg"),
        ({"start": math.nan}, "start is nan, but must be a finite number"),
        ({"start": "0"}, "start is '0', but must be a finite number"),
        ({"step": math.inf}, "step is inf, but must be a finite number"),
        ({"step": True}, "step is True, but must be a finite number"),
        ({"step": 10**400}, "0, but must be a finite number"),
        ({"step": 0}, "step is 0 m, but must be positive"),
        ({"step": -0.1}, "step is -0.1 m, but must be positive"),
        ({"count": 0}, "the grid would be empty"),
        ({"count": -3}, "the grid would be empty"),
        ({"count": 2.0}, "count is 2.0, but must be a whole number"),
        ({"count": True}, "count is True, but must be a whole number"),
        ({"name": ""}, "an axis has the name '', but must have a text"),
    ],
    ids=str,
)
def test_an_invalid_axis_is_refused(changes, expected):
    spec = {"name": "base_x", "unit": "m", "start": 0, "step": 0.1, "count": 3}
    with pytest.raises(GridError) as caught:
        Axis.from_dict({**spec, **changes}, where="own.yaml")
    assert expected in str(caught.value)
    assert str(caught.value).startswith("own.yaml: a")


def test_missing_keys_are_named():
    with pytest.raises(GridError, match="axis 'base_x' needs step, count"):
        Axis.from_dict({"name": "base_x", "unit": "m", "start": 0})


def test_misspelt_key_gets_the_nearest_one():
    with pytest.raises(UnknownNameError, match=r"own.yaml: axis 'a'.*Did you mean 'count'\?"):
        Axis.from_dict({"name": "a", "unit": "m", "start": 0, "coutn": 2}, where="own.yaml")


def test_override_replaces_what_it_names():
    axis = Axis("base_x", "m", -1.5, 0.05, 61)
    assert axis.overridden({"step": 0.1, "count": 31}) == Axis("base_x", "m", -1.5, 0.1, 31)


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"unit": "deg"}, GridError),
        ({"steps": 1}, UnknownNameError),
        ({"name": "b"}, UnknownNameError),
    ],
    ids=str,
)
def test_override_may_not_make_it_another_axis(changes, error):
    with pytest.raises(error, match=r"^here: axis 'base_x'"):
        Axis("base_x", "m", -1.5, 0.05, 61).overridden(changes, where="here")


@pytest.mark.parametrize("count", [1, 61, 5000], ids=["one", "kept", "not kept"])
@pytest.mark.parametrize("unit", ["m", "deg"])
def test_values_belong_to_who_asks(count, unit):
    axis = Axis("own", unit, -1.5, 0.05 if unit == "deg" else 0.0007, count)
    first = axis.values
    assert [axis.value(i) for i in (0, count - 1, -1)] == first[[0, -1, -1]].tolist()
    expected = first.copy()
    first += 1.0
    np.testing.assert_array_equal(axis.values, expected)
    assert axis.value(0) == expected[0]
