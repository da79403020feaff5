"""Changed environments: what is moved, added and set, and the text of the file."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.errors import EnvironmentFileError, UnknownNameError
from tcs.model.grid import Grid
from tcs.model.robots import load_robot
from tcs.model.scene import Scene, SceneSpec, load_environment
from tcs.model.scene.changes import (
    EnvironmentChanges,
    Shift,
    changed_environment,
    environment_text,
)
from tcs.model.scene.pieces import PIECES, PlacedPiece, with_pieces


def changed(name, **changes):
    environment = load_environment(name)
    axes = {axis.name: axis for axis in Grid.from_spec(environment.grid).axes}
    return changed_environment(environment, EnvironmentChanges(**changes), axes)


@pytest.mark.parametrize("portable", [False, True])
@pytest.mark.parametrize("name", ["wheelchair", "bed"])
def test_the_text_of_an_environment_reads_back_as_the_same(tmp_path, name, portable):
    environment = load_environment(name)
    path = tmp_path / "again.yaml"
    path.write_text(environment_text(environment, portable=portable), encoding="utf-8")
    assert load_environment(path) == environment
    assert ("file: /" in path.read_text()) != portable


def test_a_model_of_ones_own_is_not_portable():
    environment = load_environment("wheelchair")
    own = environment.models[0].model_copy(update={"file": "/elsewhere/own.sdf"})
    with pytest.raises(EnvironmentFileError, match="'wheelchair': its model does not ship"):
        environment_text(environment.model_copy(update={"models": (own,)}), portable=True)


def head(environment) -> np.ndarray:
    """Return X_WH of the head in the plant of an environment."""
    scene = Scene(SceneSpec(load_robot("pr2"), environment))
    return np.asarray(scene.body_frame_pose("head").GetAsMatrix4())


def test_a_wheelchair_carries_the_person_and_turns_about_its_origin():
    before = head(load_environment("wheelchair"))
    after = head(changed("wheelchair", shifts={"wheelchair": Shift(x=0.3, y=-0.2, yaw=0.5)}))
    X = np.eye(4)
    X[:2, :2] = [[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]]
    X[:2, 3] = 0.3, -0.2
    # Rounding of rotation matrices from angles in degrees.
    np.testing.assert_allclose(after, X @ before, atol=1e-12)


def test_a_person_moves_along_the_axes_of_a_turned_wheelchair():
    turned = {"wheelchair": Shift(yaw=math.pi / 2)}
    alone = head(changed("wheelchair", shifts=turned))
    after = head(changed("wheelchair", shifts={**turned, "person": Shift(x=0.1)}))
    np.testing.assert_allclose(after[:3, 3] - alone[:3, 3], [0.0, 0.1, 0.0], atol=1e-12)


def test_joints_and_names():
    environment = changed("wheelchair", joints={"head_tilt": 0.2})
    assert environment.joints["head_tilt"] == 0.2
    assert environment.name == "wheelchair changed"
    twice = changed_environment(environment, EnvironmentChanges(), {})
    assert (twice.name, twice.title) == (environment.name, environment.title)
    with pytest.raises(UnknownNameError, match="unknown thing to move 'sofa'"):
        changed("wheelchair", shifts={"sofa": Shift()})


def test_pieces_are_boxes_with_names_of_their_own():
    environment = with_pieces(
        load_environment("wheelchair"),
        [PlacedPiece(piece="chair", x=1.0, y=2.0, yaw=math.pi / 2) for _ in range(2)],
    )
    assert [one.name for one in environment.obstacles] == [
        "chair_1", "chair_1_b", "chair_2", "chair_2_b",
    ]  # fmt: skip
    seat, back = environment.obstacles[:2]
    # The chair faces along y, so its back is behind it along y.
    np.testing.assert_allclose(seat.xyz, (1.0, 2.0, 0.23))
    np.testing.assert_allclose(back.xyz, (1.0, 1.8, 0.68))
    with pytest.raises(UnknownNameError, match="unknown piece of furniture 'sofa'"):
        with_pieces(environment, [PlacedPiece(piece="sofa", x=0.0, y=0.0)])


@pytest.mark.parametrize("piece", PIECES)
def test_pieces_stand_on_the_floor(piece):
    lows = [centre[2] - size[2] / 2 for size, centre in PIECES[piece]]
    assert min(lows) == pytest.approx(0.0)


def test_below_a_table_are_knees():
    legs = [(size, at) for size, at in PIECES["table"] if at[2] - size[2] / 2 == 0.0]
    assert len(legs) == 4
    for size, at in legs:
        # At the corners, within the outline of the top, and up to it.
        assert abs(at[0]) + size[0] / 2 == pytest.approx(0.4)
        assert abs(at[1]) + size[1] / 2 == pytest.approx(0.6)
        assert size[2] == pytest.approx(0.7)
    (top,) = [one for one in PIECES["table"] if one not in legs]
    assert top[1][2] - top[0][2] / 2 == pytest.approx(0.7)
    placed = with_pieces(load_environment("wheelchair"), [PlacedPiece(piece="table", x=1.0, y=0.0)])
    assert len({one.name for one in placed.obstacles}) == 5
