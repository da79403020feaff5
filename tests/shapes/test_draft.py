"""Drafting robot files: what is found in a URDF, and one-line errors if it cannot be used."""

import pytest
import trimesh

from tcs.errors import OutputError, RobotError, UnknownNameError
from tcs.model.robot_check import fingers_off_axis, quick_problems
from tcs.model.robots import load_robot
from tcs.model.robots.primitives import enclosed
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs_shapes import covering as candidates
from tcs_shapes.bodies import ARM, COARSE, enclosure, fit_robot
from tcs_shapes.draft import DraftOptions, draft_robot, on_floor, write_draft
from tcs_shapes.self_collision import SelfCollision, sample_positions
from tests.model.robots.made_up import gantry, joint, link, urdf


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "made_up.urdf"
    file.write_text(urdf())
    return file


@pytest.fixture(scope="module")
def drafted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drafted")
    (folder / "made_up.urdf").write_text(urdf())
    draft = draft_robot(folder / "made_up.urdf", "tool")
    write_draft(draft, folder / "mine.yaml")
    return draft, folder / "mine.yaml"


def test_arm_and_torso_are_found(drafted):
    robot = drafted[0].robot
    assert robot.arm_joints == tuple(f"a{i}" for i in range(1, 8))
    assert robot.arm_base == "mast"
    assert robot.torso_joint == "lift"
    assert robot.root_body == "floor"
    assert robot.standing_bodies == ("base",)
    assert any("a1, a2, a3, a4, a5, a6, a7" in remark for remark in drafted[0].remarks)


def test_other_joints_are_at_zero_or_mid_range(drafted):
    robot = drafted[0].robot
    assert robot.postures == {"drafted": {"pan": 0.0, "nod": 0.5}}
    assert robot.grippers == {"drafted": {"grip": 0.02}}


@pytest.fixture(scope="module")
def doubtful(tmp_path_factory):
    """Return a draft of a robot with much to review, and its file."""
    folder = tmp_path_factory.mktemp("doubtful")
    text = urdf()
    # A cover that slides from 0 to half a metre below the floor.
    cover = link("cover", ((0.3, 0.3, 0.2), (0, 0, 0.2)))
    slide = joint("slide", "prismatic", "mast", "cover", axis="0 0 -1", limits=(0.0, 1.2))
    # Degrees where radians belong.
    text = text.replace('lower="-1.0" upper="1.0"', 'lower="-126" upper="126"')
    # A sensor that cannot turn, between wrist and tool, and a tool frame in the palm.
    text = text.replace(
        '<parent link="arm7"/><child link="tool"/>', '<parent link="sensor"/><child link="tool"/>'
    ).replace("0 0 0.2", "0 0 0.02")
    sensor = joint("bolt", "revolute", "arm7", "sensor", (0, 0, 0.05), limits=(0, 0))
    (folder / "odd.urdf").write_text(
        text.replace("</robot>", f"{cover}{slide}{link('sensor')}{sensor}</robot>")
    )
    draft = draft_robot(folder / "odd.urdf", "tool", DraftOptions(coarse=True))
    write_draft(draft, folder / "odd.yaml")
    return draft, folder / "odd.yaml"


def test_joints_that_can_be_at_zero_are_there(doubtful):
    """Zero is where the model was drawn: the cover would be below the floor at mid-range."""
    robot = doubtful[0].robot
    assert robot.postures["drafted"]["slide"] == 0.0
    assert robot.mount is None
    assert robot.grippers == {"drafted": {"grip": 0.02}}


def test_a_joint_that_cannot_move_is_no_joint_of_the_arm(doubtful):
    robot = load_robot(doubtful[1])
    assert robot.arm_joints == tuple(f"a{i}" for i in range(1, 8))
    assert "fixed, because their limits are one value: bolt at 0" in doubtful[0].remarks


def test_a_draft_says_which_joints_it_leaves_and_where(doubtful):
    expected = "left as they are [rad or m]: at 0: pan, slide; at 0.5: nod; at 0.02: grip"
    assert expected in doubtful[0].remarks


def test_limits_in_degrees_are_named(doubtful):
    (line,) = [r for r in doubtful[0].remarks if r.startswith("doubtful: limits")]
    assert "'pan' [-126, 126]" in line
    assert "degrees" in line


def test_a_tool_frame_behind_the_fingertips_is_named(doubtful):
    """The finger ends at 0.185 m, the tool frame is at 0.07 m."""
    draft, file = doubtful
    assert any("('finger') reaches 0.115 m beyond 'tool'" in r for r in draft.remarks)
    assert any(r.startswith("doubtful: the hand ('finger')") for r in draft.remarks)
    (problem,) = quick_problems(file)
    assert "reaches 0.115 m beyond" in problem


def test_a_tool_frame_at_the_fingertips_is_not_doubtful(drafted):
    assert not any(r.startswith("doubtful") for r in drafted[0].remarks)
    assert any("'tool' lies 0.015 m ahead of the hand" in r for r in drafted[0].remarks)


def test_a_finger_as_tool_is_named(tmp_path):
    """Arms of six joints with fingers that turn: the tool moves with one of them."""
    turning = urdf(joints=6).replace('name="grip" type="prismatic"', 'name="grip" type="revolute"')
    other = joint("grip2", "revolute", "arm6", "thumb", (0, -0.02, 0.145), limits=(0.0, 0.5))
    file = tmp_path / "fingers.urdf"
    file.write_text(turning.replace("</robot>", f"{link('thumb')}{other}</robot>"))
    draft = draft_robot(file, "finger", DraftOptions(coarse=True))
    assert draft.robot.arm_joints[-1] == "grip"
    assert any("'grip' of 'finger', is a finger by its name" in r for r in draft.remarks)
    (line,) = [r for r in draft.remarks if "if 'grip' is a finger" in r]
    assert "'arm6' carries 'grip2' beside 'grip'" in line


def test_a_frame_behind_a_fixed_gripper_points_out_of_it(tmp_path):
    """Before, x pointed from the gripper back to the frame at the wrist."""
    text = urdf().replace('name="grip" type="prismatic"', 'name="grip" type="fixed"')
    file = tmp_path / "fixed.urdf"
    file.write_text(text.replace("0 0 0.2", "0 0 0.02"))
    draft = draft_robot(file, "tool", DraftOptions(coarse=True))
    assert draft.robot.frames == ()
    assert any("the last link points along +x of 'tool'" in r for r in draft.remarks)
    assert any(r.startswith("doubtful: the hand") for r in draft.remarks)


def test_a_flange_at_the_last_joint_points_away_from_its_link(tmp_path):
    """As tool0 of Universal Robots: link and joint before it lie behind the frame."""
    text = urdf().replace('name="grip" type="prismatic"', 'name="grip" type="fixed"')
    text = text.replace("0 0 0.12", "0 0 -0.03").replace("0 0.02 0.145", "0 0 -0.05")
    # The wrist's last axis is 0.1 m ahead of the two before.
    text = text.replace('<origin xyz="0.0 0.0 0.0"/><parent link="arm6"/>',
                        '<origin xyz="0.0 0.0 0.1"/><parent link="arm6"/>')  # fmt: skip
    file = tmp_path / "flange.urdf"
    file.write_text(text.replace('"0 0 0.2"', '"0 0 0"'))
    draft = draft_robot(file, "tool", DraftOptions(coarse=True))
    assert any("the last link points along +x of 'tool'" in r for r in draft.remarks)


def test_segments_of_a_telescope_that_are_not_coupled_are_refused(tmp_path):
    """Before, slides along one direction counted as a freedom each."""
    file = tmp_path / "telescope.urdf"
    file.write_text(gantry(telescope=False).replace('xyz="0 0 1"', 'xyz="1 0 0"'))
    message = "'j1' and 'j2' slide along one direction.*Couple them with 'mimic'"
    with pytest.raises(RobotError, match=message):
        draft_robot(file, "tool")


def test_the_arm_does_not_decide_where_the_floor_is(drafted, tmp_path):
    """At zero, an arm that is bolted down may reach below its base."""
    file = tmp_path / "low.urdf"
    wrist = '<origin xyz="0 0 0.12"/><geometry><box size="0.06 0.06 0.05"/>'
    assert wrist in urdf()
    file.write_text(urdf().replace(wrist, wrist.replace("0 0 0.12", "0 0 -2")))
    robot = drafted[0].robot.model_copy(update={"urdf": str(file)})
    assert on_floor(robot)[0] == robot


def test_the_file_keeps_the_folders_of_packages(tmp_path):
    trimesh.creation.box([0.1, 0.1, 0.1]).export(tmp_path / "box.stl")
    (tmp_path / "ws" / "meshes").mkdir(parents=True)
    (tmp_path / "box.stl").rename(tmp_path / "ws" / "meshes" / "box.stl")
    file = tmp_path / "urdf" / "arm.urdf"
    file.parent.mkdir()
    mesh = '<mesh filename="package://meshes/box.stl"/>'
    file.write_text(urdf().replace('<box size="0.1 0.1 0.1"/>', mesh, 1))
    options = DraftOptions(coarse=True, packages=(str(tmp_path / "ws"),))
    draft = draft_robot(file, "tool", options)
    (tmp_path / "mine").mkdir()
    write_draft(draft, tmp_path / "mine" / "arm.yaml")
    assert "packages: [../ws]" in (tmp_path / "mine" / "arm.yaml").read_text()
    moved = tmp_path / "moved"
    moved.mkdir()
    for part in ("mine", "urdf", "ws"):
        (tmp_path / part).rename(moved / part)
    assert load_robot(moved / "mine" / "arm.yaml").model().links.keys() >= {"arm1", "tool"}


@pytest.mark.slow
def test_a_rest_posture_is_found_where_zero_collides(tmp_path):
    """A wall in front of the mast touches the arm at zero."""
    wall = (
        '<link name="wall"><visual><geometry><box size="0.2 0.4 0.4"/></geometry></visual></link>'
    )
    carried = (
        '<joint name="wall_joint" type="fixed"><parent link="mast"/><child link="wall"/>'
        '<origin xyz="0.1 0 1.3"/></joint>'
    )
    file = tmp_path / "walled.urdf"
    file.write_text(urdf().replace("</robot>", f"{wall}{carried}</robot>"))
    draft = draft_robot(file, "tool")
    robot = draft.robot
    assert set(robot.rest) == set(robot.arm_joints)
    write_draft(draft, tmp_path / "mine.yaml")
    robot = load_robot(tmp_path / "mine.yaml")
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    still = robot.with_mimics(robot.joint_positions())
    judge = SelfCollision(robot)
    met = [{frozenset(p) for p in judge.touching(still | arm)} - off for arm in ({}, robot.rest)]
    assert any("wall" in pair for pair in met[0])
    assert not any("wall" in pair for pair in met[1])


def test_the_written_file_has_the_same_content(drafted):
    draft, file = drafted
    robot = load_robot(file)
    assert robot.model() == draft.robot.model()
    same = {"urdf", "primitives", "name"}
    assert robot.model_dump(exclude=same) == draft.robot.model_dump(exclude=same)
    assert robot.load_primitives() == draft.primitives
    # Its URDF is named from where the file lies, so the folder may move.
    assert "urdf: made_up.urdf\n" in file.read_text()


def test_shapes_enclose(drafted):
    assert [found.body for found in enclosure(load_robot(drafted[1])) if found.outside] == []


def test_pairs_that_need_no_check_cannot_meet(drafted):
    """Neighbours or parts of one joint apart, the surfaces of exempt pairs never touch.

    The made-up robot is of boxes, so its hulls are its surfaces.
    """
    robot = load_robot(drafted[1])
    hulls = SelfCollision(robot, hulls=True)
    touching = set().union(*(hulls.touching(q) for q in sample_positions(robot, 500, seed=9)))
    for group in robot.disabled_groups:
        assert len(group.reason) > 10
        if "cannot meet" in group.reason:
            assert not touching & set(group.pairs)
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    met = {frozenset(pair) for pair in touching} - off
    # With the arm bent back, the hand meets mast, base or upper arm: these stay checked.
    assert met


def test_arm_base_may_be_named(path):
    assert draft_robot(path, "tool", DraftOptions(base="base")).robot.arm_base == "mast"
    assert draft_robot(path, "tool", DraftOptions(base="mast")).robot.arm_base == "mast"
    with pytest.raises(RobotError, match="only 4 revolute joints in a row"):
        draft_robot(path, "tool", DraftOptions(base="arm3"))
    with pytest.raises(RobotError, match="base 'head' does not carry"):
        draft_robot(path, "tool", DraftOptions(base="head"))


def test_too_few_joints_are_one_clear_line(tmp_path):
    file = tmp_path / "short.urdf"
    file.write_text(urdf(joints=4))
    found = (
        r"only 4 revolute joints in a row lead \(a1, a2, a3, a4; 'lift' before them is prismatic\)"
        ".*: 2 of the six freedoms of a goal would be missing, and a free.*makes up for one"
    )
    with pytest.raises(RobotError, match=found) as e:
        draft_robot(file, "tool")
    assert "\n" not in str(e.value)


def test_unknown_tool_names_the_nearest(path):
    with pytest.raises(UnknownNameError, match="Did you mean 'tool'"):
        draft_robot(path, "toool")
    with pytest.raises(UnknownNameError, match="Did you mean 'mast'"):
        draft_robot(path, "tool", DraftOptions(base="maast"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "revolute",
            "prismatic",
            r"only 3 revolute joints in a row lead \(a5, a6, a7; 'a4' before them is prismatic",
        ),
        ("revolute", "revolute", r"\(a5, a6, a7; 'a4' before them mimics another\)"),
    ],
    ids=["prismatic", "mimics"],
)
def test_a_joint_that_ends_the_arm_too_soon_is_named(tmp_path, old, new, message):
    mimic = '<mimic joint="a3"/>' if old == new else ""
    file = tmp_path / "short.urdf"
    joint = '<joint name="a4" type="{}">'
    file.write_text(urdf().replace(joint.format(old), joint.format(new) + mimic))
    with pytest.raises(RobotError, match=message):
        draft_robot(file, "tool")


def test_a_tool_with_z_forward_gets_a_frame_with_x_forward(tmp_path):
    file = tmp_path / "z_forward.urdf"
    file.write_text(urdf().replace('rpy="0 -1.5707963267948966 0"', 'rpy="0 0 0"'))
    draft = draft_robot(file, "tool")
    write_draft(draft, tmp_path / "mine.yaml")
    robot = load_robot(tmp_path / "mine.yaml")
    assert robot.tool_frame == "tool_goal"
    assert any("point along +z of 'tool'" in remark for remark in draft.remarks)
    assert fingers_off_axis(robot.model_copy(update={"tool_frame": "tool"})) == "+z"
    assert fingers_off_axis(robot) is None


def test_a_root_above_the_floor_is_mounted(drafted, tmp_path):
    """As the pelvis of a humanoid: the lowest surface stands on the floor."""
    file = tmp_path / "raised.urdf"
    pose = '<origin xyz="0 0 0.15"/><geometry><box size="0.5 0.5 0.3"/>'
    assert pose in urdf()
    file.write_text(urdf().replace(pose, pose.replace("0 0 0.15", "0 0 -0.65")))
    robot = drafted[0].robot.model_copy(update={"urdf": str(file), "standing_bodies": ()})
    mounted, remark = on_floor(robot)
    assert mounted.mount.xyz == (0.0, 0.0, 0.8)
    assert mounted.root_body == mounted.model().root == "floor_link"
    assert mounted.standing_bodies == ("base",)
    assert "0.8 m above the lowest surface" in remark
    assert on_floor(mounted)[0] == mounted
    assert on_floor(drafted[0].robot)[0] == drafted[0].robot


COLLISION = """<collision><geometry><box size="0.05 0.05 0.05"/></geometry></collision>"""


def test_links_may_be_ignored_and_collision_meshes_be_used(tmp_path):
    """Only what is enclosed has shapes, and the file says what is not."""
    file = tmp_path / "partly.urdf"
    whole = '<link name="arm2"><visual>'
    assert whole in urdf()
    file.write_text(urdf().replace(whole, whole.replace("<visual>", COLLISION + "<visual>")))
    options = DraftOptions(collision_meshes=True, ignore=("head", "arm1"))
    steps = []
    draft = draft_robot(file, "tool", options, on_progress=lambda *step: steps.append(step))
    write_draft(draft, tmp_path / "mine.yaml")
    robot = load_robot(tmp_path / "mine.yaml")
    bodies = [shape.body for shape in robot.load_primitives()]
    assert not {"head", "arm1"} & set(bodies)
    (shape,) = [s for s in robot.load_primitives() if s.body == "arm2"]
    assert shape.size == pytest.approx((0.05, 0.05, 0.05), abs=1e-4)
    assert [found.body for found in enclosure(robot) if found.outside] == []
    assert (robot.surfaces, robot.ignored_links) == ("collision", ("head", "arm1"))
    notes = " ".join(draft.remarks)
    assert "visual meshes may protrude" in notes
    assert "nothing is checked against head, arm1" in notes
    # Taking either choice back shows what is not enclosed.
    for change in ({"surfaces": "all"}, {"ignored_links": ()}):
        assert any(found.outside for found in enclosure(robot.model_copy(update=change)))
    done, totals = zip(*steps, strict=True)
    assert list(done) == sorted(done)
    assert done[-1] == totals[-1]
    with pytest.raises(UnknownNameError, match=r"links to ignore.*Did you mean 'head'"):
        draft_robot(file, "tool", DraftOptions(ignore=("hed",)))


def test_a_coarse_fit_has_fewer_shapes_that_enclose(drafted, tmp_path, monkeypatch):
    # A tenth of the usual candidates is enough for a ring.
    monkeypatch.setattr(candidates, "_SEEDS", 30)
    monkeypatch.setattr(candidates, "_CAPSULES", 60)
    ring = trimesh.creation.annulus(0.05, 0.06, 0.1, sections=16)
    ring.export(tmp_path / "ring.stl")
    file = tmp_path / "ring.urdf"
    box = '<box size="0.08 0.08 0.12"/>'
    file.write_text(urdf().replace(box, '<mesh filename="ring.stl"/>', 1))
    robot = drafted[0].robot.model_copy(update={"urdf": str(file)})
    surface = body_triangles(robot.model())["arm2"]
    counts = []
    for coarse in (True, False):
        (shapes,) = (f.fit.primitives for f in fit_robot(robot, coarse=coarse) if f.body == "arm2")
        assert enclosed(shapes, surface).all()
        counts.append(len(shapes))
    assert 1 < counts[0] <= COARSE[ARM].max_shapes < counts[1]


@pytest.mark.slow  # starts processes
def test_processes_do_not_change_the_fit():
    robot = load_robot("ur5")
    assert fit_robot(robot, coarse=True, jobs=2) == fit_robot(robot, coarse=True)


def test_missing_meshes_are_named(tmp_path):
    text = urdf().replace(
        '<box size="0.1 0.1 0.1"/>', '<mesh filename="package://gone/arm.stl"/>', 1
    )
    file = tmp_path / "no_mesh.urdf"
    file.write_text(text)
    with pytest.raises(RobotError, match="package 'gone' is neither installed, nor in ROS"):
        draft_robot(file, "tool")


def test_a_robot_without_any_shape_is_refused(tmp_path):
    file = tmp_path / "bare.urdf"
    file.write_text(urdf().replace("visual>", "ignored>"))
    with pytest.raises(RobotError, match="nothing to check for collisions"):
        draft_robot(file, "tool")


@pytest.mark.slow
def test_flat_parts_get_a_shape(tmp_path):
    flat = tmp_path / "plate.stl"
    flat.write_text(
        "solid plate\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\n"
        "vertex 0 0.1 0\nendloop\nendfacet\nendsolid plate\n"
    )
    file = tmp_path / "plate.urdf"
    box = '<box size="0.08 0.08 0.12"/>'
    file.write_text(urdf().replace(box, '<mesh filename="plate.stl"/>', 1))
    draft = draft_robot(file, "tool")
    assert [shape.body for shape in draft.primitives].count("arm2") == 1


def test_nothing_is_overwritten(drafted, tmp_path):
    draft = drafted[0]
    kept = tmp_path / "mine_primitives.csv"
    kept.write_text("mine")
    with pytest.raises(OutputError, match=r"mine_primitives\.csv' already exists"):
        write_draft(draft, tmp_path / "mine.yaml")
    assert not (tmp_path / "mine.yaml").exists()
    assert kept.read_text() == "mine"
    with pytest.raises(OutputError, match=r"must end in \.yaml"):
        write_draft(draft, tmp_path / "mine.txt")


def test_both_files_or_neither(drafted, tmp_path, monkeypatch):
    def refuse(path, *arguments, **options):
        raise OutputError("disk full")

    monkeypatch.setattr("tcs_shapes.draft.whole_file", refuse)
    with pytest.raises(OutputError, match="disk full"):
        write_draft(drafted[0], tmp_path / "mine.yaml")
    assert list(tmp_path.iterdir()) == []


PANDA = "package://example-robot-data/robots/panda_description/urdf/panda.urdf"


@pytest.mark.slow
def test_the_real_panda_is_drafted(tmp_path):
    draft = draft_robot(PANDA, "panda_hand_tcp")
    write_draft(draft, tmp_path / "mine.yaml")
    robot = load_robot(tmp_path / "mine.yaml")
    assert robot.arm_joints == tuple(f"panda_joint{i}" for i in range(1, 8))
    assert (robot.torso_joint, robot.urdf) == (None, PANDA)
    assert robot.grippers == {"drafted": {"panda_finger_joint1": 0.02}}
    assert not any(found.outside for found in enclosure(robot))
    moved = [found for found in enclosure(robot) if found.body != "panda_link0"]
    assert max(found.excess for found in moved) <= 2.0
