"""Fitting: tight boxes, coverings, and that the shipped file is what the script writes."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs.errors import UnknownNameError
from tcs.model.robots import load_robot
from tcs.model.robots.primitives import enclosed, read_primitives, union_volume
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs_shapes import covering as candidates
from tcs_shapes.bodies import HAND, fit_robot, refit
from tcs_shapes.bounding import best_candidate, corner_points, enclose, moved, tightest_orientation
from tcs_shapes.covering import Part, Target, fit_triangles, refit_part


def triangles_of(*solids):
    return np.concatenate([np.asarray(solid.triangles) for solid in solids])


def box_at(size, xyz=(0, 0, 0), seed=None):
    solid = trimesh.creation.box(size)
    pose = np.eye(4)
    if seed is not None:
        pose[:3, :3] = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    pose[:3, 3] = xyz
    return solid.apply_transform(pose)


@pytest.mark.parametrize("seed", range(5))
def test_a_rotated_box_is_fitted_by_an_equal_box(seed):
    points = corner_points(triangles_of(box_at((0.1, 0.2, 0.3), seed=seed)))
    R = tightest_orientation(points)
    # Facet normals are compared to 6 digits, which may tilt the frame by as much.
    np.testing.assert_allclose(np.sort(np.ptp(points @ R, axis=0)), [0.1, 0.2, 0.3], atol=1e-6)


def test_capsule_gets_a_capsule():
    solid = trimesh.creation.capsule(height=0.3, radius=0.05, count=[32, 32])
    points = corner_points(triangles_of(solid))
    candidate = best_candidate(points, np.stack([tightest_orientation(points), np.eye(3)]))
    assert candidate.kind == "capsule"
    shape = enclose("b", points, candidate.kind, candidate.R)
    assert shape.contains(points).all()
    # The polyhedron's corners lie on the capsule; its circle is found to within 1/2000.
    np.testing.assert_allclose(shape.size, [0.05, 0.3], atol=1e-3)


def test_l_shape_needs_two_boxes():
    surface = triangles_of(
        box_at((0.4, 0.1, 0.1)),
        box_at((0.1, 0.1, 0.4), xyz=(0.15, 0.0, 0.25)),
    )
    fit = fit_triangles("b", surface, Target(protrusion=0.02, max_shapes=4))
    assert len(fit.primitives) == 2
    assert enclosed(fit.primitives, surface).all()
    # The two boxes, one of which reaches through the other.
    assert fit.union == pytest.approx(0.008, rel=0.07)


def test_a_part_too_thin_for_voxels_gets_one_shape():
    """A box with a corner of one triangle far away: nothing inside is as wide as the voxels."""
    surface = triangles_of(box_at((0.05, 0.1, 0.2)))
    surface[0, 0] = [10.0, 0.05, 0.0]
    fit = fit_triangles("b", surface, Target(protrusion=0.01, max_shapes=8))
    assert len(fit.primitives) == 1
    assert enclosed(fit.primitives, surface).all()


def test_long_triangles_are_cut():
    """A tube of long triangles; shapes that each enclose a part of some follow it closely."""
    tube = triangles_of(trimesh.creation.cylinder(0.06, 0.2, sections=8))
    fit = fit_triangles("b", tube, Target(protrusion=0.008, max_shapes=8))
    assert enclosed(fit.primitives, tube).all()
    alone = np.any([shape.contains_triangles(tube) for shape in fit.primitives], axis=0)
    assert not alone.all()
    # Its smallest box has 1.2 times the volume.
    assert fit.excess < 1.12


def test_a_body_of_the_same_shape_gets_the_same_primitives():
    R, p = Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix(), np.array([0.1, 0.02, -0.3])
    points = corner_points(triangles_of(box_at((0.1, 0.2, 0.3), seed=3)))
    shape = enclose("b", points, "box", tightest_orientation(points))
    other = moved(shape, "c", R, p)
    assert other.body == "c"
    assert other.contains(points @ R.T + p).all()
    np.testing.assert_allclose(other.size, shape.size, atol=1e-5)  # rounding
    assert moved(shape, "c", np.eye(3), np.zeros(3)) == dataclasses.replace(shape, body="c")


def test_shipped_shapes_are_what_the_fit_gives():
    robot, body = load_robot("panda"), "panda_leftfinger"
    fit = fit_triangles(body, body_triangles(robot.model())[body], HAND)
    shipped = [shape for shape in robot.load_primitives() if shape.body == body]
    assert len(fit.primitives) == len(shipped)
    # Another build of the linear algebra may round a last digit elsewhere.
    np.testing.assert_allclose(
        sorted(s.volume for s in fit.primitives), sorted(s.volume for s in shipped), rtol=1e-3
    )


@pytest.mark.slow
def test_shipped_file_is_what_the_script_writes():
    # A robot of which `scripts/fits.yaml` says nothing.
    robot = load_robot("iiwa7")
    fitted = [shape for found in fit_robot(robot) for shape in found.fit.primitives]
    shipped = robot.load_primitives()
    assert [(s.body, s.kind) for s in fitted] == [(s.body, s.kind) for s in shipped]
    # As above.
    np.testing.assert_allclose([s.volume for s in fitted], [s.volume for s in shipped], rtol=1e-3)


def test_bodies_to_keep_have_the_shapes_of_the_file():
    robot = load_robot("iiwa7")
    shipped = robot.load_primitives()
    fits = fit_robot(robot, chosen=dict.fromkeys({shape.body for shape in shipped}))
    assert sorted(shape.body for found in fits for shape in found.fit.primitives) == sorted(
        shape.body for shape in shipped
    )
    for found in fits:
        assert found.fit.primitives == tuple(s for s in shipped if s.body == found.body)
        assert found.fit.excess > 0.0
    with pytest.raises(UnknownNameError, match="iiwa_link_8"):
        fit_robot(robot, chosen={"iiwa_link_8": None})


def test_fitting_one_body_again_changes_no_other(pr2):
    before = read_primitives(Path(pr2.primitives))
    name = "l_gripper_l_finger_tip_link"
    after = refit(pr2, {name: Target(HAND.protrusion, 6)})
    body = [shape for shape in after if shape.body == name]
    assert 1 < len(body) <= 6
    assert [s for s in after if s not in body] == [s for s in before if s.body != name]
    assert enclosed(body, body_triangles(pr2.model())[name]).all()
    assert union_volume(body) < union_volume(s for s in before if s.body == name)
    with pytest.raises(UnknownNameError, match="Did you mean 'l_forearm_link'"):
        refit(pr2, {"l_forearm_lin": HAND})


def test_patches_cover_what_few_shapes_leave_bare(monkeypatch):
    # A tenth of the usual candidates is enough for a ring.
    monkeypatch.setattr(candidates, "_SEEDS", 30)
    monkeypatch.setattr(candidates, "_CAPSULES", 60)
    ring = np.asarray(trimesh.creation.annulus(0.09, 0.1, 0.02).triangles)
    few, patched = (fit_triangles("b", ring, Target(0.008, 4, most)) for most in (0, 20))
    for fit in (few, patched):
        assert enclosed(fit.primitives, ring).all()
    assert len(few.primitives) < len(patched.primitives) <= 24
    # Four shapes grow to contain the rest of the ring; patches follow it.
    assert patched.union < 0.7 * few.union


def test_a_part_is_fitted_more_closely_than_the_rest(monkeypatch):
    monkeypatch.setattr(candidates, "_SEEDS", 40)
    # A drum with a narrower one on top, and a box around both, which that on top does not fill.
    lower = trimesh.creation.cylinder(0.1, 0.1, sections=24)
    upper = trimesh.creation.cylinder(0.06, 0.08, sections=24).apply_translation((0, 0, 0.09))
    drum = triangles_of(lower, upper)
    box = enclose("b", corner_points(drum), "box", np.eye(3))
    part = Part(
        (-0.1, -0.1, 0.06), (0.1, 0.1, 0.14), 0.006, 16, patches=8, axes="z", capsules=False
    )
    shapes = refit_part("b", drum, (box,), part)
    assert enclosed(shapes, drum).all()
    # Points beside the drum on top, farther from it than shapes may protrude.
    angle = np.linspace(0.0, 2.0 * np.pi, 60)[:, None, None]
    r, z = np.meshgrid(np.linspace(0.07, 0.1, 6), np.linspace(0.07, 0.125, 6))
    x, y, z = np.broadcast_arrays(r * np.cos(angle), r * np.sin(angle), z)
    beside = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    assert box.contains(beside).all()
    assert not np.any([shape.contains(beside) for shape in shapes], axis=0).any()
