"""What shapes contain, against the shapes of a robot and plain loops."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from tcs.model.robots.primitives import Primitive
from tcs_shapes import containment as holding
from tcs_shapes.containment import box_cost, tightest_rectangles
from tcs_shapes.covering import rounded_box

SHAPES = [
    Primitive(
        body="arm", kind="sphere", size=(0.05,), xyz=(0.01, 0, 0.02), quaternion=(1, 0, 0, 0)
    ),
    Primitive(
        body="arm", kind="capsule", size=(0.03, 0.1), xyz=(0, 0.02, 0), quaternion=(0.8, 0.6, 0, 0)
    ),
    Primitive(
        body="arm", kind="box", size=(0.1, 0.06, 0.14), xyz=(0, 0, 0), quaternion=(0.8, 0, 0.6, 0)
    ),
]


@pytest.fixture(params=SHAPES, ids=lambda shape: shape.kind)
def shape(request):
    return request.param


@pytest.fixture
def points(rng):
    return rng.uniform(-0.1, 0.1, (3000, 3))


def test_points_in_a_shape(shape, points):
    found = holding.contains_points(rounded_box(shape), points)
    assert 50 < found.sum() < 2000
    np.testing.assert_array_equal(found, shape.contains(points))


def test_pieces_in_a_shape(shape, points):
    pieces = (points[:, None] + 0.1 * points[:2999:1000][None]).copy()
    found = holding.contains_pieces(rounded_box(shape), pieces)
    assert 30 < found.sum() < shape.contains(pieces).any(axis=1).sum()
    np.testing.assert_array_equal(found, shape.contains_triangles(pieces))


def test_how_far_pieces_protrude(shape, points):
    pieces = points.reshape(-1, 3, 3)
    found = holding.farthest_of_pieces(rounded_box(shape), pieces)
    # Rounding of single products of about 0.01 m^2.
    np.testing.assert_allclose(found, shape.distance(pieces).max(axis=1), atol=1e-15)


def test_cells_in_a_shape(shape, rng):
    cells, origin, pitch = rng.random((30, 28, 26)) < 0.5, np.full(3, -0.1), 0.008
    first = np.array([[2, 0, 1], [29, 20, 25]])
    found = holding.set_cells_within(rounded_box(shape), cells, first, origin, pitch)
    looked_at = np.zeros_like(cells)
    looked_at[2:30, 0:21, 1:26] = cells[2:30, 0:21, 1:26]
    at = np.argwhere(looked_at)
    expected = at[shape.contains(at * pitch + origin)]
    assert len(expected) > 100
    np.testing.assert_array_equal(found, np.ravel_multi_index(tuple(expected.T), cells.shape))


def test_what_boxes_and_capsules_contain(points, rng):
    pieces, alone = (points[:900, None] * [[[0.9], [1.0], [1.1]]]), points[900:]
    items = [*pieces, *alone[:, None]]
    low, high = rng.uniform(-0.09, 0.0, (20, 3)), rng.uniform(0.0, 0.09, (20, 3))
    boxes = np.stack([low, high], axis=1).astype(np.float32)
    least, greatest = (
        np.array([f(item, axis=0) for item in items], np.float32) for f in (np.min, np.max)
    )
    expected = [
        [(b[0] <= a).all() and (c <= b[1]).all() for a, c in zip(least, greatest, strict=True)]
        for b in boxes
    ]
    assert np.any(expected)
    assert not np.all(expected)
    np.testing.assert_array_equal(holding.in_boxes(boxes, least, greatest), expected)
    # A sphere among them.
    ends = rng.uniform(-0.05, 0.05, (20, 2, 3))
    ends[0, 1], radii = ends[0, 0], rng.uniform(0.02, 0.06, 20)
    along = np.linspace(0.0, 1.0, 20_001)[:, None]

    def is_near(item, n):
        axis = ends[n, 0] + along * (ends[n, 1] - ends[n, 0])
        away = np.linalg.norm(item[:, None] - axis, axis=2).min(axis=1)
        # The axis is sampled: at the surface, half a step of 5 um decides.
        return None if np.abs(away - radii[n]).min() < 1e-6 else bool((away <= radii[n]).all())

    found = holding.in_capsules(ends, radii, np.ascontiguousarray(pieces), alone)
    for n in (0, 1, 2):
        for i in range(0, len(items), 40):
            assert is_near(items[i], n) in (None, bool(found[n, i]))


def test_those_that_cover_most_are_chosen_one_after_the_other(rng):
    covered, weights = rng.random((40, 300)) < 0.1, rng.integers(1, 20, 300)
    order = rng.permutation(40)
    left, expected = np.ones(300, np.bool_), []
    while len(expected) < 25 and left[:250].sum() > 20:
        gains = [int(weights[covered[n] & left].sum()) for n in order]
        expected.append(int(order[int(np.argmax(gains))]))
        left &= ~covered[expected[-1]]
    found = holding.chosen_covers(covered, order, weights, 250, 25, 20)
    assert len(expected) > 10
    assert found.tolist() == expected


def test_of_those_that_cover_as_much_the_first_in_order_is_chosen():
    covered = np.array([[True, True, False], [True, True, False], [False, False, True]])
    weights = np.ones(3, np.int64)
    assert holding.chosen_covers(covered, np.array([1, 0, 2]), weights, 3, 9, 0).tolist() == [1, 2]
    # Nothing is left that another one covers.
    assert holding.chosen_covers(covered[:2], np.arange(2), weights, 3, 9, 0).tolist() == [0]


@pytest.mark.parametrize("seed", range(5))
def test_a_circle_is_nearly_the_smallest(seed):
    rng = np.random.default_rng(seed)
    angles, steps = rng.uniform(0, 2 * np.pi, 200), 2000
    middle = np.array([0.3, -0.1])
    rim = middle + 0.05 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    inner = middle + 0.03 * rng.uniform(-1, 1, (300, 2))
    points = np.concatenate([rim, inner])
    centre, radius = holding.circle_around(points, steps)
    assert np.linalg.norm(points - centre, axis=1).max() == pytest.approx(radius, rel=1e-12)
    # The bound of the source.
    assert radius <= 0.05 * (1 + 1 / steps)


@pytest.mark.parametrize("seed", range(5))
def test_a_rectangle_has_a_side_on_the_hull_and_is_the_smallest(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(60, 3)) * [3.0, 2.0, 1.0]
    # On a grid, many are in a row.
    points = np.round(points, 1) if seed % 2 else points
    frames = Rotation.random(7, rng=rng).as_matrix()
    angles, areas = tightest_rectangles(points, frames)
    for frame, angle, area in zip(frames, angles, areas, strict=True):
        seen = (points @ frame)[:, :2]
        corners = seen[ConvexHull(seen).vertices]
        edges = np.roll(corners, -1, axis=0) - corners

        def area_at(angle, seen=seen):
            c, s = np.cos(angle), np.sin(angle)
            return np.ptp(seen @ [c, s]) * np.ptp(seen @ [-s, c])

        least = min(area_at(np.arctan2(y, x)) for x, y in edges)
        # Rounding of a few products.
        assert area == pytest.approx(least, rel=1e-12)
        assert area_at(angle) == pytest.approx(least, rel=1e-12)
        assert area <= min(area_at(a) for a in np.linspace(0, np.pi / 2, 200)) * (1 + 1e-12)


def test_points_in_a_line_have_a_rectangle_without_area():
    points = np.linspace(0, 1, 5)[:, None] * [3.0, 4.0, 0.0]
    angles, areas = tightest_rectangles(points, np.eye(3)[None])
    # Rounding of products of up to 5 m.
    assert areas[0] == pytest.approx(0.0, abs=1e-14)
    assert np.tan(angles[0]) == pytest.approx(4 / 3)


def test_the_cost_of_a_box(rng):
    points, outside = rng.uniform(-1, 1, (50, 3)), rng.uniform(-2, 2, (2000, 3))
    costs, R = rng.random(2000), Rotation.random(rng=rng).as_matrix()
    seen, others = points @ R, outside @ R
    low, high = seen.min(axis=0), seen.max(axis=0)
    within = ((others >= low) & (others <= high)).all(axis=1)
    assert 100 < within.sum() < 1900
    expected = costs[within].sum() + 0.3 * (high - low).prod()
    assert box_cost(points, outside, costs, R, 0.3) == pytest.approx(expected, rel=1e-12)
