"""Reading a URDF, and the errors of a broken one."""

import numpy as np
import pytest
import trimesh

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots import read_urdf
from tcs.model.robots.urdf import ROOT
from tcs.model.robots.urdf.kinematic import urdf_text
from tcs.model.robots.urdf.packages import resolve_uri
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles

TWO_LINKS = """<robot name="two">
  <link name="a"/>
  <link name="b">
    <visual><geometry>{geometry}</geometry></visual>
  </link>
  <joint name="hinge" type="{type}">
    <parent link="{parent}"/><child link="b"/><axis xyz="{axis}"/>
    <limit lower="-1" upper="{upper}" effort="1" velocity="1"/>
    {more}
  </joint>
</robot>"""


def two_links(folder, **changes):
    parts = {"geometry": '<sphere radius="1"/>', "type": "revolute", "parent": "a", "more": ""}
    parts |= {"axis": "0 0 1", "upper": "2"}
    path = folder / "two.urdf"
    path.write_text(TWO_LINKS.format(**(parts | changes)))
    return path


def test_soft_limits_never_exceed_hard_ones(tmp_path):
    more = '<safety_controller soft_lower_limit="-5" soft_upper_limit="1.5" k_velocity="1"/>'
    joint = read_urdf(two_links(tmp_path, more=more)).joints["hinge"]
    assert joint.hard == (-1.0, 2.0)
    assert joint.soft == (-1.0, 1.5)


def test_without_safety_controller_hard_limits_hold(tmp_path):
    joint = read_urdf(two_links(tmp_path)).joints["hinge"]
    assert joint.soft == joint.hard == (-1.0, 2.0)


def test_a_file_without_links_describes_no_robot(tmp_path):
    file = tmp_path / "empty.urdf"
    file.write_text('<robot name="empty"><!-- No macro was called. --></robot>')
    with pytest.raises(RobotError, match="it has no link, so it describes no robot"):
        read_urdf(file)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"type": "floating"}, "type 'floating' is not supported"),
        ({"parent": "c"}, "unknown link 'c'"),
        ({"parent": "b"}, "do not form one tree"),
        ({"geometry": '<mesh filename="gone.stl"/>'}, "there is no file"),
        ({"geometry": '<cone radius="1"/>'}, "geometry is 'cone', but must be mesh"),
        ({"geometry": '<sphere radius="wide"/>'}, "'wide' must be 1 finite number"),
        ({"more": '<mimic joint="hinge"/>'}, "'hinge' must be another, movable joint"),
        ({"more": '<mimic joint="lever"/>'}, "unknown joint 'lever'"),
        ({"parent": "world"}, "unknown link 'world'"),
        ({"more": '<origin xyz="0 0 1e15"/>'}, "is 1e\\+15 m, but a position must be -40 to 40 m"),
        ({"more": '<origin xyz="0 0 41"/>'}, "is 41 m, but a position must be"),
        ({"more": '<origin rpy="0 0 1e308"/>'}, "is 1e\\+308 rad, but an angle must be"),
        ({"more": '<origin xyz="0 nan 0"/>'}, "'0 nan 0' must be 3 finite number"),
        ({"axis": "0 0 0"}, "its axis has length 0, but must have a direction"),
        ({"axis": "0 1e308 0"}, "its axis has length 1e\\+308, but must have a direction"),
        ({"axis": "inf 0 0"}, "must be 3 finite number"),
        ({"upper": "1e16"}, "a limit is 1e\\+16 m or rad, but a joint limit must be -1,000 to"),
        ({"type": "prismatic", "upper": "41"}, "a limit is 41 m, but a position must be"),
        ({"geometry": '<sphere radius="1e15"/>'}, "is 1e\\+15 m, but an extent must be 0 to 100 m"),
        ({"geometry": '<box size="1 -1 1"/>'}, "is -1 m, but an extent must be"),
        ({"more": '<mimic joint="hinge" multiplier="1e9"/>'}, "a number of its 'mimic' is 1e\\+09"),
        (
            {"more": '<safety_controller soft_lower_limit="3" soft_upper_limit="4"/>'},
            "do not overlap",
        ),
    ],
)
def test_broken_models_get_one_clear_line(changes, message, tmp_path):
    with pytest.raises((RobotError, UnknownNameError), match=message) as caught:
        read_urdf(two_links(tmp_path, **changes)).require_surfaces()
    assert "two.urdf" in str(caught.value) or "gone.stl" in str(caught.value)
    assert "\n" not in str(caught.value)


XACRO = '<robot xmlns:xacro="http://{}ros.org/wiki/xacro"><xacro:include filename="a"/></robot>'
MACROS = r"has xacro macros\. Expand it with xacro first: xacro no\.urdf"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot", "is not valid XML"),
        ("<sdf/>", "the root element is 'sdf', but must be 'robot'"),
        (XACRO.format("www."), MACROS),
        (XACRO.format(""), MACROS),
        ('<robot name="a"><link name="${prefix}base"/></robot>', MACROS),
        ('<robot name="a"><link name="b"/><link name="b"/></robot>', "two links are named 'b'"),
    ],
    ids=["not XML", "another format", "macros", "their other name", "substitution", "one name"],
)
def test_a_file_that_is_not_a_urdf_is_refused(text, message, tmp_path):
    path = tmp_path / "no.urdf"
    path.write_text(text)
    with pytest.raises(RobotError, match=rf"no\.urdf.*{message}"):
        read_urdf(path)


@pytest.mark.parametrize(
    ("geometry", "reach"),
    [
        ('<sphere radius="0.5"/>', 0.5),
        ('<cylinder radius="0.5" length="0.2"/>', np.hypot(0.5, 0.1)),
        ('<box size="0.2 0.4 0.4"/>', 0.3),
    ],
)
def test_round_bodies_become_polyhedra_around_them(geometry, reach, tmp_path):
    triangles = body_triangles(read_urdf(two_links(tmp_path, geometry=geometry)))["b"]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # No face cuts into a sphere inside the body; 1e-12 is rounding.
    inner = 0.1
    assert np.abs(np.einsum("ij,ij->i", normals, triangles[:, 0])).min() >= inner - 1e-12
    corners = np.linalg.norm(triangles, axis=2).max()
    # Polyhedra of 48 and more sides stand out by a few percent at most.
    assert reach - 1e-12 <= corners <= 1.1 * reach


def test_sphere_lies_inside_its_polyhedron(tmp_path):
    triangles = body_triangles(read_urdf(two_links(tmp_path)))["b"]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    distance = np.einsum("ij,ij->i", normals, triangles[:, 0])
    assert distance.min() >= 1 - 1e-12  # rounding of unit coordinates


def test_frame_markers_are_no_surface(tmp_path):
    assert (
        body_triangles(read_urdf(two_links(tmp_path, geometry='<box size="0.01 0.01 0.01"/>')))
        == {}
    )


def test_a_package_may_be_a_folder_above(tmp_path):
    mesh = tmp_path / "my_robot" / "meshes" / "arm.stl"
    mesh.parent.mkdir(parents=True)
    mesh.touch()
    urdf_folder = tmp_path / "my_robot" / "urdf"
    assert resolve_uri("package://my_robot/meshes/arm.stl", urdf_folder) == mesh


def test_a_link_named_world_is_refused_unless_it_is_the_root(tmp_path):
    """Drake's own body of that name does not move; before, building the scene failed."""
    path = two_links(tmp_path)
    text = path.read_text()
    path.write_text(text.replace('"b"', '"world"'))
    with pytest.raises(RobotError, match="a link is named 'world'"):
        read_urdf(path)
    other = tmp_path / "bolted_down.urdf"
    other.write_text(text.replace('"a"', '"world"'))
    model = read_urdf(other)
    assert model.root == ROOT
    assert model.joints["hinge"].parent == ROOT


def test_a_mount_becomes_the_root(tmp_path):
    model = read_urdf(two_links(tmp_path)).mounted_on("stand", (0.0, 0.1, 0.7), (0.0, 0.0, 0.0))
    assert model.root == "stand"
    assert list(model.links) == ["stand", "a", "b"]
    _, p = pose_in_root(model, "a", {})
    assert p.tolist() == [0.0, 0.1, 0.7]


def test_an_address_may_have_a_third_slash(tmp_path):
    mesh = tmp_path / "my_robot" / "arm.stl"
    mesh.parent.mkdir()
    mesh.touch()
    assert resolve_uri("package:///my_robot/arm.stl", mesh.parent) == mesh


def test_a_fixed_joint_needs_no_axis(tmp_path):
    assert not read_urdf(two_links(tmp_path, type="fixed", axis="0 0 0")).joints["hinge"].is_movable


def test_too_many_links_are_refused(tmp_path):
    path = tmp_path / "many.urdf"
    links = "".join(f"<link name='l{i}'/>" for i in range(1001))
    path.write_text(f"<robot>{links}</robot>")
    with pytest.raises(RobotError, match="number of links is 1001"):
        read_urdf(path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'<?xml version="1.0" encoding="utf-16"?><robot/>', "declares an encoding|not valid XML"),
        (b"\xff<robot/>", "is not valid XML"),
        (b"<robot>", "is not valid XML"),
    ],
)
def test_what_is_no_xml_is_one_line(tmp_path, content, words):
    path = tmp_path / "broken.urdf"
    path.write_bytes(content)
    with pytest.raises(RobotError, match=words) as caught:
        read_urdf(path)
    assert "\n" not in str(caught.value)


def test_the_declared_encoding_is_honoured(tmp_path):
    path = two_links(tmp_path)
    text = path.read_text().replace('"b"', '"Ellenb\u00f6gen"')
    for encoding in ("ISO-8859-1", "UTF-16"):
        declared = f'<?xml version="1.0" encoding="{encoding}"?>'
        path.write_bytes((declared + text).encode(encoding))
        assert "Ellenb\u00f6gen" in read_urdf(path).links


def test_a_capsule_ends_half_a_ball_beyond_its_length(tmp_path):
    """A capsule along x, seen from b: 0.1 m between the centres, 0.05 m of radius."""
    geometry = '<capsule radius="0.05" length="0.1"/>'
    path = two_links(tmp_path, geometry=geometry)
    turned = path.read_text().replace("<visual>", '<visual><origin rpy="0 1.5707963267948966 0"/>')
    path.write_text(turned)
    corners = body_triangles(read_urdf(path))["b"].reshape(-1, 3)
    # The polyhedra around the balls stand out by a few percent of the radius.
    for side, reach in ((0, 0.1), (1, 0.05), (2, 0.05)):
        assert reach <= corners[:, side].max() <= reach + 0.005
        assert -reach - 0.005 <= corners[:, side].min() <= -reach
    path.write_text(turned.replace("capsule", "ellipsoid"))
    with pytest.raises(RobotError, match="link 'b': geometry is 'ellipsoid'"):
        read_urdf(path)


def test_a_joint_whose_limits_are_one_value_is_fixed_there(tmp_path):
    """As is what mimics it; the pose of the child is that of the joint at this value."""
    free = two_links(tmp_path, upper="2", more='<origin xyz="0 0 1" rpy="0.3 0 0"/>')
    text = free.read_text()
    follower = (
        '<link name="c"/><joint name="led" type="revolute"><parent link="b"/><child link="c"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1"/><mimic joint="hinge" multiplier="-2"/>'
        "</joint></robot>"
    )
    free.write_text(text.replace("</robot>", follower))
    moved = read_urdf(free)
    R, p = pose_in_root(moved, "c", {"hinge": 0.4, "led": -0.8})
    free.write_text(text.replace('lower="-1" upper="2"', 'lower="0.4" upper="0.4"')
                    .replace("</robot>", follower))  # fmt: skip
    locked = read_urdf(free)
    assert [j.is_movable for j in locked.joints.values()] == [False, False]
    assert [j.locked for j in locked.joints.values()] == [0.4, -0.8]
    for found, expected in zip(pose_in_root(locked, "c", {}), (R, p), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-15)


def test_a_mesh_that_is_only_drawn_may_be_missing(tmp_path):
    path = two_links(tmp_path, geometry='<mesh filename="gone.dae"/>')
    solid = '<collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    path.write_text(path.read_text().replace("</visual>\n  </link>", f"</visual>{solid}"))
    model = read_urdf(path)
    with pytest.raises(RobotError, match=r"link 'b': 'gone\.dae': there is no file"):
        model.require_surfaces()
    only = model.with_surfaces(of="collision", ignored=())
    only.require_surfaces()
    assert np.ptp(body_triangles(only)["b"], axis=(0, 1)).tolist() == [1.0, 1.0, 1.0]
    assert "gone" not in urdf_text(only, meshes=True)
    # Once it is there, it is found.
    trimesh.creation.box([0.4, 0.4, 0.4]).export(tmp_path / "gone.dae")
    found = read_urdf(path)
    found.require_surfaces()
    drawn = found.with_surfaces(of="visual", ignored=())
    assert np.ptp(body_triangles(drawn)["b"], axis=(0, 1)).tolist() == pytest.approx([0.4] * 3)


def test_a_link_of_20_m_is_refused(tmp_path):
    """A mesh in millimetres without its scale; before, shapes were fitted to it for minutes."""
    trimesh.creation.box([20.0, 20.0, 20.0]).export(tmp_path / "part.stl")
    path = two_links(tmp_path, geometry='<mesh filename="part.stl"/>')
    with pytest.raises(RobotError, match=r"link 'b': mesh '.*part\.stl' reaches 10\.0 m .*'scale'"):
        body_triangles(read_urdf(path))
    scaled = '<mesh filename="part.stl" scale="0.01 0.01 0.01"/>'
    small = body_triangles(read_urdf(two_links(tmp_path, geometry=scaled)))
    assert np.ptp(small["b"][..., 0]) == pytest.approx(0.2)


@pytest.fixture
def two_packages(tmp_path):
    """Return the folder of a URDF, and a mesh in another package of another workspace."""
    mesh = tmp_path / "other ws" / "src" / "arms" / "arm_meshes" / "arm.stl"
    mesh.parent.mkdir(parents=True)
    mesh.touch()
    (mesh.parent / "package.xml").touch()
    urdf_folder = tmp_path / "ws" / "src" / "my_robot" / "urdf"
    urdf_folder.mkdir(parents=True)
    return urdf_folder, mesh


ADDRESS = "package://arm_meshes/arm.stl"


def test_packages_are_searched_where_ros_does(two_packages, tmp_path, monkeypatch):
    beside, mesh = two_packages
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(RobotError, match="'arm_meshes' is neither installed, nor in ROS_PACKAGE"):
        resolve_uri(ADDRESS, beside)
    src = tmp_path / "other ws" / "src"
    for folder in (src, src / "arms", mesh.parent):
        assert resolve_uri(ADDRESS, beside, (str(folder),)) == mesh
        monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{folder}")
        assert resolve_uri(ADDRESS, beside) == mesh
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    shared = tmp_path / "install" / "share" / "arm_meshes" / "arm.stl"
    shared.parent.mkdir(parents=True)
    shared.touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path / 'install'}")
    assert resolve_uri(ADDRESS, beside) == shared


def test_packages_of_one_workspace_lie_beside_each_other(two_packages, tmp_path):
    beside, _ = two_packages
    neighbour = tmp_path / "ws" / "src" / "arm_meshes"
    neighbour.mkdir()
    (neighbour / "package.xml").touch()
    (neighbour / "arm.stl").touch()
    assert resolve_uri(ADDRESS, beside) == neighbour / "arm.stl"


def test_a_space_may_be_written_as_in_a_uri(two_packages):
    beside, mesh = two_packages
    assert resolve_uri(f"file://{mesh}".replace(" ", "%20"), beside) == mesh
    odd = mesh.with_name("100%20.stl")
    odd.touch()
    assert resolve_uri(f"file://{odd}", beside) == odd


def test_a_colour_that_is_none_refuses_no_robot(tmp_path):
    path = two_links(tmp_path)
    skin = '<material name="m"><color rgba="0.1 0.1 0.1 0 1"/></material></visual>'
    path.write_text(path.read_text().replace("</visual>", skin))
    assert read_urdf(path).links["b"][0].rgba is None


def test_a_prefix_that_is_not_declared_is_read_as_ros_and_drake_do(tmp_path):
    capsule = '<drake:capsule radius="0.1" length="0.1"/>'
    model = read_urdf(two_links(tmp_path, geometry=capsule))
    assert [g.shape for g in model.links["b"]] == ["cylinder", "sphere", "sphere"]
    with pytest.raises(RobotError, match="has xacro macros"):
        read_urdf(two_links(tmp_path, more="<xacro:property/>"))
    with pytest.raises(RobotError, match="is not valid XML"):
        read_urdf(two_links(tmp_path, more="<drake:a></b>"))
