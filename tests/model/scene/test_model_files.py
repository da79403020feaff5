"""Model files of an environment are checked before Drake: it ends the process for some numbers."""

from __future__ import annotations

import pytest

from tcs.errors import EnvironmentFileError
from tcs.model.robots import load_robot
from tcs.model.scene import Scene, SceneSpec, load_environment
from tcs.model.scene.environment.model_files import check_model_file

MODEL = """\
<sdf version="1.9"><model name="table">
<link name="base"><pose>0 0 0.3 0 0 0</pose><inertial><mass>3.5</mass></inertial>
<collision name="foot"><geometry><box><size>0.1 0.2 0.6</size></box></geometry></collision></link>
<link name="lid"><collision name="lid"><geometry><capsule><radius>0.02</radius>
<length>0.3</length></capsule></geometry></collision></link>
<joint name="turn" type="revolute"><parent>base</parent><child>lid</child><axis>
<xyz>0 0 1</xyz><limit><lower>-1.5</lower><upper>1.25</upper></limit></axis></joint>
</model></sdf>
"""
ENVIRONMENT = """\
{name: room, title: A table, origin: on the floor, source: made up,
 models: [{name: table, file: table.sdf}],
 grid: {base_x: {unit: m, start: 0, step: 0, count: 1},
        base_y: {unit: m, start: 0, step: 0, count: 1},
        base_yaw: {unit: deg, start: 0, step: 0, count: 1},
        torso: {unit: m, start: 0, step: 0, count: 1}}}
"""


@pytest.fixture
def written(tmp_path):
    """Function that writes the model, with one text replaced, and the environment."""

    def write(old="", new=""):
        assert old in MODEL
        content = MODEL.replace(old, new, 1) if isinstance(new, str) else new
        data = content.encode() if isinstance(content, str) else content
        (tmp_path / "table.sdf").write_bytes(data)
        (tmp_path / "room.yaml").write_text(ENVIRONMENT)
        return tmp_path

    return write


def scene(folder):
    return Scene(SceneSpec(load_robot("iiwa7"), load_environment(folder / "room.yaml")))


def refused(folder):
    """Return the line with which the scene is refused, before and without Drake."""
    path = folder / "table.sdf"
    with pytest.raises(EnvironmentFileError) as caught:
        check_model_file(path, f"model '{path}'")
    with pytest.raises(EnvironmentFileError):
        scene(folder)
    message = str(caught.value)
    assert message.startswith(f"model '{path}'")
    assert "\n" not in message
    return message


def test_a_sound_model_is_accepted(written):
    assert scene(written()).built.environment_joints.by_name.keys() == {"turn"}


# Drake 1.51 aborts for an infinite size or pose: "abort" is the end of the process.
@pytest.mark.parametrize("number", ["inf", "-inf", "nan", "1e308", "1e15", "1000"])
@pytest.mark.parametrize(
    ("old", "new", "name"),
    [
        ("0.1 0.2 0.6", "0.1 {} 0.6", "size"),
        ("<radius>0.02", "<radius>{}", "radius"),
        ("<length>0.3", "<length>{}", "length"),
        ("0 0 0.3 0 0 0", "0 0 {} 0 0 0", "pose"),
        ("0 0 0.3 0 0 0", "0 0 0.3 {} 0 0", "pose"),
    ],
)
def test_no_furniture_is_so_large_or_so_far(written, old, new, name, number):
    message = refused(written(old, new.format(number)))
    assert f"a number of '{name}' is" in message
    assert "must be" in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<mass>3.5", "<mass>inf", "a number of 'mass' is inf"),
        ("<mass>3.5", "<mass>1e308", "a number of 'mass' is 1e+308"),
        ("<xyz>0 0 1", "<xyz>0 0 0", "an axis must have a direction"),
        ("<xyz>0 0 1", "<xyz>nan 0 1", "an axis must have a direction"),
        ("<lower>-1.5", "<lower>nan", "a number of 'lower' is nan"),
        ("<lower>-1.5", "<lower>-2000", "a number of 'lower' is -2000"),
        ("0.1 0.2 0.6", "0.1 0 0.6", "a number of 'size' is 0"),
        ('link name="lid"', 'link name="world"', "a link is named 'world'"),
        ("sdf", b"\xff\xfes\x00d\x00f\x00", "is not valid XML"),
        ("<sdf", "<sdf <", "is not valid XML"),
        ("<sdf", '<?xml version="1.0" encoding="x-none"?><sdf', "declares an encoding"),
    ],
)
def test_other_nonsense_is_one_line(written, old, new, words):
    assert words in refused(written(old, new))


@pytest.mark.parametrize("bound", ["-inf", "-1e16", "-1e308"])
def test_no_limit_may_be_written_as_infinity(written, bound):
    assert scene(written("<lower>-1.5", f"<lower>{bound}")).built.parts


def test_what_drake_cannot_convert_is_one_line(written):
    # Its parser passes on the exception of the C function `stoi`.
    folder = written('version="1.9"', 'version="x.y"')
    with pytest.raises(EnvironmentFileError, match=r"table\.sdf' cannot be used: \S") as caught:
        scene(folder)
    assert "\n" not in str(caught.value)


def test_an_included_file_is_checked_too(written, tmp_path):
    inner = MODEL.replace("0.1 0.2 0.6", "0.1 inf 0.6")
    (tmp_path / "inner.sdf").write_text(inner)
    folder = written("<link", '<include merge="true"><uri>inner.sdf</uri></include><link')
    assert "included 'inner.sdf': a number of 'size' is inf" in refused(folder)
    (tmp_path / "inner.sdf").write_text((tmp_path / "table.sdf").read_text())
    (tmp_path / "table.sdf").write_text(
        MODEL.replace("<link", "<include><uri>table.sdf</uri></include><link", 1)
    )
    assert "includes it in turn" in refused(folder)


def test_another_type_of_file_is_refused(tmp_path):
    path = tmp_path / "table.obj"
    path.write_text("v nan nan nan")
    with pytest.raises(EnvironmentFileError, match="must be an SDFormat or URDF file"):
        check_model_file(path, f"model '{path}'")


@pytest.mark.parametrize(
    ("name", "entry"),
    [
        *((name, "box: [1, 1, 1]") for name in ("base", "iiwa7", "DefaultModelInstance")),
        *((name, "file: table.sdf") for name in ("base", "iiwa7", "WorldModelInstance")),
        ("iiwa_link_3", "box: [1, 1, 1]"),
    ],
)
def test_a_name_of_the_robot_or_of_drake_is_refused(written, name, entry):
    folder = written()
    text = ENVIRONMENT.replace("models: [{name: table, file: table.sdf}]", "obstacles: [OBSTACLE]")
    (folder / "room.yaml").write_text(text.replace("OBSTACLE", f"{{name: {name}, {entry}}}"))
    with pytest.raises(EnvironmentFileError, match=rf"'{name}' is (taken|also)") as caught:
        scene(folder)
    assert "\n" not in str(caught.value)
