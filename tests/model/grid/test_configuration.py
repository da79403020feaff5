import dataclasses
import json
import math

import pytest

from tcs.errors import TcsError
from tcs.model.grid import InitialConfiguration

PLACE = {"base_x": 1.0, "base_y": -0.5, "base_yaw": math.pi / 2, "torso": 0.3}


def test_json_names_degrees():
    configuration = InitialConfiguration(
        **PLACE,
        environment=(("bed_height", 0.2), ("head_rest", math.radians(35.0))),
        environment_units=("m", "rad"),
    )
    plain = json.loads(json.dumps(configuration.to_json()))
    # Degrees to radians and back costs at most a few roundings.
    assert plain == pytest.approx(
        {
            "base_x": 1.0,
            "base_y": -0.5,
            "base_yaw_deg": 90.0,
            "torso": 0.3,
            "bed_height": 0.2,
            "head_rest_deg": 35.0,
        },
        abs=1e-12,
    )


def test_units_are_needed_one_by_one():
    with pytest.raises(TcsError, match=r"1 environment axes but 0 units"):
        InitialConfiguration(**PLACE, environment=(("bed_height", 0.2),))
    with pytest.raises(TcsError, match=r"'bed_height' has unit 'cm'"):
        InitialConfiguration(
            **PLACE, environment=(("bed_height", 20.0),), environment_units=("cm",)
        )


def test_is_a_value():
    assert InitialConfiguration(**PLACE) == InitialConfiguration(**PLACE)
    assert len({InitialConfiguration(**PLACE), InitialConfiguration(**PLACE)}) == 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        InitialConfiguration(**PLACE).torso = 0.0


def test_grid_values_print_without_rounding_errors():
    values = {"base_x": 0.8 + 2 * 0.05, "base_y": 29 * 0.05, "base_yaw": 0.1 + 0.2, "torso": 0.3}
    configuration = InitialConfiguration(
        **values, environment=(("bed_height", 3 * 0.1),), environment_units=("m",)
    )
    assert repr(configuration) == (
        "InitialConfiguration(base_x=0.9, base_y=1.45, base_yaw=0.3, torso=0.3, "
        "environment=(('bed_height', 0.3),), environment_units=('m',))"
    )
    # Printing changes no value.
    assert configuration.base_y == 29 * 0.05
