"""Queries, probability maps, merging and obstacles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tcs.capability.arplace import (
    FloorObstacle,
    ObjectPose,
    ProbabilityMap,
    covariance_of,
    merge_maps,
    query,
)
from tcs.capability.arplace.query import checked_covariance, wilson_interval
from tcs.errors import SelectionError, TcsError, UnknownNameError
from tests.capability.arplace.example import TASK, discs, model, two_parts

MIDDLE = ObjectPose(distance=0.1, height=0.5)


@pytest.fixture(scope="module", params=["by-shape", "equidistant", "signed-distance"])
def arplace(request):
    return model(representation=request.param, energy=1.0)


def probability_map(values):
    values = np.asarray(values, dtype=np.float64)
    x, y = (np.arange(n, dtype=np.float64) for n in values.shape)
    return ProbabilityMap(x, y, values, 0.0, 0.1)


@pytest.mark.parametrize("labels", [discs(), discs(hole=0.15), two_parts()])
def test_without_error_the_map_is_the_labels(labels):
    arplace = model(labels, representation="signed-distance", energy=1.0)
    for distance, reached in zip(TASK.distance.values[:2], labels[:2], strict=True):
        found = query(arplace, ObjectPose(distance=distance, height=0.5))
        np.testing.assert_array_equal(found.map.probability, reached)
        assert (found.success, found.outside) == (1.0, 0.0)


def test_the_map_of_landmarks_without_error_is_the_polygon(arplace):
    found = query(arplace, MIDDLE)
    inside = arplace.predicted(np.array([[0.1, 0.5, 0.0]]))[0]
    np.testing.assert_array_equal(found.map.probability, inside)


def test_an_object_along_the_edge_moves_the_map(arplace):
    here = query(arplace, MIDDLE).map.probability
    there = query(arplace, ObjectPose(distance=0.1, height=0.5, y=0.2)).map.probability
    np.testing.assert_array_equal(there[:, 2:], here[:, :-2])
    assert not there[:, :2].any()


def test_a_larger_error_is_never_sharper(arplace):
    std = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
    found = [query(arplace, MIDDLE, covariance_of((s, s, 0.0, 0.0))) for s in std]
    # 4 sigma of 1000 samples is 0.06.
    spread = [float((q.map.probability * (1.0 - q.map.probability)).sum()) for q in found]
    assert spread[0] == 0.0
    assert spread[:4] == sorted(spread[:4])
    most = [q.map.probability.max() for q in found]
    assert all(later <= earlier + 0.06 for earlier, later in itertools.pairwise(most))
    assert most[-1] < 0.7


def test_probability_agrees_with_a_closed_form(arplace):
    """With an error along y only, a disc holds a base position while |y| is below a half width."""
    from scipy.stats import norm

    std = 0.2
    found = query(arplace, MIDDLE, covariance_of((0.0, std, 0.0, 0.0)), samples=4000)
    i = int(np.argmin(np.abs(found.map.x + 0.5)))
    j = int(np.argmin(np.abs(found.map.y)))
    fine = np.linspace(-0.6, 0.6, 1201)
    inside = arplace.predicted(np.array([[0.1, 0.5, 0.0]]), at=(found.map.x[i : i + 1], fine))[0, 0]
    half = 0.5 * 0.001 * np.count_nonzero(inside)
    exact = 2.0 * norm.cdf(half / std) - 1.0
    # 4 sigma of the samples, and a millimetre of the width.
    assert found.map.probability[i, j] == pytest.approx(exact, abs=0.03)


def test_the_success_has_samples_of_its_own(arplace):
    found = query(arplace, MIDDLE, covariance_of((0.15, 0.15, 0.0, 0.0)))
    low, high = found.interval
    assert low <= found.success <= high
    assert found.success == pytest.approx(found.map.probability.max(), abs=0.06)


def test_samples_outside_the_learned_range_are_failures():
    arplace = model(np.repeat(discs()[1:2], 3, axis=0))
    edge = ObjectPose(distance=0.0, height=0.5)
    found = query(arplace, edge, covariance_of((0.01, 0.0, 0.0, 0.0)))
    # Half of the samples lie before the edge of the table; 4 sigma of 1000 samples.
    assert found.outside == pytest.approx(0.5, abs=0.06)
    assert found.map.probability.max() == pytest.approx(1.0 - found.outside)


def test_correlated_errors_are_used(arplace):
    covariance = covariance_of(planar=(0.01, 0.0099, 0.01))
    one = query(arplace, MIDDLE, covariance).map.probability
    other = query(arplace, MIDDLE, covariance_of(planar=(0.01, -0.0099, 0.01))).map.probability
    # The mirrored covariance mirrors the map; 4 sigma of two maps.
    np.testing.assert_allclose(one, other[:, ::-1], atol=0.1)
    assert np.abs(one - other).max() > 0.1


def test_the_seed_decides_the_samples(arplace):
    covariance = covariance_of((0.1, 0.1, 0.0, 0.0))
    maps = [query(arplace, MIDDLE, covariance, seed=seed).map.probability for seed in (0, 0, 1)]
    np.testing.assert_array_equal(maps[0], maps[1])
    assert np.any(maps[0] != maps[2])


def test_ties_are_decided_by_depth():
    values = np.zeros((9, 9))
    values[1:8, 2:7] = 1.0
    # The middle rows are equally deep.
    assert probability_map(values).best() == (3, 4)
    pierced = values.copy()
    pierced[4, 4] = 0.0
    assert probability_map(pierced).best() not in ((3, 4), (4, 4), (5, 4))


def test_obstacles_are_subtracted(arplace):
    free = query(arplace, MIDDLE)
    obstacle = FloorObstacle(free.x, free.y, 0.2, 0.4, 0.3)
    found = query(arplace, MIDDLE, obstacles=[obstacle], clearance=0.1)
    x, y = np.meshgrid(found.map.x, found.map.y, indexing="ij")
    assert (found.x, found.y) != (free.x, free.y)
    assert np.all(found.map.probability <= free.map.probability)
    changed = found.map.probability < free.map.probability
    assert np.hypot(x - free.x, y - free.y)[changed].max() < 0.1 + np.hypot(0.1, 0.2) + 1e-9
    wide = [FloorObstacle(0.0, 0.0, 4.0, 4.0)]
    with pytest.raises(SelectionError, match="from no base position"):
        query(arplace, MIDDLE, obstacles=wide)


def test_the_distance_from_an_obstacle():
    found = FloorObstacle(1.0, 0.0, 2.0, 1.0, np.pi / 2).distance(
        np.array([1.0, 2.0]), np.array([0.0, 2.0])
    )
    np.testing.assert_allclose(found, [[0.0, 1.0], [0.5, np.hypot(0.5, 1.0)]], atol=1e-12)


def test_products_are_at_most_each_factor_and_maxima_at_least():
    rng = np.random.default_rng(0)
    maps = [probability_map(rng.uniform(size=(4, 5))) for _ in range(3)]
    product, most = merge_maps(maps, "product"), merge_maps(maps, "max")
    for one in maps:
        assert np.all(product.probability <= one.probability)
        assert np.all(most.probability >= one.probability)
    np.testing.assert_allclose(
        product.probability, maps[0].probability * maps[1].probability * maps[2].probability
    )


def test_merging_one_map_changes_nothing():
    one = probability_map([[0.5, 0.25]])
    for rule in ("max", "product"):
        np.testing.assert_array_equal(merge_maps([one], rule).probability, one.probability)


def test_maps_that_do_not_fit_are_refused():
    one, other = probability_map(np.ones((2, 2))), probability_map(np.ones((2, 3)))
    with pytest.raises(SelectionError, match="different base positions"):
        merge_maps([one, other], "max")
    with pytest.raises(UnknownNameError, match="unknown rule 'mean'"):
        merge_maps([one], "mean")
    with pytest.raises(SelectionError, match="no map to merge"):
        merge_maps([], "max")
    with pytest.raises(SelectionError, match="not in 0 to 1"):
        probability_map([[1.5]])


@pytest.mark.parametrize(
    ("pose", "covariance", "words"),
    [
        (ObjectPose(distance=0.5, height=0.5), None, "distance 0.5 is outside the learned range"),
        (ObjectPose(distance=np.nan, height=0.5), None, "distance nan is outside"),
        (MIDDLE, covariance_of((0.0, 0.0, 0.1, 0.0)), "error of z must be 0"),
        (MIDDLE, np.diag([1.0, -1.0, 0.0, 0.0]), "positive semidefinite"),
        (MIDDLE, np.full((4, 4), np.nan), "4 x 4 finite numbers"),
        (ObjectPose(distance=0.1, height=0.5, y=1e9), None, "position along the edge"),
    ],
)
def test_bad_queries_are_one_line(arplace, pose, covariance, words):
    with pytest.raises(SelectionError, match=words) as caught:
        query(arplace, pose, covariance)
    assert "\n" not in str(caught.value)


def test_bad_numbers_of_samples_are_refused(arplace):
    with pytest.raises(TcsError, match="samples is 0"):
        query(arplace, samples=0)
    with pytest.raises(SelectionError, match="standard deviation of x"):
        covariance_of((-0.1, 0.0, 0.0, 0.0))
    with pytest.raises(SelectionError, match="variance above"):
        checked_covariance(np.diag([1e6, 0.0, 0.0, 0.0]))


def test_wilson_interval_is_within_0_and_1():
    assert wilson_interval(0, 10)[0] == pytest.approx(0.0, abs=1e-15)
    assert wilson_interval(10, 10)[1] == pytest.approx(1.0, abs=1e-15)
    assert 0.0 <= wilson_interval(0, 7)[0] <= wilson_interval(7, 7)[1] <= 1.0
