"""Shapes made tighter: they enclose what they did, leave less outside, and never protrude anew."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.primitives import enclosed, read_primitives, union_volume
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs_shapes import tightening as module
from tcs_shapes.bounding import corner_points, enclose, enclose_axis
from tcs_shapes.tightening import Tightening, tightened


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """A grid of 5 mm for drums of 20 cm, which is quick."""
    monkeypatch.setattr(module, "CELLS", 64_000)
    monkeypatch.setattr(module, "SPOT_CELLS", 64_000)


@pytest.fixture(scope="module")
def steps():
    """Two drums on one axis, one above the other."""
    lower = trimesh.creation.cylinder(0.1, 0.1, sections=24)
    upper = trimesh.creation.cylinder(0.06, 0.1, sections=24).apply_translation((0, 0, 0.1))
    return np.concatenate([lower.triangles, upper.triangles])


@pytest.fixture(scope="module")
def wide(steps):
    """A box around both drums, and a capsule around the upper one, with its caps beyond it."""
    box = enclose("b", corner_points(steps), "box", np.eye(3))
    capsule = enclose_axis("b", np.array([0, 0, 0.0]), np.array([0, 0, 0.2]), 0.07)
    return box, capsule


def test_each_shape_is_reduced_to_what_it_alone_contains(steps, wide):
    tightening = Tightening("b", wide, steps)
    before = tightening.excess
    tightening.reduce()
    assert enclosed(tightening.shapes, steps).all()
    # The box leaves the upper drum to the capsule, whose caps end with the drum.
    assert tightening.excess < 0.6 * before
    assert union_volume(tightening.shapes) < 0.7 * union_volume(wide)


def test_excess_is_the_volume_outside(steps, wide):
    box, _ = wide
    # Drums of 24 sides; a cell of the grid is 5 mm, and the surface fills those it crosses.
    area = 12 * np.sin(2 * np.pi / 24)
    drums = area * (0.1**2 * 0.1 + 0.06**2 * 0.1)
    assert Tightening("b", (box,), steps).excess == pytest.approx(box.volume - drums, rel=0.1)


def test_splits_follow_the_surface(steps, wide):
    box, _ = wide
    excess, volume = [], []
    for most in (0, 1, 3):
        tightening = Tightening("b", (box,), steps)
        tightening.split(most)
        assert len(tightening.shapes) == 1 + most
        assert enclosed(tightening.shapes, steps).all()
        excess.append(tightening.excess)
        volume.append(sum(shape.volume for shape in tightening.shapes))
    # One cut between the drums leaves a square box around each, which at best follows two of the
    # 24 sides: its edge is then cos(7.5 deg) times the diameter.
    least = 0.1 * (0.2**2 + 0.12**2) * np.cos(np.pi / 24) ** 2
    assert least - 1e-9 < volume[1] < 0.1 * (0.2**2 + 0.12**2)
    assert excess[2] < 0.8 * excess[1] < 0.8 * excess[0]


def test_a_tilted_bar_gets_a_tilted_box():
    R = Rotation.from_euler("xyz", (10, 20, 30), degrees=True).as_matrix()
    bar = np.asarray(trimesh.creation.box((0.2, 0.03, 0.02)).triangles) @ R.T
    tightening = Tightening("b", (enclose("b", corner_points(bar), "box", np.eye(3)),), bar)
    tightening.reduce()
    (box,) = tightening.shapes
    assert enclosed((box,), bar).all()
    assert box.volume == pytest.approx(0.2 * 0.03 * 0.02, rel=0.01)


@pytest.mark.slow
def test_rotated_boxes_protrude_less(steps, monkeypatch):
    """Drums that no box along the axes follows, with and without the rotation of boxes."""
    R = Rotation.from_euler("xyz", (30, 30, 30), degrees=True).as_matrix()
    tilted = steps @ R.T
    box = enclose("b", corner_points(tilted), "box", np.eye(3))
    excess = []
    for _ in range(2):
        tightening = Tightening("b", (box,), tilted)
        tightening.split(5)
        assert enclosed(tightening.shapes, tilted).all()
        excess.append(tightening.excess)
        monkeypatch.setattr(module, "least_protruding", lambda points, R, *_: R)
    assert excess[0] < 0.93 * excess[1]


@pytest.mark.slow
def test_splits_go_where_spots_are(steps):
    """A box around two drums, both as far from it: the volume beside that in a spot goes first."""
    box = enclose("b", corner_points(steps), "box", np.eye(3))
    spot = (0.07, 0.07, 0.0, 0.04)
    inside = np.random.default_rng(0).uniform(-0.04, 0.04, (9999, 3)) + spot[:3]
    inside = inside[np.linalg.norm(inside[:, :2], axis=1) > 0.1]
    held = []
    for spots in ((), [spot]):
        tightening = Tightening("b", (box,), steps, spots)
        tightening.split(3)
        assert enclosed(tightening.shapes, steps).all()
        held.append(np.any([s.contains(inside) for s in tightening.shapes], axis=0).mean())
    assert held[1] < 0.85 * held[0]


def test_inside_behind_an_opening_stays_covered():
    """A can without a part of its lid: a ball of 5 mm enters, one of 15 mm does not."""
    can = np.asarray(trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide().triangles)
    middle = can.mean(axis=1)
    opening = (middle[:, 2] > 0.049) & (np.abs(middle[:, :2]) < 0.013).all(axis=1)
    assert opening.any()
    can = can[~opening]
    box = enclose("b", corner_points(can), "box", np.eye(3))
    tightening = Tightening("b", (box,), can)
    assert tightening.excess < 0.5 * box.volume
    tightening.reduce()
    tightening.split(20)
    assert np.any([s.contains(np.zeros((1, 3))) for s in tightening.shapes], axis=0).all()


def test_splits_of_a_capsule_never_protrude_more(steps):
    capsule = enclose_axis("b", np.array([0, 0, -0.05]), np.array([0, 0, 0.15]), 0.15)
    tightening = Tightening("b", (capsule,), steps)
    excess = [tightening.excess]
    for _ in range(4):
        tightening.split(1)
        excess.append(tightening.excess)
    assert excess == sorted(excess, reverse=True)
    assert excess[-1] < 0.7 * excess[0]
    assert enclosed(tightening.shapes, steps).all()


def test_a_round_body_is_split_into_capsules():
    """Two rods on one axis: boxes around them would have corners."""
    thick = trimesh.creation.cylinder(0.05, 0.4, sections=24)
    thin = trimesh.creation.cylinder(0.03, 0.4, sections=24).apply_translation((0, 0, 0.4))
    rods = np.concatenate([thick.triangles, thin.triangles])
    around = enclose_axis("b", np.array([0, 0, -0.2]), np.array([0, 0, 0.6]), 0.05)
    tightening = Tightening("b", (around,), rods)
    before = tightening.excess
    tightening.split(1)
    assert [shape.kind for shape in tightening.shapes] == ["capsule", "capsule"]
    assert tightening.excess < 0.6 * before
    assert enclosed(tightening.shapes, rods).all()


def test_a_body_with_spots_has_a_finer_grid(steps, wide, monkeypatch):
    monkeypatch.setattr(module, "CELLS", 1_000)
    monkeypatch.setattr(module, "SPOT_CELLS", 8_000)
    coarse, fine = (Tightening("b", wide, steps, s) for s in ((), [(0.1, 0.0, 0.0, 0.02)]))
    assert fine._solid.pitch == pytest.approx(coarse._solid.pitch / 2)


def test_round_shapes_replace_those_that_they_make_unneeded(pr2, monkeypatch):
    """A rod within a box that protrudes, and a capsule along the rod, whose caps go beyond it."""
    rod = np.asarray(trimesh.creation.cylinder(0.05, 0.5, sections=48).triangles)
    box = enclose("b", corner_points(rod), "box", np.eye(3))
    monkeypatch.setattr(module, "surfaces_to_enclose", lambda _: {"b": (None, None, rod)})
    capsule = enclose_axis("b", np.array([0, 0, -0.25]), np.array([0, 0, 0.25]), 0.0501)
    assert [s.kind for s in tightened(pr2, (box,), {"b": 0})] == ["box"]
    closer = tightened(pr2, (box,), {"b": 0}, rounds={"b": [capsule]})
    assert [s.kind for s in closer] == ["capsule"]
    assert enclosed(closer, rod).all()


def test_a_box_that_fits_is_not_split():
    solid = np.asarray(trimesh.creation.box((0.1, 0.2, 0.3)).triangles)
    box = enclose("b", corner_points(solid), "box", np.eye(3))
    tightening = Tightening("b", (box,), solid)
    tightening.reduce()
    tightening.split(5)
    assert tightening.shapes == (box,)


def test_shapes_that_leave_surface_bare_are_refused(steps, wide):
    with pytest.raises(RobotError, match="'b' do not enclose its surface"):
        Tightening("b", (wide[0].shrunk(0.01),), steps)


@pytest.mark.slow
def test_other_bodies_keep_their_shapes(pr2):
    before = read_primitives(Path(pr2.primitives))
    names = {"l_gripper_l_finger_tip_link": 3, "l_gripper_r_finger_tip_link": 1}
    after = tightened(pr2, before, names, jobs=2)
    assert [s for s in after if s.body not in names] == [s for s in before if s.body not in names]
    surfaces = body_triangles(pr2.model())
    for name in names:
        own, tight = ([s for s in shapes if s.body == name] for shapes in (before, after))
        assert union_volume(tight) < union_volume(own)
        assert enclosed(tight, surfaces[name]).all()
    with pytest.raises(UnknownNameError, match="Did you mean 'l_forearm_link'"):
        tightened(pr2, before, {"l_forearm_lin": 3})
