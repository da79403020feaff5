"""Are two shapes closer than a gap? Against the reference, bounded least squares, and Drake."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from pydrake.geometry import (
    Box,
    Capsule,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from scipy.optimize import lsq_linear

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.kernel.collide import closer, move, pack, sphere_is_near, spheres_overlap
from tests.kernel.shapes import (
    SHAPE_TYPES,
    about,
    as_shapes,
    placed,
    random_size,
    right_angles,
    rotation,
)
from tests.reference.kinematics import distance

PAIRS = list(itertools.combinations_with_replacement(SHAPE_TYPES, 2))
FAR = 20.0


def row(shape):
    return pack(as_shapes([shape]))[0]


def gap_between(a, b):
    """Return the gap at which the kernel's result changes: its distance, 0 where cores overlap."""
    low, high = 0.0, FAR
    A, B = row(a), row(b)
    for _ in range(64):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if closer(A, 0, B, 0, middle) else (middle, high)
    return high


def least_squares_distance(a, b):
    """Return the distance by bounded least squares over points of both cores."""
    matrix = np.hstack([a.R * a.half, -b.R * b.half])
    with np.errstate(all="ignore"):
        # Tolerances below what doubles can show: the active-set method stops when it is exact.
        found = lsq_linear(matrix, b.p - a.p, (-1.0, 1.0), method="bvls", tol=1e-15)
    return float(np.linalg.norm(matrix @ found.x - (b.p - a.p))) - a.radius - b.radius


def drake_distance(a, b):
    graph = SceneGraph()
    source = graph.RegisterSource("pair")
    poses, ids = FramePoseVector(), []
    for name, shape in (("a", a), ("b", b)):
        frame = graph.RegisterFrame(source, GeometryFrame(name))
        if shape.type == SPHERE:
            solid = Sphere(shape.size[0])
        elif shape.type == CAPSULE:
            solid = Capsule(shape.size[0], 2 * shape.size[1])
        else:
            solid = Box(*(2 * shape.size))
        instance = GeometryInstance(RigidTransform(), solid, name)
        ids.append(graph.RegisterGeometry(source, frame, instance))
        graph.AssignRole(source, ids[-1], ProximityProperties())
        R = RotationMatrix.ProjectToRotationMatrix(shape.R)
        poses.set_value(frame, RigidTransform(R, shape.p))
    context = graph.CreateDefaultContext()
    graph.get_source_pose_port(source).FixValue(context, poses)
    query = graph.get_query_output_port().Eval(context)
    return query.ComputeSignedDistancePairClosestPoints(*ids).distance


def near_pair(rng, first, second):
    """Return two shapes from overlapping to 5 cm apart, often with parallel edges and faces."""
    a = placed(
        SHAPE_TYPES[first], random_size(rng, SHAPE_TYPES[first]), rotation(rng), rng.normal(size=3)
    )
    R = [
        rotation(rng),
        a.R,
        a.R @ right_angles(rng),
        a.R @ right_angles(rng) @ about(rng.normal(size=3), 10 ** rng.uniform(-9, -2)),
        a.R @ about(np.eye(3)[rng.integers(3)], rng.uniform(-3, 3)),
    ][rng.integers(5)]
    b = placed(SHAPE_TYPES[second], random_size(rng, SHAPE_TYPES[second]), R)
    way = a.R[:, rng.integers(3)] if rng.random() < 0.4 else rng.normal(size=3)
    way /= np.linalg.norm(way)
    aside = rng.choice([0.0, 0.3]) * rng.normal(size=3)
    aside -= way * (aside @ way)

    def at(t):
        return dataclasses.replace(b, p=a.p + aside + t * way)

    if rng.random() < 0.1:
        return a, at(rng.uniform(0.0, 0.1))
    low, high, target = 0.0, 6.0, 10 ** rng.uniform(-4.0, -1.3)
    A = row(a)
    for _ in range(30):
        middle = 0.5 * (low + high)
        if closer(A, 0, row(at(middle)), 0, target):
            low = middle
        else:
            high = middle
    return a, at(high)


def tolerance(a, b):
    """Return the greatest error of the kernel's distance [m].

    All is exact up to rounding, but for two capsules less than 1e-6 rad from parallel: the kernel
    takes them as parallel, which moves a closest point by up to 1e-6 of a length.
    """
    return 2e-6 if a.type == b.type == CAPSULE else 1e-9


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_the_kernel_agrees_with_the_reference(first, second, rng):
    for _ in range(60):
        a, b = near_pair(rng, first, second)
        exact = max(distance(a, b), 0.0)
        assert gap_between(a, b) == pytest.approx(exact, abs=tolerance(a, b))


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_the_reference_agrees_with_bounded_least_squares(first, second, rng):
    for _ in range(40):
        a, b = near_pair(rng, first, second)
        # Normal equations of the active set lose half the digits where faces are parallel.
        assert distance(a, b) == pytest.approx(least_squares_distance(a, b), abs=1e-8)


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_every_contact_of_drake_is_a_contact_of_the_kernel(first, second, rng):
    # Drake is exact for a sphere with anything. For the rest it iterates, and stops too far out:
    # measured by up to 3e-4 m for capsules, 1e-3 m for a capsule and a box, centimetres for some
    # boxes with parallel edges (then least squares is on the kernel's side, see above). So its
    # verdict may be milder than the kernel's, never stricter, beyond 1e-6 m.
    close = 0
    for _ in range(150):
        a, b = near_pair(rng, first, second)
        ours, drakes = gap_between(a, b), max(drake_distance(a, b), 0.0)
        assert drakes > ours - 1e-6
        close += drakes < ours + 1e-5
        if "sphere" in (first, second):
            assert drakes == pytest.approx(ours, abs=1e-9)
        for gap in (1e-3, 5e-3, 0.02, 0.05):
            if drakes < gap - 1e-6:
                assert closer(row(a), 0, row(b), 0, gap)
    # Were the shapes packed wrongly, hardly any distance would agree.
    assert close > 100


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_order_and_common_motion_do_not_matter(first, second, rng):
    for _ in range(40):
        a, b = near_pair(rng, first, second)
        ours = gap_between(a, b)
        assert gap_between(b, a) == pytest.approx(ours, abs=tolerance(a, b))
        X = rotation(rng), rng.normal(size=3)
        assert gap_between(a.moved(X), b.moved(X)) == pytest.approx(ours, abs=tolerance(a, b))


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_bounding_spheres_contain_their_shapes(first, second, rng):
    # The bounding spheres must never rule out a pair that is in contact.
    for _ in range(100):
        a, b = near_pair(rng, first, second)
        A, B = row(a), row(b)
        for gap in (1e-3, 0.05, gap_between(a, b) + 1e-9):
            if closer(A, 0, B, 0, gap):
                assert spheres_overlap(A, 0, B, 0, gap)
                assert sphere_is_near(A, 0, B, 0, gap)
                assert sphere_is_near(B, 0, A, 0, gap)


@pytest.mark.parametrize("second", SHAPE_TYPES)
def test_a_sphere_is_near_a_shape_where_it_is_closer(second, rng):
    apart = 0
    for _ in range(100):
        a, b = near_pair(rng, "sphere", second)
        exact = distance(a, b)
        assert sphere_is_near(row(a), 0, row(b), 0, max(exact, 1e-9))
        if exact > 1e-6:
            apart += 1
            assert not sphere_is_near(row(a), 0, row(b), 0, exact - 1e-8)
    assert apart > 20


@pytest.mark.parametrize("first", SHAPE_TYPES)
@pytest.mark.parametrize("second", SHAPE_TYPES)
def test_one_inside_the_other_touches(first, second, rng):
    for _ in range(50):
        a = placed(SHAPE_TYPES[first], [0.5, 0.5, 0.5], rotation(rng), rng.normal(size=3))
        b = placed(
            SHAPE_TYPES[second], [0.02, 0.01, 0.01], rotation(rng), a.p + rng.uniform(-0.2, 0.2, 3)
        )
        assert closer(row(a), 0, row(b), 0, 1e-3)
        assert closer(row(b), 0, row(a), 0, 1e-9)


@pytest.mark.parametrize(
    ("a", "b", "exact"),
    [
        pytest.param(
            placed(BOX, [1, 1, 1]), placed(BOX, [1, 1, 1], p=[2.5, 0, 0]), 0.5, id="faces"
        ),
        pytest.param(
            placed(BOX, [1, 1, 1]),
            placed(BOX, [1, 1, 1], about(np.eye(3)[2], np.pi / 4), [1.5 + np.sqrt(2), 0, 0]),
            0.5,
            id="edge-face",
        ),
        pytest.param(
            placed(BOX, [1, 1, 1]), placed(BOX, [1, 1, 1], p=[3, 3, 3]), np.sqrt(3), id="corners"
        ),
        pytest.param(
            placed(BOX, [1, 1, 1]), placed(BOX, [1, 1, 1], p=[3, 3, 0]), np.sqrt(2), id="edges"
        ),
        pytest.param(
            placed(BOX, [1, 1, 0.0]), placed(BOX, [1, 0.0, 0.0], p=[0, 0, 0.1]), 0.1, id="plate"
        ),
        pytest.param(
            placed(CAPSULE, [0.1, 1, 0]),
            placed(CAPSULE, [0.1, 1, 0], about(np.array([1.0, 0, 0]), np.pi / 2), [0.5, 0, 0]),
            0.3,
            id="crossed capsules",
        ),
        pytest.param(
            placed(CAPSULE, [0.1, 1, 0]), placed(CAPSULE, [0.1, 1, 0], p=[0.5, 0, 1.5]), 0.3,
            id="parallel capsules",
        ),
        pytest.param(
            placed(CAPSULE, [0.1, 1, 0]), placed(CAPSULE, [0.1, 1, 0], p=[0, 0, 3]), 0.8,
            id="capsules in line",
        ),
        pytest.param(
            placed(CAPSULE, [0.1, 1, 0], about(np.array([0, 1.0, 0]), np.pi / 2)),
            placed(BOX, [5, 5, 1], p=[0, 0, -2]), 0.9, id="capsule along a face",
        ),
        pytest.param(placed(SPHERE, [0.5, 0, 0]), placed(BOX, [1, 1, 1], p=[2, 2, 2]),
                     np.sqrt(3) - 0.5, id="sphere and corner"),
        pytest.param(placed(CAPSULE, [0.1, 0.0, 0]), placed(SPHERE, [0.2, 0, 0], p=[0, 1, 0]), 0.7,
                     id="capsule of no length"),
    ],
)  # fmt: skip
def test_distances_computed_by_hand(a, b, exact):
    # Rounding of numbers of the order of 1.
    assert gap_between(a, b) == pytest.approx(exact, abs=1e-14)
    assert distance(a, b) == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("power", range(-9, -3))
def test_boxes_with_nearly_parallel_edges(power, rng):
    # The cross product of nearly parallel edges is the worst of the 15 axes.
    for _ in range(40):
        a = placed(BOX, rng.uniform(0.01, 1, 3), rotation(rng))
        R = a.R @ right_angles(rng) @ about(rng.normal(size=3), 10.0**power)
        way = a.R @ (rng.choice([-1.0, 1.0], 3) * rng.uniform(0.2, 1, 3))
        b = placed(BOX, rng.uniform(0.01, 1, 3), R, way * rng.uniform(1, 3))
        exact = max(distance(a, b), 0.0)
        # A sine of 1e-6 from a cosine is good to 1e-4 of itself, and so is the axis' distance.
        assert gap_between(a, b) == pytest.approx(exact, abs=1e-9 + 2e-4 * min(exact, 0.1))


def test_move_composes_poses(rng):
    shapes = [placed(BOX, [1, 2, 3], rotation(rng), rng.normal(size=3)) for _ in range(3)]
    rows = pack(as_shapes(shapes))[0]
    R, p = rotation(rng), rng.normal(size=3)
    out = np.full_like(rows, np.nan)
    for i in range(3):
        move(R, p, rows, i, out, 2 - i)
    expected = pack(as_shapes([shape.moved((R, p)) for shape in shapes[::-1]]))[0]
    # One product of rotations.
    np.testing.assert_allclose(out, expected, atol=1e-14)
