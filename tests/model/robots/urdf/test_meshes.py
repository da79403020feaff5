"""The mesh cache: files are made once, named by content, and never written partially."""

import numpy as np
import pytest
import trimesh

from tcs.errors import OutputError, RobotError
from tcs.model.robots import as_obj
from tcs.model.robots.urdf.meshes import mesh_triangles


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("TCS_CACHE_DIR", str(folder))
    return folder / "meshes"


@pytest.fixture
def stl(tmp_path):
    path = tmp_path / "part.stl"
    trimesh.creation.box((0.1, 0.2, 0.3)).export(path)
    return path


def test_conversion_keeps_the_triangles(stl, cache):
    obj = as_obj(stl)
    assert obj.parent == cache
    before = np.sort(mesh_triangles(stl).reshape(-1, 9), axis=0)
    after = np.sort(mesh_triangles(obj).reshape(-1, 9), axis=0)
    # STL holds single precision, OBJ eight digits.
    np.testing.assert_allclose(after, before, atol=1e-7)


def test_second_call_reads_the_cache(stl):
    obj = as_obj(stl)
    written = obj.stat().st_mtime_ns
    assert as_obj(stl) == obj
    assert obj.stat().st_mtime_ns == written


def test_edited_mesh_is_converted_anew(stl):
    first = as_obj(stl)
    trimesh.creation.box((0.1, 0.2, 0.4)).export(stl)
    second = as_obj(stl)
    assert second != first
    # Single precision again.
    assert np.ptp(mesh_triangles(second)[..., 2]) == pytest.approx(0.4, abs=1e-7)


def test_no_temporary_file_is_left(stl, cache):
    as_obj(stl)
    assert [path.suffix for path in cache.iterdir()] == [".obj"]


def test_obj_is_used_as_it_is(tmp_path, cache):
    path = tmp_path / "part.obj"
    trimesh.creation.box((1, 1, 1)).export(path)
    assert as_obj(path) == path
    assert not cache.exists()


def test_unreadable_meshes_are_refused(tmp_path):
    with pytest.raises(RobotError, match="cannot be read"):
        as_obj(tmp_path / "gone.stl")
    broken = tmp_path / "broken.stl"
    broken.write_text("solid nothing")
    with pytest.raises(RobotError, match=r"broken\.stl"):
        as_obj(broken)


def test_cache_that_cannot_be_written_is_reported(stl, tmp_path, monkeypatch):
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    (blocked / "meshes").write_text("a file where a folder should be")
    monkeypatch.setenv("TCS_CACHE_DIR", str(blocked))
    with pytest.raises(
        OutputError, match=r"cache folder .*meshes' cannot be created: File exists\. Set TCS_"
    ):
        as_obj(stl)


def test_an_obj_of_vertices_with_two_coordinates_is_refused(tmp_path):
    """Before, numpy raised ValueError where its triangles were scaled."""
    flat = tmp_path / "flat.obj"
    flat.write_text("v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n")
    with pytest.raises(RobotError, match="a vertex has not three coordinates"):
        mesh_triangles(flat)


def collada(material="paint"):
    """Return a Collada file of a triangle of one material, and of another one of none."""
    corners = '<float_array id="f{0}" count="9">{0} 0 0 {0} 1 0 {0} 0 1</float_array>'
    geometry = (
        '<geometry id="g{0}"><mesh><source id="s{0}">'
        + corners
        + '<technique_common><accessor source="#f{0}" count="3" stride="3">'
        + "".join(f'<param name="{axis}" type="float"/>' for axis in "XYZ")
        + '</accessor></technique_common></source><vertices id="v{0}">'
        '<input semantic="POSITION" source="#s{0}"/></vertices><triangles count="1"{1}>'
        '<input semantic="VERTEX" source="#v{0}" offset="0"/><p>0 1 2</p></triangles></mesh>'
        "</geometry>"
    )
    bound = (
        '<bind_material><technique_common><instance_material symbol="skin" '
        f'target="#{material}"/></technique_common></bind_material>'
    )
    nodes = "".join(
        f'<node id="n{i}"><instance_geometry url="#g{i}">{text}</instance_geometry></node>'
        for i, text in ((1, bound), (2, ""))
    )
    return (
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        "<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>"
        "</asset><library_geometries>"
        + geometry.format(1, ' material="skin"')
        + geometry.format(2, "")
        + f'</library_geometries><library_visual_scenes><visual_scene id="all">{nodes}'
        '</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#all"/></scene>'
        "</COLLADA>"
    )


def test_geometry_whose_material_is_missing_is_read(tmp_path):
    """Before, it was left out: a part of the surface, without a word."""
    path = tmp_path / "part.dae"
    path.write_text(collada(material="not there"))
    assert sorted(mesh_triangles(path)[:, 0, 0]) == [1.0, 2.0]
    assert as_obj(path).read_text().count("\nf ") == 2


def test_geometry_that_a_collada_file_names_but_lacks_is_refused(tmp_path):
    path = tmp_path / "part.dae"
    path.write_text(collada().replace('url="#g1"', 'url="#gone"'))
    with pytest.raises(RobotError, match=r"part\.dae' cannot be used: .*gone"):
        mesh_triangles(path)


@pytest.mark.parametrize("text", ["", "no XML", "<COLLADA/>"])
def test_a_collada_file_that_is_none_is_refused(tmp_path, text):
    path = tmp_path / "part.dae"
    path.write_text(text)
    with pytest.raises(RobotError, match=r"part\.dae'") as caught:
        mesh_triangles(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("unit", "size"), [("0.001", 0.001), ("0.01", 0.01), ("1", 1.0)])
def test_lengths_of_a_collada_file_are_in_its_unit(tmp_path, unit, size):
    """As ROS tools read it; before, a part in millimetres became a thousand times as large."""
    path = tmp_path / "part.dae"
    named = f'<asset><unit name="some" meter="{unit}"/>'
    path.write_text(collada().replace("<asset>", named))
    assert sorted(mesh_triangles(path)[:, 0, 0]) == [size, 2 * size]
    assert f"v {size:.8f}" in as_obj(path).read_text()
    path.write_text(collada().replace("<asset>", named.replace(unit, "0")))
    with pytest.raises(RobotError, match="its unit is 0 m"):
        mesh_triangles(path)
