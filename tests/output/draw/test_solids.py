import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.output.draw import Category, Solid, primitive_corners
from tcs.output.draw.solids import outline

EYE, ORIGIN = np.eye(3), np.zeros(3)


def volume(triangles):
    """Volume inside a closed surface; negative when its triangles face inward."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0


def area(polygon):
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize(
    ("shape", "size", "exact", "rel"),
    [
        # A box is drawn as it is; 16 corners around a circle leave out 2.6 % of its area, and the
        # flat bands of a sphere slightly more.
        pytest.param(BOX, (0.1, 0.2, 0.3), 0.048, 1e-12, id="box"),
        pytest.param(SPHERE, (0.2, 0.0, 0.0), 4 / 3 * np.pi * 0.008, 0.08, id="sphere"),
        pytest.param(CAPSULE, (0.1, 0.4, 0.0), np.pi * (0.008 + 4e-3 / 3), 0.05, id="capsule"),
    ],
)
def test_surface_is_closed_and_faces_outward(shape, size, exact, rel):
    got = volume(
        Solid.placed(Category.PERSON, primitive_corners(shape, size), EYE, ORIGIN).triangles
    )
    assert got == pytest.approx(exact, rel=rel)
    assert got <= exact * (1 + 1e-12)


def test_capsule_reaches_its_caps():
    corners = primitive_corners(CAPSULE, (0.1, 0.4, 0.0))
    np.testing.assert_allclose(corners.max(axis=0), [0.1, 0.1, 0.5], atol=1e-15)
    np.testing.assert_allclose(corners.min(axis=0), [-0.1, -0.1, -0.5], atol=1e-15)


def test_unknown_shape():
    with pytest.raises(TcsError, match="shape 7"):
        primitive_corners(7, (1.0, 1.0, 1.0))


def test_placed_solid_turns_then_moves():
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    corners = primitive_corners(BOX, (0.5, 0.1, 0.1))
    solid = Solid.placed(Category.ROBOT, corners, quarter, [1.0, 2.0, 0.0])
    np.testing.assert_allclose(solid.corners.max(axis=0), [1.1, 2.5, 0.1], atol=1e-15)


def test_footprint_of_a_tilted_box_is_its_shadow():
    c = s = np.sqrt(0.5)
    tilt = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    solid = Solid.placed(Category.FURNITURE, primitive_corners(BOX, (0.5, 0.5, 0.5)), tilt, ORIGIN)
    # A unit cube on its edge casts a shadow sqrt(2) wide.
    assert area(solid.footprint) == pytest.approx(np.sqrt(2.0), rel=1e-12)


def test_outline_is_counter_clockwise_and_convex(rng):
    points = rng.normal(size=(50, 2))
    polygon = outline(points)
    assert area(polygon) > 0.0
    steps = np.roll(polygon, -1, axis=0) - polygon
    after = np.roll(steps, -1, axis=0)
    assert np.all(steps[:, 0] * after[:, 1] - steps[:, 1] * after[:, 0] > 0.0)
