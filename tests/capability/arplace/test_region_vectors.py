"""Boundaries, landmarks, the point distribution model and the generalised success model."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tcs.capability.arplace import Classifier, PointDistribution, reconstruction_errors
from tcs.capability.arplace.boundary import region_of
from tcs.capability.arplace.landmarks import (
    COUNT,
    equidistant_landmarks,
    key_points,
    landmarks_by_shape,
)
from tcs.capability.arplace.polygons import distances, inside, signed_area, winding_numbers
from tcs.capability.arplace.region_vectors import BY_SHAPE, EQUIDISTANT, SIGNED_DISTANCE
from tcs.capability.arplace.success_model import SuccessModel, interpolation_features
from tcs.errors import SelectionError, TcsError, UnknownNameError
from tests.capability.arplace.example import TASK, discs, model, two_parts

X, Y = TASK.base_x.values, TASK.base_y.values
LANDMARKS = (BY_SHAPE, EQUIDISTANT)


def ring(radius, centre=(0.0, 0.0), corners=200):
    angle = 2.0 * np.pi * np.arange(corners) / corners
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius + centre


def bean():
    """Two lobes towards +x with a dent between them."""
    angle = 2.0 * np.pi * np.arange(400) / 400
    radius = 1.0 - 0.4 * np.exp(-((np.angle(np.exp(1j * angle)) / 0.4) ** 2))
    return np.column_stack([0.6 * np.cos(angle), np.sin(angle)]) * radius[:, None]


def test_winding_numbers_agree_with_angles():
    rng = np.random.default_rng(0)
    polygons = rng.uniform(-1.0, 1.0, (20, 7, 2))
    x, y = np.linspace(-0.9, 0.7, 9), np.linspace(-0.8, 1.3, 12)
    found = winding_numbers(polygons, x, y)
    for polygon, counts in zip(polygons, found, strict=True):
        offset = polygon - np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)[:, :, None]
        angle = np.arctan2(offset[..., 1], offset[..., 0])
        swept = np.angle(np.exp(1j * (np.roll(angle, -1, axis=-1) - angle))).sum(axis=-1)
        np.testing.assert_array_equal(counts, np.rint(swept / (2.0 * np.pi)))


def test_a_hole_is_not_inside():
    x = np.array([0.0, 0.3, 0.7, 1.2])
    around = (ring(1.0), ring(0.5)[::-1])
    assert inside(around, np.linspace(0.0, 1.2, 4), np.array([0.0]))[:, 0].tolist() == [
        *(False, False, True, False)
    ]
    points = np.column_stack([x, np.zeros(4)])
    # The polygon's edges are inside the circle by 1 - cos(pi / 200).
    np.testing.assert_allclose(distances(around, points), [0.5, 0.2, 0.2, 0.2], atol=2e-4)


@pytest.mark.parametrize("labels", [discs(), discs(hole=0.15), two_parts()])
def test_boundary_divides_the_labels(labels):
    for reached in labels:
        region = region_of(X, Y, reached, Classifier())
        np.testing.assert_array_equal(region.signed_distance > 0.0, reached)
        np.testing.assert_array_equal(inside(region.boundary, X, Y), reached)


def test_parts_and_holes_are_counted():
    def counts(labels):
        regions = [region_of(X, Y, reached, Classifier()) for reached in labels]
        return [(region.components, region.holes) for region in regions]

    assert counts(discs()) == [(1, 0)] * 3
    assert counts(discs(hole=0.15)) == [(1, 1)] * 3
    assert counts(two_parts()) == [(2, 0), (1, 0), (0, 0)]


def test_outer_boundaries_are_anticlockwise_and_holes_clockwise():
    areas = sorted(map(signed_area, region_of(X, Y, discs(hole=0.15)[0], Classifier()).boundary))
    assert areas[0] < 0.0 < areas[1]


def test_key_points_of_a_bean():
    path, keys = key_points(bean())
    low, lower, dent, upper, high, back = path[keys]
    assert low[1] == path[:, 1].min()
    assert high[1] == path[:, 1].max()
    assert back[0] == path[:, 0].min()
    assert abs(dent[1]) < 0.02
    assert lower[0] > dent[0] < upper[0]
    assert lower[1] < dent[1] < upper[1]
    assert np.all(np.diff(keys) > 0)


@pytest.mark.parametrize("rule", [landmarks_by_shape, equidistant_landmarks])
def test_landmarks_lie_on_the_boundary_in_order(rule):
    polygons = [bean(), ring(0.5, (0.2, 0.1))]
    found = rule(polygons)
    assert found.shape == (2, COUNT, 2)
    for polygon, landmarks in zip(polygons, found, strict=True):
        assert distances([polygon], landmarks).max() < 1e-12
        # The same orientation, and nearly the same area.
        assert signed_area(landmarks) == pytest.approx(signed_area(polygon), rel=0.1)


def test_equidistant_landmarks_of_a_circle_are_regular():
    (found,) = equidistant_landmarks([ring(1.0)])
    gaps = np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1)
    np.testing.assert_allclose(gaps, gaps[0], rtol=1e-9)


def test_landmarks_follow_a_translation():
    moved = [0.3, -0.2]
    for rule in (landmarks_by_shape, equidistant_landmarks):
        here, there = rule([bean(), bean() + moved])
        np.testing.assert_allclose(there, here + moved, atol=1e-12)


def test_mean_and_all_modes_give_the_shapes():
    shapes = np.random.default_rng(0).normal(size=(6, 40))
    model = PointDistribution.of(shapes)
    np.testing.assert_allclose(model.shapes(model.deformation(shapes)), shapes, atol=1e-12)
    np.testing.assert_allclose(model.modes.T @ model.modes, np.eye(5), atol=1e-12)
    covariance = np.cov(shapes.T)
    np.testing.assert_allclose(covariance @ model.modes, model.modes * model.variance, atol=1e-12)
    assert model.energy.sum() == pytest.approx(1.0)
    assert model.modes_for(1.0) == 5
    assert model.modes_for(float(model.energy[:2].sum())) == 2


def test_shapes_without_variance_have_a_model():
    model = PointDistribution.of(np.ones((3, 4)))
    assert model.energy.sum() == 0.0
    assert model.modes_for(0.99) == 1


@pytest.mark.parametrize("rule", ["linear", "quadratic"])
def test_polynomials_are_reproduced(rule):
    rng = np.random.default_rng(0)
    grid = np.meshgrid(np.linspace(0, 1, 4), np.linspace(2, 3, 3), indexing="ij")
    parameters = np.stack(grid, axis=-1).reshape(-1, 2)

    def shapes(at):
        a, b = at.T[:, :, None]
        terms = [np.ones_like(a), a, b] + ([a * b, a**2, b**2] if rule == "quadratic" else [])
        return np.hstack(terms) @ factors

    factors = rng.normal(size=(6 if rule == "quadratic" else 3, 8))
    found = SuccessModel.of(shapes(parameters), parameters, rule=rule, energy=1.0)
    new = rng.uniform([0, 2], [1, 3], (10, 2))
    np.testing.assert_allclose(found.shapes(new), shapes(new), atol=1e-12)


def test_interpolation_passes_through_the_shapes():
    grid = np.meshgrid([0.0, 0.5, 1.0], [2.0, 3.0], indexing="ij")
    parameters = np.stack(grid, axis=-1).reshape(-1, 2)
    shapes = np.random.default_rng(0).normal(size=(6, 8))
    found = SuccessModel.of(shapes, parameters, rule="interpolated", energy=1.0)
    np.testing.assert_allclose(found.shapes(parameters), shapes, atol=1e-12)
    middle = found.shapes(np.array([[0.25, 2.5]]))[0]
    np.testing.assert_allclose(middle, shapes[[0, 1, 2, 3]].mean(axis=0), atol=1e-12)
    weights = interpolation_features(np.array([[-1.0, 9.0]]), found.values)
    assert weights.tolist() == [[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]]


@pytest.mark.parametrize("representation", LANDMARKS)
@pytest.mark.parametrize("rule", ["linear", "quadratic"])
def test_a_moving_disc_is_reconstructed(representation, rule):
    arplace = model(representation=representation, rule=rule)
    errors = reconstruction_errors(arplace)
    # The corners of twenty landmarks cut off some cells next to the boundary.
    assert errors.false_inclusions == 0
    assert errors.false_exclusions <= 0.1 * errors.reached


@pytest.mark.parametrize("labels", [discs(), discs(hole=0.15), two_parts()])
def test_signed_distances_reproduce_every_label(labels):
    arplace = model(labels, representation=SIGNED_DISTANCE, energy=1.0)
    np.testing.assert_array_equal(arplace.predicted(TASK.parameters), labels)


def test_regions_with_several_boundaries_use_signed_distances():
    assert model().representation == BY_SHAPE
    for labels in (discs(hole=0.15), two_parts()):
        arplace = model(labels)
        assert (arplace.representation, arplace.rule) == (SIGNED_DISTANCE, "interpolated")
        assert arplace.used.all()


def test_landmarks_leave_out_other_regions():
    labels = discs()
    labels[1] = two_parts()[0]
    arplace = model(labels, representation=EQUIDISTANT)
    assert arplace.used.tolist() == [True, False, True]
    with pytest.raises(SelectionError, match="two or more regions with a single boundary; 1 of 3"):
        model(two_parts(), representation=BY_SHAPE)


def test_interpolation_needs_every_grasp():
    parameters = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(SelectionError, match="cannot be interpolated"):
        SuccessModel.of(np.eye(3), parameters, rule="interpolated")


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"representation": "splines"}, UnknownNameError, "unknown representation 'splines'"),
        ({"rule": "cubic"}, UnknownNameError, "unknown success model 'cubic'"),
        ({"energy": 0.0}, TcsError, "energy is 0; must be greater than 0"),
    ],
)
def test_bad_options_are_one_line(options, error, words):
    with pytest.raises(error, match=words) as caught:
        model(**options)
    assert "\n" not in str(caught.value)


def test_labels_without_success_are_refused():
    with pytest.raises(SelectionError, match="no base position reaches any grasp"):
        model(np.zeros_like(discs()))


def test_a_missing_library_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.svm", None)
    with pytest.raises(TcsError, match=r"pip install 'tcs\[arplace\]'"):
        model()


@pytest.mark.parametrize("values", [{"scale": 0.0}, {"scale": np.nan}, {"box": 0.0}])
def test_bad_classifiers_are_refused(values):
    with pytest.raises(TcsError):
        Classifier(**values)
