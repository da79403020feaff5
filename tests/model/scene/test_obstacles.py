"""Obstacles of one's own: shapes, meshes and point clouds, enclosed by boxes and capsules."""

import numpy as np
import pytest
import trimesh

from tcs.errors import EnvironmentFileError
from tcs.model.robots.fitting.mesh_shapes import closed_mesh
from tcs.model.robots.primitives import enclosed, union_volume
from tcs.model.scene import environment_shapes, load_environment
from tcs.model.scene.environment.check import check_environment
from tcs.model.scene.environment.environment_file import Obstacle
from tcs.model.scene.environment.obstacle_shapes import obstacle_shapes
from tcs.model.scene.environment.occupied_cells import boxes_of_cells

GRID = """\
grid:
  base_x: {unit: m, start: 0, step: 0.5, count: 3}
  base_y: {unit: m, start: 0, step: 0.5, count: 3}
  base_yaw: {unit: deg, start: 0, step: 90, count: 4}
  torso: {unit: m, start: 0, step: 0.1, count: 1}
"""


def environment(folder, *obstacles, more=""):
    """Return an environment without a person, with obstacles as YAML lines."""
    lines = "".join(f"  - {{{text}}}\n" for text in obstacles)
    file = folder / "own.yaml"
    file.write_text(
        f"name: own\ntitle: own\norigin: anywhere\nsource: made up\n{GRID}obstacles:\n{lines}{more}"
    )
    return load_environment(file)


def inside(shapes, points):
    """Return which points lie in one of the shapes."""
    return np.any([shape.contains(points) for shape in shapes], axis=0)


def test_boxes_of_a_cylinder_enclose_it_closely():
    shapes = obstacle_shapes(Obstacle(name="can", cylinder=(0.1, 0.3)), "can")
    solid = trimesh.creation.cylinder(0.1, 0.3, sections=720)
    points = np.concatenate([solid.vertices, solid.triangles_center])
    assert inside(shapes, points * (1 - 1e-9)).all()
    # 2.3 % by the area of a polygon of twelve sides.
    assert union_volume(shapes) < 1.04 * np.pi * 0.1**2 * 0.3
    assert not inside([shape.shrunk(0.002) for shape in shapes], points).all()


def test_own_shapes_are_where_the_file_puts_them(tmp_path):
    """A box on edge, a ball and a capsule lie where their corners and ends are expected."""
    found = environment_shapes(
        environment(
            tmp_path,
            "name: edge, box: [0.2, 0.2, 0.4], xyz: [1, 0, 0.5], rpy_deg: [0, 0, 45]",
            "name: ball, sphere: 0.1, xyz: [0, 1, 0.3]",
            "name: rod, capsule: [0.02, 0.5], xyz: [0, 0, 1], rpy_deg: [0, 90, 0]",
            more="floor: false\n",
        )
    )
    np.testing.assert_allclose(found.p[0], [[1, 0, 0.5], [0, 1, 0.3], [0, 0, 1]], atol=1e-12)
    corner = found.p[0, 0] + found.R[0, 0] @ found.size[0]
    np.testing.assert_allclose(corner, [1, 0.1 * np.sqrt(2), 0.7], atol=1e-12)
    assert found.size[1, 0] == 0.1
    np.testing.assert_allclose(np.abs(found.R[0, 2][:, 2]), [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize("suffix", ["obj", "stl", "glb"])
def test_shapes_enclose_a_mesh_and_its_inside(tmp_path, suffix):
    solid = trimesh.creation.box([0.3, 0.2, 0.1]).apply_translation([0.2, 0, 0])
    solid.apply_scale(1000.0)
    file = tmp_path / f"tin.{suffix}"
    solid.export(file)
    obstacle = Obstacle(name="tin", file=str(file), scale=0.001, protrusion=0.005)
    shapes = obstacle_shapes(obstacle, "tin")
    assert enclosed(shapes, closed_mesh(file, 0.001, "tin", EnvironmentFileError)).all()
    assert inside(shapes, np.array([[0.2, 0, 0], [0.3, 0.05, -0.04]])).all()
    assert union_volume(shapes) < 1.05 * 0.3 * 0.2 * 0.1
    # The cache gives the same shapes again.
    assert obstacle_shapes(obstacle, "tin") == shapes


def test_a_mesh_that_is_not_closed_is_refused(tmp_path):
    solid = trimesh.creation.icosphere(subdivisions=1, radius=0.1)
    solid.update_faces(np.arange(len(solid.faces)) != 7)
    solid.export(tmp_path / "open.stl")
    message = r"'bowl': mesh '.*open.stl' is not closed: 3 of its edges"
    with pytest.raises(EnvironmentFileError, match=message):
        environment_shapes(environment(tmp_path, "name: bowl, file: open.stl"))


@pytest.mark.parametrize("type_", ["npy", "ply"])
def test_every_point_of_a_cloud_is_in_a_box(tmp_path, type_):
    rng = np.random.default_rng(3)
    points = np.concatenate(
        [rng.uniform([-1, -1, 0.7], [0, 1, 0.71], (3000, 3)), rng.uniform(-0.3, 0.3, (50, 3))]
    )
    file = tmp_path / f"scan.{type_}"
    if type_ == "npy":
        np.save(file, points)
    else:
        trimesh.PointCloud(points).export(file)
    shapes = obstacle_shapes(Obstacle(name="scan", file=str(file), cell=0.05), "scan")
    kept = points if type_ == "npy" else trimesh.load(file).vertices
    assert inside(shapes, kept).all()
    # The boxes are the cells with a point in them, and no others.
    cells = np.unique(np.floor(kept / 0.05).astype(int), axis=0)
    assert union_volume(shapes) == pytest.approx(len(cells) * 0.05**3, rel=0.02)
    assert len(shapes) < len(cells) / 3


def test_cells_far_apart_remain_boxes_of_their_own():
    points = np.array([[-90.0, -90.0, -90.0], [90.0, 90.0, 90.0], [90.001, 90.0, 90.0]])
    boxes = boxes_of_cells(points, 0.005)
    assert np.all((boxes[:, 1] - boxes[:, 0]) == pytest.approx(0.005, abs=1e-9))
    assert len(boxes) == 2


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((1, 3)), r"has 1 point\(s\), but must have 10 to"),
        (np.zeros((20, 2)), r"has the shape \(20, 2\), but must have x, y, z"),
        (np.full((20, 3), np.nan), "a coordinate is nan"),
        (np.full((20, 3), 5000.0), "a coordinate is 5000 m"),
        (np.array(["a"] * 20), "cannot be used"),
    ],
    ids=["one point", "plane", "nan", "far", "text"],
)
def test_clouds_that_cannot_be_used_are_one_line(tmp_path, array, message):
    np.save(tmp_path / "scan.npy", array)
    with pytest.raises(EnvironmentFileError, match=message) as error:
        environment_shapes(environment(tmp_path, "name: scan, file: scan.npy"))
    assert "\n" not in str(error.value)


def test_a_ply_with_a_number_beyond_its_type_is_one_line_without_a_warning(tmp_path):
    rows = ["0 0 0"] * 20 + ["1e300 0 0"]
    properties = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    (tmp_path / "scan.ply").write_text(head + "\n".join(rows) + "\n")
    with pytest.raises(EnvironmentFileError, match="coordinate"):
        environment_shapes(environment(tmp_path, "name: scan, file: scan.ply"))


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        ("name: a, box: [1, 1, 1], sphere: 0.1", "not box and sphere"),
        ("name: a", "not none"),
        ("name: a, sphere: 0.1, cell: 0.1", r"cell is for point clouds \(.ply, .npy\)"),
        ("name: a, cylinder: [0.1, 0.2], scale: 2", "scale is for meshes"),
        ("name: a, cylinder: [-0.1, 0.2]", "cylinder"),
    ],
)
def test_an_obstacle_is_one_thing(tmp_path, obstacle, message):
    with pytest.raises(EnvironmentFileError, match=message):
        environment(tmp_path, obstacle)


def test_check_finds_a_table_through_the_forearms(tmp_path):
    file = tmp_path / "table.yaml"
    file.write_text(
        "based_on: wheelchair\nname: table\ntitle: table\nobstacles:\n"
        "  - {name: table, box: [0.6, 1.2, 0.04], xyz: [0.7, 0, 0.75]}\n"
        "  - {name: far, sphere: 0.2, xyz: [9, 0, 0.5]}\n"
        "  - {name: sunk, cylinder: [0.1, 0.5], xyz: [-1, 0, 0.2]}\n"
    )
    found = check_environment(load_environment(file))
    assert ("table", "person::forearm_left_link") in found.touching
    assert not found.is_sound
    assert any("'table' touches the person" in problem for problem in found.problems)
    assert found.outside == ("far",)
    assert found.below_floor == ("sunk",)
    sizes = {obstacle.name: (obstacle.count, obstacle.excess) for obstacle in found.obstacles}
    assert sizes["table"] == (1, pytest.approx(1.0))
    assert sizes["sunk"] == (6, pytest.approx(1.023, abs=0.02))


def test_check_of_obstacles_that_are_apart_is_sound(tmp_path):
    found = check_environment(
        environment(tmp_path, "name: a, sphere: 0.1, xyz: [1, 0, 0.5]", "name: b, sphere: 0.1")
    )
    assert found.is_sound is False  # b lies half in the floor
    assert found.touching == ()
    assert found.to_json()["below_floor"] == ["b"]
