import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from tcs.placement.constraints.contact import boxes_overlap, in_contact, segment_distance
from tcs.placement.store.robot_shapes import BOX, CAPSULE, SPHERE

HALF = np.array([0.3, 0.2, 0.5])


def random_segments(rng, count):
    a, b = rng.uniform(-1.2, 1.2, (2, count, 3))
    # Segments parallel to a face, to an edge, and of no length.
    b[: count // 4, 2] = a[: count // 4, 2]
    b[: count // 8, 1] = a[: count // 8, 1]
    b[: count // 16] = a[: count // 16]
    return a, b


def test_segment_distance_equals_that_of_its_nearest_point():
    rng = np.random.default_rng(0)
    a, b = random_segments(rng, 400)
    t = np.linspace(0.0, 1.0, 4001)[None, :, None]
    points = a[:, None] + t * (b - a)[:, None]
    sampled = np.linalg.norm(np.maximum(np.abs(points) - HALF, 0.0), axis=2).min(axis=1)
    found = segment_distance(HALF, a, b)
    # The nearest sample is at most half a step, 3.5 m / 8000, farther.
    assert np.all(found <= sampled + 1e-12)
    assert np.all(found >= sampled - 4.4e-4)


def is_common(half, size, R, p):
    """Whether two boxes have a point in common, by linear programming."""
    faces = np.concatenate([np.eye(3), -np.eye(3), R.T, -R.T])
    bounds = np.concatenate([half, half, R.T @ p + size, size - R.T @ p])
    return linprog(np.zeros(3), A_ub=faces, b_ub=bounds, bounds=(None, None)).status == 0


def test_boxes_overlap_if_they_have_a_point_in_common():
    rng = np.random.default_rng(1)
    count = 120
    size = rng.uniform(0.01, 0.5, (count, 3))
    R = Rotation.random(count, random_state=2).as_matrix()
    # Parallel edges make products of edges vanish.
    R[::4] = np.eye(3)
    R[1::4] = Rotation.from_euler("z", rng.uniform(-3, 3, (count // 4, 1))).as_matrix()
    p = rng.uniform(-1.0, 1.0, (count, 3))
    found = boxes_overlap(HALF, size, R, p, np.zeros(count))
    expected = [is_common(HALF, *box) for box in zip(size, R, p, strict=True)]
    np.testing.assert_array_equal(found, expected)
    assert 20 < found.sum() < 100


@pytest.mark.parametrize(
    ("type_", "size", "reach"),
    [(SPHERE, (0.1, 0, 0), 0.1), (CAPSULE, (0.1, 0.2, 0), 0.3), (BOX, (0.4, 0.4, 0.1), 0.1)],
)
def test_a_shape_within_its_clearance_is_in_contact(type_, size, reach):
    heights = HALF[2] + reach + np.array([-1e-9, 0.019, 0.021])
    found = in_contact(
        HALF,
        np.full(3, type_),
        np.tile(np.array(size, dtype=float), (3, 1)),
        np.tile(np.eye(3), (3, 1, 1)),
        np.stack([[0.1, 0.1, height] for height in heights]),
        np.full(3, 0.02),
    )
    assert found.tolist() == [True, True, False]
