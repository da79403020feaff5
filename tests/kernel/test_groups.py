"""Groups of shapes: the box around each encloses them, and its gap is the greatest of theirs."""

import itertools

import numpy as np
import pytest

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE, pack
from tcs.kernel.groups import first_rows, with_boxes, with_group_rows
from tests.kernel.shapes import as_shapes, placed, random_size, rotation


def surface_points(row):
    """Return points of a packed shape that reach as far as it does in any direction, nearly."""
    R, p, size = row[ROTATION:].reshape(3, 3), row[CENTRE:ROTATION], row[SIZE : SIZE + 3]
    if row[TYPE] == BOX:
        return p + np.array(list(itertools.product(*((-s, s) for s in size)))) @ R.T
    rng = np.random.default_rng(0)
    out = rng.normal(size=(500, 3))
    out *= size[0] / np.linalg.norm(out, axis=1)[:, None]
    half = size[1] if row[TYPE] == CAPSULE else 0.0
    return np.concatenate([p + sign * half * R[:, 2] + out for sign in (-1, 1)])


@pytest.mark.parametrize("seed", range(5))
def test_box_encloses_the_shapes_of_its_group(seed):
    rng = np.random.default_rng(seed)
    kinds = rng.choice((SPHERE, CAPSULE, BOX), size=6)
    shapes = [placed(k, random_size(rng, k), rotation(rng), rng.normal(size=3)) for k in kinds]
    rows, first = pack(as_shapes(shapes)), first_rows(np.array([0, 0, 0, 1, 2, 2]))
    np.testing.assert_array_equal(first, [0, 3, 4, 6])
    grouped = with_boxes(rows, first)[0]
    np.testing.assert_array_equal(grouped[:6], rows[0])
    np.testing.assert_array_equal(grouped[7], rows[0, 3])  # a single shape is its own box
    for g, box in enumerate(grouped[6:]):
        R, p = box[ROTATION:].reshape(3, 3), box[CENTRE:ROTATION]
        for row in rows[0, first[g] : first[g + 1]]:
            points = surface_points(row)
            assert np.linalg.norm(points - p, axis=1).max() <= box[BOUND] + 1e-9
            if box[TYPE] == BOX:
                assert np.all(np.abs((points - p) @ R) <= box[SIZE : SIZE + 3] + 1e-12)
            else:
                assert box[TYPE] in (SPHERE, CAPSULE)
                assert first[g + 1] - first[g] == 1


def test_boxes_follow_their_shapes_from_state_to_state():
    rng = np.random.default_rng(1)
    shapes = [
        placed(k, random_size(rng, k), rotation(rng), rng.normal(size=3))
        for k in (SPHERE, CAPSULE, BOX)
    ]
    still, R, p = as_shapes(shapes), rotation(rng), rng.normal(size=3)
    both = still._replace(
        R=np.concatenate([still.R, R @ still.R]), p=np.concatenate([still.p, still.p @ R.T + p])
    )
    first = first_rows(np.zeros(len(shapes), np.int64))
    before, after = with_boxes(pack(both), first)[:, -1]
    np.testing.assert_array_equal(before[:CENTRE], after[:CENTRE])
    np.testing.assert_allclose(R @ before[CENTRE:ROTATION] + p, after[CENTRE:ROTATION], atol=1e-12)
    np.testing.assert_allclose(
        R @ before[ROTATION:].reshape(3, 3), after[ROTATION:].reshape(3, 3), atol=1e-12
    )


def test_gap_of_a_group_is_the_greatest_of_its_shapes():
    gaps = np.array([[0.1, -1.0], [0.2, -1.0], [-1.0, -1.0]])
    np.testing.assert_array_equal(
        with_group_rows(gaps, np.array([0, 2, 3])), [*gaps, [0.2, -1.0], [-1.0, -1.0]]
    )
