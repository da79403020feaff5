"""What a body sweeps as it turns about an axis, against points of it that are turned."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs_shapes.surface_pair import SIDES, SLICE, revolved


def within(points, prisms, axis):
    """Return which points are in one of the prisms, up to rounding."""
    along = (points - axis[0]) @ axis[1]
    off = np.linalg.norm(points - axis[0] - np.outer(along, axis[1]), axis=1)
    found = np.zeros(len(points), bool)
    for prism in prisms:
        seen = (prism.reshape(-1, 3) - axis[0]) @ axis[1]
        rim = prism[:, 1] - axis[0]
        rim = np.linalg.norm(rim - np.outer(rim @ axis[1], axis[1]), axis=1)
        inner = rim.max() * np.cos(np.pi / SIDES)
        found |= (along >= seen.min() - 1e-9) & (along <= seen.max() + 1e-9) & (off <= inner + 1e-9)
    return found


@pytest.mark.parametrize("scale", [0.0003, 0.05])
def test_all_that_is_swept_is_within(scale, rng):
    for _ in range(5):
        triangles = rng.normal(size=(6, 3, 3)) * scale
        direction = rng.normal(size=3)
        axis = (rng.normal(size=3) * scale, direction / np.linalg.norm(direction))
        prisms = revolved(triangles, axis).reshape(-1, 4 * SIDES, 3, 3)
        weights = rng.dirichlet(np.full(3, 0.4), (6, 300))
        points = np.einsum("nkc,ncx->nkx", weights, triangles).reshape(-1, 3)
        angles = rng.uniform(0.0, 2.0 * np.pi, (len(points), 1))
        turned = Rotation.from_rotvec(angles * axis[1]).apply(points - axis[0]) + axis[0]
        assert within(turned, prisms, axis).all()


def test_round_bodies_grow_little(rng):
    cylinder = trimesh.creation.cylinder(radius=0.04, height=0.05, sections=200)
    X = trimesh.transformations.random_rotation_matrix(rng.random(3))
    X[:3, 3] = [0.2, -0.1, 0.4]
    cylinder.apply_transform(X)
    axis = (X[:3, 3], X[:3, 2])
    found = trimesh.Trimesh(**trimesh.triangles.to_kwargs(revolved(cylinder.triangles, axis)))
    assert found.is_volume
    assert cylinder.volume < found.volume < 1.003 * cylinder.volume
    # Of a cone, each slice is as wide as its widest end.
    cone = trimesh.creation.cone(radius=0.04, height=0.05, sections=200)
    axis = (np.zeros(3), np.array([0.0, 0.0, 1.0]))
    prisms = revolved(cone.triangles, axis).reshape(-1, 4 * SIDES, 3, 3)
    tip = prisms[-1].reshape(-1, 3)
    assert tip[:, 2].max() == pytest.approx(0.05)
    assert np.linalg.norm(tip[:, :2], axis=1).max() < 1.001 * 0.8 * SLICE
