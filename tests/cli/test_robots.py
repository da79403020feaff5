import pytest

from tests.model.robots.made_up import urdf


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "made_up.urdf").write_text(urdf())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_draft_then_check(tcs_command, folder):
    ran = tcs_command("robot", "new", "made_up.urdf", "--tool", "tool", "--json")
    assert ran.code == 0
    assert (ran.json["file"], ran.json["primitives"]) == ("made_up.yaml", "made_up_primitives.csv")
    assert ran.json["arm_joints"] == [f"a{i}" for i in range(1, 8)]
    assert ran.json["torso_joint"] == "lift"
    ran = tcs_command("robot", "check", "made_up.yaml", "--samples", "50", "--json")
    assert ran.code == 0
    assert ran.json["sound"] is True
    assert ran.json["arm_class"]["class"] == "spherical-wrist"
    assert ran.json["ik_round_trip"]["success_rate"] == 1.0


def test_a_draft_overwrites_nothing(tcs_command, folder):
    (folder / "made_up.yaml").write_text("mine")
    ran = tcs_command("robot", "new", "made_up.urdf", "--tool", "tool")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "'made_up.yaml' already exists" in ran.err
    assert (folder / "made_up.yaml").read_text() == "mine"
    assert not (folder / "made_up_primitives.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("made_up.urdf", "--tool", "tol"), "Did you mean 'tool'?"),
        (("gone.urdf", "--tool", "tool"), "there is no file"),
        (("made_up.urdf", "--tool", "arm4"), "only 4 revolute joints in a row lead"),
        (("made_up.urdf", "--tool", "tool", "--out", "no/where.yaml"), "cannot be written"),
        (("made_up.urdf", "--tool", "tool", "--out", "mine.yml"), "must end in .yaml"),
    ],
)
def test_a_urdf_that_cannot_be_drafted_is_one_line(tcs_command, folder, arguments, message):
    ran = tcs_command("robot", "new", *arguments)
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert message in ran.err
    assert sorted(path.name for path in folder.iterdir()) == ["made_up.urdf"]


def test_an_arm_outside_the_classes_is_drafted_and_reported(tcs_command, folder):
    """Neither the wrist nor the shoulder of this arm is spherical."""
    text = urdf(wrist_offset=0.03).replace('xyz="0.0 0.0 0.15"', 'xyz="0.02 0.0 0.15"')
    (folder / "odd.urdf").write_text(text)
    assert tcs_command("robot", "new", "odd.urdf", "--tool", "tool").code == 0
    ran = tcs_command("robot", "check", "odd.yaml", "--samples", "50", "--json")
    assert ran.code == 0
    assert ran.json["arm_class"]["class"] is None
    assert ran.json["problems"] == []
    assert "outside the closed-form classes" in ran.json["notes"][0]
    assert ran.json["notes"][0].endswith("It is solved numerically, which takes longer.")
    assert ran.json["arm_class"]["metres_from_meeting"]["5-6-7"] == pytest.approx(0.03, abs=1e-9)
    assert ran.json["ik_round_trip"]["method"] == "numeric"
    assert ran.json["ik_round_trip"]["success_rate"] >= 0.98
    assert ran.json["enclosed"]["enclosed"] is True


def test_check_as_text(tcs_command):
    ran = tcs_command("robot", "check", "pr2", "--samples", "20")
    assert ran.code == 0
    assert ran.err == ""
    for words in (
        "spherical-wrist",
        "20 of 20 postures",
        "0 pairs",
        "continuous",
        "of 29,039 triangles",
    ):
        assert words in ran.out


def test_check_of_an_unknown_robot_is_one_line(tcs_command):
    ran = tcs_command("robot", "check", "pr3")
    assert ran.code == 1
    assert "Did you mean 'pr2'?" in ran.err
