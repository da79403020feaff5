"""Reading a URDF, and the errors of a broken one."""

import numpy as np
import pytest

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots import read_urdf
from tcs.model.robots.urdf import ROOT
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
        read_urdf(two_links(tmp_path, **changes))
    assert "two.urdf" in str(caught.value) or "gone.stl" in str(caught.value)
    assert "\n" not in str(caught.value)


XACRO = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot", "is not valid XML"),
        ("<sdf/>", "the root element is 'sdf', but must be 'robot'"),
        (XACRO, r"has xacro macros\. Expand them first: xacro no\.urdf"),
    ],
    ids=["not XML", "another format", "macros"],
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
        (b"\xff<robot/>", "is not a text file in UTF-8"),
        (b"<robot>", "is not valid XML"),
    ],
)
def test_what_is_no_xml_is_one_line(tmp_path, content, words):
    path = tmp_path / "broken.urdf"
    path.write_bytes(content)
    with pytest.raises(RobotError, match=words) as caught:
        read_urdf(path)
    assert "\n" not in str(caught.value)
