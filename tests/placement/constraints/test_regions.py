import tracemalloc

import numpy as np
import pytest
from scipy.optimize import linprog

from tcs.errors import SelectionError
from tcs.placement.constraints import Obstacle, Region
from tcs.placement.constraints.contact import segment_distance
from tcs.placement.constraints.regions import MAX_VERTICES, RADIUS, Footprint

RECTANGLE = Footprint((-0.2, -0.3), (0.4, 0.3), 0.0)


def is_common(base, triangle):
    """Whether the rectangle at a base pose and a triangle have a point in common."""
    x, y, yaw = base
    R = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    low, high = np.array(RECTANGLE.low), np.array(RECTANGLE.high)
    # R^T (p - base) within the rectangle; p on the inner side of each edge.
    A, b = [*R.T, *-R.T], [*(high + R.T @ (x, y)), *(-low - R.T @ (x, y))]
    for i in range(3):
        p, q, r = (triangle[(i + k) % 3] for k in range(3))
        normal = np.array([q[1] - p[1], p[0] - q[0]])
        normal *= 1.0 if normal @ (r - p) <= 0.0 else -1.0
        A.append(normal)
        b.append(normal @ p)
    return linprog(np.zeros(2), A_ub=np.array(A), b_ub=np.array(b), bounds=(None, None)).status == 0


def test_a_base_stands_on_a_region_if_they_have_a_point_in_common():
    rng = np.random.default_rng(3)
    base = np.column_stack([rng.uniform(-1, 1, (40, 2)), rng.uniform(-4, 4, 40)])
    found = []
    for triangle in rng.uniform(-1.5, 1.5, (6, 3, 2)):
        stands = RECTANGLE.overlaps(Region(tuple(map(tuple, triangle))), base)
        assert stands.tolist() == [is_common(pose, triangle) for pose in base]
        found += stands.tolist()
    assert 0.1 < np.mean(found) < 0.9


@pytest.mark.parametrize(
    ("polygon", "expected"),
    [
        ("-9 -9, 9 -9, 9 9, -9 9", True),
        ("0.1 0.1, 0.12 0.1, 0.11 0.12", True),
        ("0.4 -1, 2 -1, 2 1, 0.4 1", True),
        ("0.401 -1, 2 -1, 2 1, 0.401 1", False),
        # A ring around the robot, open at one side.
        ("-2 -2, 2 -2, 2 2, -2 2, -2 1, 1 1, 1 -1, -2 -1", False),
        # A region that crosses itself forbids both of its parts.
        ("-3 -1, 1 -1, 1 1, -1 1, -1 -2, 2 -2, 2 2, -3 2", True),
    ],
    ids=["around", "within", "touching", "beside", "ring", "crossing"],
)
def test_regions_of_other_forms(polygon, expected):
    assert RECTANGLE.overlaps(Region.parse(polygon), np.zeros((1, 3))).tolist() == [expected]


@pytest.mark.parametrize("footprint", [RECTANGLE, Footprint.of(None)], ids=["box", "circle"])
def test_the_answer_is_that_of_the_distance_from_each_edge(footprint):
    rng = np.random.default_rng(5)
    base = np.column_stack([rng.uniform(-2, 2, (60, 2)), rng.uniform(-4, 4, 60)])
    low, high = np.array(footprint.low), np.array(footprint.high)
    found = []
    for polygon in rng.uniform(-1, 1, (8, 5, 2)):
        stands = footprint.overlaps(Region(tuple(map(tuple, polygon))), base)
        for (x, y, yaw), answer in zip(base, stands, strict=True):
            R = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
            ends = np.pad((polygon - (x, y)) @ R.T - (low + high) / 2, ((0, 0), (0, 1)))
            distance = segment_distance(
                np.append((high - low) / 2, 1.0), ends, np.roll(ends, -1, axis=0)
            )
            # A footprint that no edge meets is on the region or beside it as a whole.
            winding = np.unwrap(np.arctan2(*np.vstack([ends, ends[:1]])[:, 1::-1].T))
            inside = round((winding[-1] - winding[0]) / (2 * np.pi)) != 0
            assert answer == (distance.min() <= footprint.radius or inside)
            found.append(answer)
    assert 0.05 < np.mean(found) < 0.9


def test_the_memory_of_a_region_does_not_depend_on_the_base_poses():
    angle = np.linspace(0.0, 2.0 * np.pi, MAX_VERTICES, endpoint=False)
    # Its edges cross the whole floor, so that no bounding box rejects them.
    star = Region(tuple(zip(3 * np.cos(499 * angle), 3 * np.sin(499 * angle), strict=True)))
    peaks = []
    for count in (200, 800):
        base = np.random.default_rng(1).uniform(-3, 3, (count, 3))
        tracemalloc.start()
        RECTANGLE.overlaps(star, base)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0] < 30e6


def test_base_poses_far_from_a_region_are_not_compared_with_its_edges(monkeypatch):
    monkeypatch.setattr(Footprint, "_touches", None)
    far = np.random.default_rng(1).uniform(5, 9, (100, 3))
    assert not RECTANGLE.overlaps(Region.parse("0 0, 1 0, 1 1"), far).any()


def test_a_circle_keeps_its_radius():
    base = np.array([[RADIUS - 1e-6, 0.0, 0.0], [RADIUS + 1e-6, 0.0, 0.0]])
    region = Region.parse("0 -1, 0 1, -1 0")
    assert Footprint.of(None).overlaps(region, base).tolist() == [True, False]


def test_a_region_is_read_from_a_file(tmp_path):
    path = tmp_path / "door.yaml"
    path.write_text("polygon: [[0, 0], [1, 0], [1, 1.5]]")
    assert Region.read(path) == Region.parse("0 0, 1 0, 1 1.5")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("polygon: 5", "must have the one key 'polygon'"),
        ("corners: [[0, 0]]", "must have the one key 'polygon'"),
        ("polygon: [[0, 0], [1], [1, 1]]", "must be .x, y."),
        ("polygon: [[0, 0], [1, yes], [1, 1]]", "must be .x, y."),
        ("polygon: [[0, 0], [1, 1]]", "has 2 different vertices; must have 3 to 1000"),
        (f"polygon: [[{10**400}, 0], [1, 0], [1, 1]]", "must be two numbers"),
        ("5", "must contain keys and values: polygon"),
    ],
)
def test_region_files_that_cannot_be_used(tmp_path, text, message):
    path = tmp_path / "door.yaml"
    path.write_text(text)
    with pytest.raises(SelectionError, match=message):
        Region.read(path)


@pytest.mark.parametrize(
    ("make", "text", "message"),
    [
        (Region.parse, "1 2 3 4 5 6", "must be X1 Y1, X2 Y2"),
        (Region.parse, "0 0, 1 0, north", "must be X1 Y1, X2 Y2"),
        (Region.parse, "0 0, 1 0, 0 0", "has 2 different vertices"),
        (Region.parse, "0 0, 1 0, 1 1e9", "must be -40 to 40 m"),
        (Region.parse, "0 0, 1 0, 1 nan", "must be -40 to 40 m"),
        (Obstacle.parse, "1 1 1", "four to seven numbers"),
        (Obstacle.parse, "1 1, 2 2, 3 1; 0.5", "there must be Z_LOW Z_HIGH"),
        (Obstacle.parse, "1 1, 2 2, 3", "must be X1 Y1, X2 Y2"),
        (Obstacle.parse, "1 1 1 chair", "four to seven numbers"),
        (Obstacle.parse, "1 1 -1 1", "a size must be"),
        (Obstacle.parse, "1 1 1 1 0 1 0.5", "must be above z_low, 1 m"),
        (Obstacle.parse, "1 1 1 1 9999", "an angle must be"),
    ],
)
def test_texts_that_cannot_be_used(make, text, message):
    with pytest.raises(SelectionError, match=message):
        make(text)


def test_a_polygon_is_enclosed_by_a_box():
    rng = np.random.default_rng(7)
    for _ in range(20):
        region = Region(tuple(map(tuple, rng.uniform(-2, 2, (5, 2)))))
        box = Obstacle.around(region, 0.2, 0.9)
        offset = np.array(region.vertices) - (box.x, box.y)
        cos, sin = np.cos(box.yaw), np.sin(box.yaw)
        along = np.abs(offset @ np.array([[cos, -sin], [sin, cos]]))
        assert np.all(along <= box.half[:2] + 1e-12)
        np.testing.assert_allclose(along.max(axis=0), box.half[:2])
    # A rectangle is its own box, whatever its heading.
    box = Obstacle.parse("0 0, 0.3 0.3, 0.1 0.5, -0.2 0.2")
    assert (box.width, box.depth) == pytest.approx((0.3 * 2**0.5, 0.2 * 2**0.5))
    assert Obstacle.parse("0 0, 1 0, 2 0").depth == 1e-6


@pytest.mark.parametrize("text", ["1 -0.5 0.4 0.6", "1 2 0.4 0.6 30", "1 2 0.4 0.6 30 0.1 0.9"])
def test_the_name_of_an_obstacle_is_its_text(text):
    assert Obstacle.parse(text).name == text
    assert Obstacle.parse("1 2 0.4 0.6 0.1 0.9").z_high == 0.9
