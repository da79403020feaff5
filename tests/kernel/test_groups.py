"""Groups of shapes, and clusters in them: boxes enclose their shapes and leave no contact out."""

import itertools

import numpy as np
import pytest

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.kernel.cache import jit
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE, closer, pack
from tcs.kernel.group_contacts import group_touches, groups_touch
from tcs.kernel.shape_groups import CLUSTER, groups_of, with_boxes, with_group_rows
from tests.chosen import some_of
from tests.kernel.shapes import as_shapes, placed, random_size, rotation

MANY = 5 * CLUSTER


@jit
def touching_groups(a, groups, b, others, gaps, found):
    """Fill whether each group of a touches each of b."""
    rows = np.zeros(2, np.int64)
    for g in range(len(groups.first) - 1):
        for h in range(len(others.first) - 1):
            i, j = groups.first[-1] + g, others.first[-1] + h
            if gaps[i, j] > 0.0 and closer(a, i, b, j, gaps[i, j]):
                found[g, h] = groups_touch(a, groups, g, b, others, h, gaps, rows)


@jit
def touching_shapes(a, groups, b, gaps, found):
    """Fill whether each group of a touches each shape of b."""
    rows = np.zeros(2, np.int64)
    for g in range(len(groups.first) - 1):
        for j in range(len(b)):
            if gaps[groups.first[-1] + g, j] > 0.0:
                found[g, j] = group_touches(a, groups, g, b, j, gaps, rows)


@jit
def touching_pairs(a, b, gaps, found):
    """Fill whether each shape of a touches each of b."""
    for i in range(len(found)):
        for j in range(found.shape[1]):
            found[i, j] = gaps[i, j] > 0.0 and closer(a, i, b, j, gaps[i, j])


def random_group(rng, sizes):
    """Return packed shapes in groups of these sizes with their boxes, and the groups."""
    keys = np.repeat(np.arange(len(sizes)), sizes)
    kinds = rng.choice((SPHERE, CAPSULE, BOX), size=len(keys))
    shapes = as_shapes(
        [placed(k, 0.3 * random_size(rng, k), rotation(rng), rng.normal(size=3)) for k in kinds]
    )
    groups = groups_of(shapes.p[0], keys)
    return with_boxes(pack(shapes), groups)[0], groups


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
    rows, groups = random_group(np.random.default_rng(seed), (3, 1, 2, MANY))
    np.testing.assert_array_equal(groups.first, [0, 3, 4, 6, 6 + MANY])
    np.testing.assert_array_equal(rows[groups.first[-1] + 1], rows[3])  # its own box
    boxes = [*range(groups.first[-1], groups.first[-1] + 4), *groups.cluster_box]
    assert set(boxes) == set(range(groups.first[-1], len(rows)))
    inside = [np.arange(a, b) for a, b in itertools.pairwise(groups.first)]
    inside += [groups.members[a:b] for a, b in itertools.pairwise(groups.cluster_first)]
    for box, shapes in zip(rows[boxes], inside, strict=True):
        R, p = box[ROTATION:].reshape(3, 3), box[CENTRE:ROTATION]
        for row in rows[shapes]:
            points = surface_points(row)
            assert np.linalg.norm(points - p, axis=1).max() <= box[BOUND] + 1e-9
            if box[TYPE] == BOX:
                assert np.all(np.abs((points - p) @ R) <= box[SIZE : SIZE + 3] + 1e-12)
            else:
                assert box[TYPE] in (SPHERE, CAPSULE)
                assert len(shapes) == 1


@pytest.mark.parametrize("number", [1, CLUSTER, CLUSTER + 1, 7 * CLUSTER + 5])
def test_shapes_of_a_cluster_are_neighbours(number):
    keys, centres = np.repeat([4, 9], number), np.random.default_rng(2).normal(size=(2 * number, 3))
    groups = groups_of(centres, keys)
    np.testing.assert_array_equal(np.sort(groups.members[:number]), np.arange(number))
    assert groups.clusters[1] * CLUSTER >= number
    for first in itertools.pairwise(groups.clusters):
        several = first[1] - first[0] > 1
        assert several == (number > CLUSTER)
        for c in range(*first):
            members = groups.members[groups.cluster_first[c] : groups.cluster_first[c + 1]]
            assert 1 <= len(members) <= CLUSTER
            # A cluster stays in its order, and one of several is smaller than the group.
            assert np.all(np.diff(members) > 0)
            of_group = np.flatnonzero(keys == keys[members[0]])
            extent, whole = (np.prod(np.ptp(centres[rows], axis=0)) for rows in (members, of_group))
            assert extent < whole / 2 if several else extent == whole


@pytest.mark.parametrize("seed", some_of(range(12), 0, 1, 2, 3))
def test_clusters_leave_no_contact_out(seed):
    rng = np.random.default_rng(seed)
    sizes = ((MANY, 3, 1, CLUSTER + 1, 2 * MANY), (1, MANY, 5, 2 * CLUSTER))
    (a, groups), (b, others) = (random_group(rng, of) for of in sizes)
    n, m = groups.first[-1], others.first[-1]
    a[:, CENTRE : CENTRE + 3] += 0.3 * seed * rotation(rng)[0]
    gaps = np.where(rng.random((n, m)) < 0.8, 10 ** rng.uniform(-6, -1, (n, m)), -1.0)
    pairs = np.zeros((n, m), np.bool_)
    touching_pairs(a, b, gaps, pairs)
    of_shapes = np.logical_or.reduceat(pairs, groups.first[:-1])
    of_groups = np.logical_or.reduceat(of_shapes, others.first[:-1], axis=1)
    grown = with_group_rows(gaps, groups)
    found = np.zeros_like(of_shapes)
    touching_shapes(a, groups, b[:m].copy(), grown, found)
    np.testing.assert_array_equal(found, of_shapes)
    grown = np.ascontiguousarray(with_group_rows(grown.T, others).T)
    found = np.zeros_like(of_groups)
    touching_groups(a, groups, b, others, grown, found)
    np.testing.assert_array_equal(found, of_groups)
    assert not np.all(of_groups)
    assert seed > 3 or np.any(of_groups)


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
    groups = groups_of(still.p[0], np.zeros(len(shapes), np.int64))
    before, after = with_boxes(pack(both), groups)[:, -1]
    np.testing.assert_array_equal(before[:CENTRE], after[:CENTRE])
    np.testing.assert_allclose(R @ before[CENTRE:ROTATION] + p, after[CENTRE:ROTATION], atol=1e-12)
    np.testing.assert_allclose(
        R @ before[ROTATION:].reshape(3, 3), after[ROTATION:].reshape(3, 3), atol=1e-12
    )


def test_gap_of_a_box_is_the_greatest_of_its_shapes():
    gaps = np.array([[0.1, -1.0], [0.2, -1.0], [-1.0, -1.0]])
    groups = groups_of(np.zeros((3, 3)), np.array([0, 0, 1]))
    np.testing.assert_array_equal(with_group_rows(gaps, groups), [*gaps, [0.2, -1.0], [-1.0, -1.0]])
    gaps = np.arange(CLUSTER + 2.0)[:, None]
    half = CLUSTER // 2
    centres = np.arange(CLUSTER + 2.0)[:, None] * np.ones(3)
    groups = groups_of(centres, np.zeros(CLUSTER + 2, np.int64))
    np.testing.assert_array_equal(
        with_group_rows(gaps, groups)[CLUSTER + 2 :, 0],
        [CLUSTER + 1.0, half, CLUSTER + 1.0],
    )
