"""Shapes split where boxes strike them that the surface clears: enclosed, and no wider."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.primitives import enclosed, read_primitives
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs_shapes import splitting as module
from tcs_shapes.bounding import corner_points, enclose
from tcs_shapes.splitting import (
    Boxes,
    Splitting,
    Surface,
    border_points,
    split_where_struck,
    touched,
)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Larger pieces, and fewer cuts that are looked at closely."""
    monkeypatch.setattr(module, "PIECES", 25)
    monkeypatch.setattr(module, "CELLS", 30_000)
    monkeypatch.setattr(module, "_REFINED", 2)


@pytest.fixture(scope="module")
def drums():
    """Two drums on one axis, one above the other."""
    lower = trimesh.creation.cylinder(0.1, 0.1, sections=24)
    upper = trimesh.creation.cylinder(0.06, 0.1, sections=24).apply_translation((0, 0, 0.1))
    return np.concatenate([lower.triangles, upper.triangles])


@pytest.fixture(scope="module")
def around(drums):
    """The box around both."""
    return enclose("b", corner_points(drums), "box", np.eye(3))


def cleared(triangles, shapes, seed, count=3000):
    """Random boxes near shapes that clear the surface."""
    rng = np.random.default_rng(seed)
    boxes = Boxes(
        half=rng.uniform(0.01, 0.1, (count, 3)),
        R=Rotation.random(count, rng=rng).as_matrix(),
        p=rng.uniform(-0.3, 0.4, (count, 3)),
    )
    boxes = boxes.some(np.any([touched(s.shrunk(-0.003), boxes) for s in shapes], axis=0))
    surface = Surface(triangles)
    is_clear = [surface.is_clear(*box) for box in zip(boxes.half, boxes.R, boxes.p, strict=True)]
    return boxes.some(np.array(is_clear))


def strikes(shapes, boxes):
    return int(np.any([touched(shape, boxes) for shape in shapes], axis=0).sum())


def test_fewer_boxes_are_struck_and_the_surface_stays_enclosed(drums, around):
    boxes, others = (cleared(drums, [around], seed) for seed in (0, 1))
    splitting = Splitting("b", [around], drums, boxes)
    before = splitting.struck
    assert before == strikes([around], boxes) > 100
    splitting.split(7)
    splitting.reduce()
    assert len(splitting.shapes) <= 8
    assert enclosed(splitting.shapes, drums).all()
    assert splitting.struck == strikes(splitting.shapes, boxes)
    # Boxes that did not decide anything are struck as seldom.
    for some in (boxes, others):
        assert strikes(splitting.shapes, some) < 0.3 * strikes([around], some)


def test_shapes_merge_where_that_strikes_no_more(drums, around):
    """A box cut into eight, whose parts strike what the whole does."""
    solid = np.asarray(trimesh.creation.box((0.1, 0.2, 0.3)).triangles)
    box = enclose("b", corner_points(solid), "box", np.eye(3))
    boxes = cleared(drums, [around], 0)
    half = np.array(box.size) / 4
    parts = []
    for signs in itertools.product((-1, 1), repeat=3):
        corners = np.array(signs) * half + 1.01 * half * np.array(
            list(itertools.product((-1, 1), repeat=3))
        )
        parts.append(enclose("b", corners, "box", np.eye(3)))
    splitting = Splitting("b", parts, solid, boxes)
    splitting.merge(0.5)
    (whole,) = splitting.shapes
    assert enclosed([whole], solid).all()
    np.testing.assert_allclose(whole.volume, box.volume, rtol=1e-3)


def test_shapes_stay_apart_where_their_union_would_strike(drums):
    """One box around a drum each: a box around both would strike what is beside the upper one."""
    lower = enclose("b", corner_points(drums[: len(drums) // 2]), "box", np.eye(3))
    upper = enclose("b", corner_points(drums[len(drums) // 2 :]), "box", np.eye(3))
    boxes = cleared(drums, [enclose("b", corner_points(drums), "box", np.eye(3))], 0)
    splitting = Splitting("b", [lower, upper], drums, boxes)
    splitting.merge(0.5)
    assert splitting.shapes == (lower, upper)


def test_shapes_do_not_protrude_where_none_did(drums, around, monkeypatch):
    """Boxes turned about two drums strike less, but their corners are where no shape was."""
    monkeypatch.setattr(module, "_GUARD", 1.0)
    lower = enclose("b", corner_points(drums[: len(drums) // 2]), "box", np.eye(3))
    upper = enclose("b", corner_points(drums[len(drums) // 2 :]), "box", np.eye(3))
    guards = border_points([lower, upper])
    for shape in (lower, upper):
        assert not shape.contains(guards).any()
    boxes = cleared(drums, [around], 0)
    splitting = Splitting("b", [lower, upper], drums, boxes)
    splitting.split(6)
    splitting.reduce()
    assert len(splitting.shapes) > 2
    assert splitting.protruding == 0
    assert not np.any([shape.contains(guards) for shape in splitting.shapes])


def test_what_protrudes_costs(drums, around, monkeypatch):
    """Two boxes around the drums become one only if points where none was cost nothing."""
    lower = enclose("b", corner_points(drums[: len(drums) // 2]), "box", np.eye(3))
    upper = enclose("b", corner_points(drums[len(drums) // 2 :]), "box", np.eye(3))
    far = cleared(drums, [around], 0)
    for cost, count in ((3e-4, 2), (0.0, 1)):
        monkeypatch.setattr(module, "_GUARD", cost)
        splitting = Splitting("b", [lower, upper], drums, far)
        # All boxes near may be struck, but points that were free may not be held.
        splitting.merge(float(len(far)))
        assert len(splitting.shapes) == count
        assert (splitting.protruding > 1000) == (count == 1)


def test_nothing_is_split_that_strikes_nothing():
    solid = np.asarray(trimesh.creation.box((0.1, 0.2, 0.3)).triangles)
    box = enclose("b", corner_points(solid), "box", np.eye(3))
    splitting = Splitting("b", [box], solid, cleared(solid, [box], 0))
    assert splitting.struck == 0
    splitting.reduce()
    splitting.split(5)
    assert splitting.shapes == (box,)


def test_shapes_that_leave_surface_bare_are_refused(drums, around):
    with pytest.raises(RobotError, match="'b' do not enclose its surface"):
        Splitting("b", [around.shrunk(0.01)], drums, cleared(drums, [around], 0))


@pytest.mark.slow
def test_a_link_of_a_robot_is_split_and_the_others_keep_their_shapes(pr2):
    before = read_primitives(Path(pr2.primitives))
    name = "r_wrist_roll_link"
    after = split_where_struck(pr2, before, {name: 5}, draws=4_000)
    assert [s for s in after if s.body != name] == [s for s in before if s.body != name]
    own, new = ([s for s in shapes if s.body == name] for shapes in (before, after))
    assert len(own) < len(new) <= 5
    assert enclosed(new, body_triangles(pr2.model())[name]).all()
    assert after == split_where_struck(pr2, before, {name: 5}, draws=4_000)
    with pytest.raises(UnknownNameError, match="Did you mean 'l_forearm_link'"):
        split_where_struck(pr2, before, {"l_forearm_lin": 3})
