"""Fitting: tight boxes, divisions, and that the shipped file is what the script writes."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs.errors import UnknownNameError
from tcs.model.robots.fitting.bodies import HAND, fit_robot, refit
from tcs.model.robots.fitting.bounding import (
    best_candidate,
    corner_points,
    enclose,
    tightest_orientation,
)
from tcs.model.robots.fitting.division import Target, fit_triangles
from tcs.model.robots.primitives import enclosed, read_primitives, union_volume
from tcs.model.robots.urdf.surfaces import body_triangles


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
    candidate = best_candidate(points, np.eye(3)[None])
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
    fit = fit_triangles("b", surface, Target(excess=0.0, max_shapes=4))
    assert len(fit.primitives) == 2
    assert enclosed(fit.primitives, surface).all()
    # Exactly the two boxes; sizes were rounded up by 2 micrometres.
    assert fit.union == pytest.approx(0.008, rel=1e-3)


def test_fit_stops_at_its_target():
    surface = triangles_of(box_at((0.4, 0.1, 0.1)), box_at((0.1, 0.1, 0.4), xyz=(0.15, 0, 0.25)))
    assert len(fit_triangles("b", surface, Target(excess=5.0, max_shapes=4)).primitives) == 1


def test_shipped_shapes_are_what_the_fit_gives(pr2):
    body = "l_gripper_l_finger_tip_link"
    fit = fit_triangles(body, body_triangles(pr2.model())[body], HAND)
    shipped = [shape for shape in pr2.load_primitives() if shape.body == body]
    assert len(fit.primitives) == len(shipped)
    # Another build of the linear algebra may round a last digit elsewhere.
    np.testing.assert_allclose(
        sorted(s.volume for s in fit.primitives), sorted(s.volume for s in shipped), rtol=1e-3
    )


@pytest.mark.slow
def test_shipped_file_is_what_the_script_writes(pr2):
    fitted = [shape for found in fit_robot(pr2) for shape in found.fit.primitives]
    shipped = pr2.load_primitives()
    assert [(s.body, s.kind) for s in fitted] == [(s.body, s.kind) for s in shipped]
    # As above.
    np.testing.assert_allclose([s.volume for s in fitted], [s.volume for s in shipped], rtol=1e-3)


def test_fitting_one_body_again_follows_it_more_closely(pr2):
    before = read_primitives(Path(pr2.primitives))
    after = refit(pr2, {"l_forearm_link": 3})
    body = [shape for shape in after if shape.body == "l_forearm_link"]
    assert 1 < len(body) <= 3
    assert [s for s in after if s not in body] == [s for s in before if s.body != body[0].body]
    assert enclosed(body, body_triangles(pr2.model())[body[0].body]).all()
    assert union_volume(body) < union_volume(s for s in before if s.body == body[0].body)
    with pytest.raises(UnknownNameError, match="Did you mean 'l_forearm_link'"):
        refit(pr2, {"l_forearm_lin": 3})
