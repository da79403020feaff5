"""Obstacles of one's own: shapes, meshes and point clouds, enclosed by boxes and capsules."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs.errors import EnvironmentFileError
from tcs.model.robots.mesh_shapes import enclosed_volume, own_mesh, shapes_around_mesh
from tcs.model.robots.primitives import enclosed, union_volume
from tcs.model.scene import environment_shapes, load_environment
from tcs.model.scene.environment.check import check_environment
from tcs.model.scene.environment.environment_file import Obstacle
from tcs.model.scene.environment.obstacle_files import cloud_points
from tcs.model.scene.environment.obstacle_shapes import obstacle_shapes
from tcs_shapes.solids import boxes_of_cells

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
    assert enclosed(shapes, own_mesh(file, 0.001, "tin", EnvironmentFileError)).all()
    assert inside(shapes, np.array([[0.2, 0, 0], [0.3, 0.05, -0.04]])).all()
    assert union_volume(shapes) < 1.05 * 0.3 * 0.2 * 0.1
    # The cache gives the same shapes again.
    assert obstacle_shapes(obstacle, "tin") == shapes


def bowl(folder):
    """Return the file of a ball of 0.1 m radius without its upper half."""
    solid = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    solid.update_faces(solid.triangles_center[:, 2] < 0.0)
    solid.export(folder / "open.stl")
    return folder / "open.stl"


def test_the_surface_of_an_open_mesh_is_solid_and_its_inside_free(tmp_path):
    file = bowl(tmp_path)
    shapes = obstacle_shapes(Obstacle(name="bowl", file=str(file)), "bowl")
    triangles = own_mesh(file, 1.0, "bowl", EnvironmentFileError)
    assert enclosed(shapes, triangles).all()
    assert not inside(shapes, np.array([[0.0, 0.0, -0.04]])).any()
    (found,) = check_environment(
        environment(tmp_path, "name: bowl, file: open.stl, xyz: [1, 0, 1]")
    ).obstacles
    assert found.open_edges > 20
    # At most the protrusion on either side.
    assert 0.0 < found.thickness < 0.02
    assert found.excess is None
    notes = check_environment(
        environment(tmp_path, "name: bowl, file: open.stl, xyz: [1, 0, 1]")
    ).notes
    assert any("'bowl' is not closed" in n and "mm thick" in n for n in notes)
    # In the hand, its inside must be known.
    with pytest.raises(EnvironmentFileError, match="is not closed"):
        shapes_around_mesh(file, 1.0, 0.01, "bowl", EnvironmentFileError)


@pytest.mark.parametrize("suffix", ["ply", "dae"])
def test_other_meshes_give_what_the_stl_gives(tmp_path, suffix):
    """A PLY file with faces was read as the points of its corners, between which all was free."""
    solid = trimesh.creation.box([0.6, 1.2, 0.04])
    found = []
    for type_ in ("stl", suffix):
        solid.export(tmp_path / f"table.{type_}")
        obstacle = Obstacle(name="table", file=str(tmp_path / f"table.{type_}"))
        assert obstacle.type == "mesh"
        found.append([(s.kind, s.size, s.xyz) for s in obstacle_shapes(obstacle, "table")])
    assert found[0] == found[1]


def test_options_of_a_ply_file_are_those_of_what_it_holds(tmp_path):
    trimesh.creation.box().export(tmp_path / "mesh.ply")
    trimesh.PointCloud(np.random.default_rng(0).uniform(size=(20, 3))).export(tmp_path / "dots.ply")
    with pytest.raises(EnvironmentFileError, match="has faces, so it is a mesh"):
        environment_shapes(environment(tmp_path, "name: a, file: mesh.ply, cell: 0.1"))
    with pytest.raises(EnvironmentFileError, match="has no faces, so it is a point cloud"):
        environment_shapes(environment(tmp_path, "name: a, file: dots.ply, protrusion: 0.1"))


def pcd(points, form):
    """Return a PCD file of points with a colour after y, as no library writes it."""
    head = (
        "# .PCD v.7\nVERSION .7\nFIELDS x y rgb z\nSIZE 4 4 4 4\nTYPE F F U F\n"
        f"COUNT 1 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {len(points)}\nDATA {form}\n"
    ).encode()
    if form == "ascii":
        rows = (f"{x} {y} 255 {z}" for x, y, z in points)
        return head + "\n".join(rows).encode()
    layout = [("x", "<f4"), ("y", "<f4"), ("rgb", "<u4"), ("z", "<f4")]
    table = np.zeros(len(points), layout)
    for axis, values in zip("xyz", np.transpose(points), strict=True):
        table[axis] = values
    return head + table.tobytes()


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_pcd_files_are_clouds_and_points_that_are_none_are_left_out(tmp_path, form):
    points = np.random.default_rng(1).uniform(0.0, 0.2, (40, 3))
    with_gaps = np.insert(points, [0, 7, 40], np.nan, axis=0)
    (tmp_path / "scan.pcd").write_bytes(pcd(with_gaps, form))
    found = cloud_points(tmp_path / "scan.pcd", 2.0, "scan")
    np.testing.assert_allclose(found, 2.0 * points, rtol=1e-6)
    (tmp_path / "scan.pcd").write_bytes(pcd(points, "binary_compressed"))
    with pytest.raises(EnvironmentFileError, match="'binary_compressed'; save it in ASCII or bin"):
        cloud_points(tmp_path / "scan.pcd", 1.0, "scan")


def test_other_files_are_refused_with_the_types_that_are_read(tmp_path):
    (tmp_path / "table.step").write_text("ISO-10303-21;")
    message = r"mesh \(.obj, .stl, .ply, .dae, .glb, .gltf\) or a point cloud \(.npy, .pcd, .ply\)"
    with pytest.raises(EnvironmentFileError, match=message):
        environment_shapes(environment(tmp_path, "name: table, file: table.step"))


SOLID = "<collision><geometry>{}</geometry></collision>"
URDF_TABLE = (
    '<robot name="t"><link name="top">{}</link><link name="leg">{}</link>'
    '<joint name="weld" type="fixed"><origin xyz="0 0 -0.4"/><parent link="top"/>'
    '<child link="leg"/></joint></robot>'
)


def test_a_urdf_is_an_obstacle_like_an_sdf(tmp_path):
    top, leg = SOLID.format('<box size="0.6 1.2 0.04"/>'), SOLID.format('<sphere radius="0.1"/>')
    (tmp_path / "table.urdf").write_text(URDF_TABLE.format(top, leg))
    sdf = (
        '<sdf version="1.9"><model name="t"><link name="top"><collision name="a"><geometry><box>'
        '<size>0.6 1.2 0.04</size></box></geometry></collision></link><link name="leg">'
        "<pose>0 0 -0.4 0 0 0</pose><collision name='b'><geometry><sphere><radius>0.1</radius>"
        '</sphere></geometry></collision></link><joint name="weld" type="fixed"><parent>top'
        "</parent><child>leg</child></joint></model></sdf>"
    )
    (tmp_path / "table.sdf").write_text(sdf)
    found = [
        environment_shapes(
            environment(
                tmp_path, f"name: t, file: table.{type_}, xyz: [1, 0, 0.72], rpy_deg: [0, 0, 30]"
            )
        )
        for type_ in ("urdf", "sdf")
    ]
    for field in ("type", "size", "p", "R"):
        np.testing.assert_allclose(*(getattr(one, field) for one in found), atol=1e-12)
    assert found[0].p[0, 1].tolist() == pytest.approx([1.0, 0.0, 0.32])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (URDF_TABLE.format("", ""), "has no collision geometry"),
        (URDF_TABLE.format(SOLID.format('<cylinder radius="1" length="1"/>'), ""), "Cylinder, but"),
        (URDF_TABLE.replace('type="fixed"', 'type="gone"').format("", ""), "cannot be used"),
        (
            '<robot name="t"><link name="a">{0}</link><link name="b">{0}</link></robot>'.format(
                SOLID.format('<sphere radius="0.1"/>')
            ),
            "has 2 links without a parent: a, b",
        ),
    ],
    ids=["nothing solid", "cylinder", "unknown joint", "two roots"],
)
def test_urdfs_that_cannot_be_obstacles_are_one_line(tmp_path, text, message):
    (tmp_path / "table.urdf").write_text(text)
    with pytest.raises(EnvironmentFileError, match=message) as error:
        environment_shapes(environment(tmp_path, "name: t, file: table.urdf"))
    assert "\n" not in str(error.value)


def test_a_model_in_another_encoding_is_read(tmp_path):
    text = URDF_TABLE.format(SOLID.format('<sphere radius="0.1"/>'), "").replace(
        "top", "Fl\u00e4che"
    )
    declared = '<?xml version="1.0" encoding="ISO-8859-1"?>' + text
    (tmp_path / "table.urdf").write_bytes(declared.encode("latin-1"))
    assert len(environment_shapes(environment(tmp_path, "name: t, file: table.urdf")).type) == 2


@pytest.mark.parametrize("angles", [(0, 0, 90), (20, -50, 130), (0, 90, 0), (10, -90, 0)])
def test_a_quaternion_in_the_order_of_ros_places_an_obstacle(tmp_path, angles):
    x, y, z, w = Rotation.from_euler("xyz", angles, degrees=True).as_quat().round(3).tolist()
    size = "name: a, box: [0.1, 0.2, 0.3]"
    turned = environment_shapes(environment(tmp_path, f"{size}, rpy_deg: {list(angles)}"))
    same = environment_shapes(
        environment(tmp_path, f"{size}, quaternion_xyzw: [{x}, {y}, {z}, {w}]")
    )
    # Three digits of a quaternion are 2e-3 rad.
    np.testing.assert_allclose(same.R, turned.R, atol=2e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("[0, 0, 0, 2]", r"quaternion_xyzw \(x, y, z, w\) has length 2, but must have 1"),
        ("[0, 0, 1]", "must be four numbers"),
        ("[0, 0, 0, 1], rpy_deg: [0, 0, 0]", "not both"),
    ],
)
def test_a_quaternion_that_is_none_is_refused(tmp_path, given, message):
    with pytest.raises(EnvironmentFileError, match=message):
        environment(tmp_path, f"name: a, sphere: 0.1, quaternion_xyzw: {given}")


def test_overlapping_parts_of_a_mesh_count_once():
    """Two boxes that share an eighth, one of them inside out, and a ball apart from both."""
    first, second = trimesh.creation.box(), trimesh.creation.box().apply_translation([0.5] * 3)
    second.invert()
    pair = np.concatenate([first.triangles, second.triangles])
    # 200 x 200 lines: half a line at either side of a box of 1 m within 1.5 m.
    assert enclosed_volume(pair) == pytest.approx(2.0 - 0.125, rel=0.01)
    apart = np.concatenate([first.triangles, second.triangles + 5.0])
    assert enclosed_volume(apart) == pytest.approx(2.0, rel=1e-12)


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
        (np.full((20, 3), np.nan), r"has 0 point\(s\).* whose coordinates are numbers"),
        (np.full((20, 3), np.inf), "a coordinate is inf"),
        (np.full((20, 3), 5000.0), "a coordinate is 5000 m"),
        (np.array(["a"] * 20), "cannot be used"),
    ],
    ids=["one point", "plane", "nan", "infinite", "far", "text"],
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
        ("name: a, sphere: 0.1, cell: 0.1", r"cell is for point clouds \(.npy, .pcd, .ply\)"),
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
