"""The check-up: results for a sound robot, and that every type of problem is found."""

import importlib
import json

import numpy as np
import pytest

from tcs.model.robots import load_robot
from tcs.model.robots.primitives import read_primitives, write_primitives
from tcs_shapes.bodies import _body_enclosure
from tcs_shapes.checkup import check_up
from tests.model.robots.shipped import all_robots


@pytest.fixture(autouse=True, scope="module")
def _bodies_are_judged_once():
    """Share the enclosure of a body between robots with the same shapes and surface of it."""
    judged = {}

    def shared(body, members, shapes, surface):
        key = body, members, shapes, surface.tobytes()
        if key not in judged:
            judged[key] = _body_enclosure(body, members, shapes, surface)
        return judged[key]

    with pytest.MonkeyPatch.context() as patch:
        # The package has a function of the module's name.
        enclosure = importlib.import_module("tcs_shapes.bodies")
        patch.setattr(enclosure, "_body_enclosure", shared)
        yield


@pytest.fixture(scope="module")
def iiwa7():
    """The robot with the fewest shapes."""
    return load_robot("iiwa7")


@pytest.fixture(scope="module", params=all_robots())
def found(request):
    return check_up(load_robot(request.param), samples=60)


def test_shipped_robots_are_sound(found):
    assert found.problems == ()
    assert found.is_sound


def test_json_has_the_documented_keys(found):
    plain = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert {
        "arm_class", "limits", "enclosed", "excess_volume", "self_collision", "ik_round_trip",
    } <= plain.keys()  # fmt: skip
    assert plain["enclosed"]["outside"] == 0
    assert plain["self_collision"]["pairs"] == []
    assert plain["ik_round_trip"]["success_rate"] == 1.0


def test_every_posture_is_recovered(found):
    assert found.trip.recovered == found.trip.samples == 60
    if found.arm.solver is None:
        assert found.trip.method == "numeric"
        # Points on curves: many for a pose, and none has to be the given posture.
        assert found.trip.solutions > 60
        assert found.trip.joint_error is None
        # Newton steps end below 1e-9 along each axis.
        assert found.trip.position_error < 3e-9
        return
    assert found.trip.method == "closed form"
    # One solution at least, the posture itself; eight at most, two for each of three choices.
    assert 60 <= found.trip.solutions <= 480
    # Measured 1e-12 to 1e-8, the worst next to a singularity.
    assert found.trip.joint_error < 1e-6
    assert found.trip.position_error < 1e-9


def test_limits_are_those_in_force(pr2):
    found = check_up(pr2, samples=1)
    roll, elbow = (
        next(j for j in found.limits if j.name == name)
        for name in ("l_forearm_roll_joint", "l_elbow_flex_joint")
    )
    assert roll.is_continuous
    assert roll.to_json() == {"continuous": True, "in_force": None, "soft": None, "hard": None}
    assert elbow.in_force == elbow.soft == (-2.1213, -0.15)
    assert elbow.hard == (-2.3213, 0.0)
    assert found.limits[-1].name == "torso_lift_joint"


def test_shapes_that_are_too_small_are_found(iiwa7, tmp_path):
    shapes = [
        shape.shrunk(0.01) if shape.body == "iiwa_link_4" else shape
        for shape in iiwa7.load_primitives()
    ]
    found = check_up(with_shapes(iiwa7, shapes, tmp_path), samples=1)
    assert not found.is_sound
    (problem,) = found.problems
    assert "'iiwa_link_4'" in problem
    assert "do not lie in one" in problem


def test_a_body_without_shapes_is_found(iiwa7, tmp_path):
    shapes = [s for s in iiwa7.load_primitives() if s.body != "iiwa_link_5"]
    found = check_up(with_shapes(iiwa7, shapes, tmp_path), samples=1)
    assert found.problems == ("'iiwa_link_5' has a surface, but no primitive: fit one.",)
    assert found.to_json()["enclosed"]["bodies"]["iiwa_link_5"]["farthest_m"] is None


def test_contact_at_rest_is_found(pr2):
    # Without its exempt pairs, parts of one joint assembly touch in every posture.
    found = check_up(pr2.model_copy(update={"disabled_groups": ()}), samples=1)
    pairs = {frozenset(pair[:2]) for pair in found.contacts}
    assert frozenset(("l_forearm_link", "l_wrist_roll_link")) in pairs
    assert any("'l_wrist_roll_link'" in problem for problem in found.problems)


def test_bulky_shapes_give_a_note(iiwa7, tmp_path):
    shapes = [
        shape.shrunk(-0.05) if shape.body == "iiwa_link_6" else shape
        for shape in iiwa7.load_primitives()
    ]
    found = check_up(with_shapes(iiwa7, shapes, tmp_path), samples=1)
    assert any("'iiwa_link_6'" in note for note in found.notes)


def test_same_seed_same_postures(iiwa7):
    first, again, other = (check_up(iiwa7, samples=3, seed=seed).trip for seed in (1, 1, 2))
    assert first == again
    assert not np.isclose(first.joint_error, other.joint_error, rtol=1e-9, atol=0)


def with_shapes(robot, shapes, folder):
    path = folder / "shapes.csv"
    write_primitives(path, shapes)
    assert len(read_primitives(path)) == len(shapes)
    return robot.model_copy(update={"primitives": str(path)})
