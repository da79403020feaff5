"""The commands on capability maps."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tcs.capability import load_map
from tcs.files.paths import data_folder
from tcs.perception import Located, PlanarPose

COARSE = ("--step", 0.1, "--yaw-bins", 8, "--torso-height", 0.15)
COARSER = ("--step", 0.2, "--yaw-bins", 4, "--torso-height", 0.15)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A map made on the command line, and the output."""
    from typer.testing import CliRunner

    from tcs.cli.app import app

    path = tmp_path_factory.mktemp("maps") / "ihcm.tcm"
    words = ["capability", "from-ik", "--out", path, "--text", path.with_suffix(".txt"), *COARSE]
    result = CliRunner().invoke(app, [*map(str, words)])
    assert result.exit_code == 0
    return path, result.stdout


def test_from_ik_writes_a_map_and_its_text(made):
    path, output = made
    capability = load_map(path)
    assert f"{len(capability.cells):,} cells" in output
    lines = path.with_suffix(".txt").read_text().splitlines()
    assert len(lines) == len(capability.cells)
    assert len(lines[0].split()) == 13


def test_merge_prints_best_and_worst_and_writes_every_base_pose(made, tcs_command, tmp_path):
    table = tmp_path / "poses.csv"
    ran = tcs_command(
        "capability", "merge", made[0], "--task", "pick-and-place", "--height", 0.65,
        "--length", 0.2, "--pre-grasp", 0.1, "--out", table, "--json",
    )  # fmt: skip
    result = ran.json
    with table.open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == result["base_poses"] > 0
    scores = [float(row["score"]) for row in rows]
    assert result["best"]["score"] == pytest.approx(max(scores))
    assert result["worst"]["score"] == pytest.approx(min(scores))
    best = rows[int(np.argmax(scores))]
    assert float(best["yaw_deg"]) == pytest.approx(result["best"]["yaw_deg"])
    assert result["position_offset"] == 0.0


@pytest.mark.parametrize("ending", ["png", "svg", "html"])
def test_merge_draws(made, tcs_command, tmp_path, ending):
    picture = tmp_path / f"task.{ending}"
    ran = tcs_command(
        "capability", "merge", made[0], "--task", "curved", "--length", 0.3, "--samples", 2,
        "--height", 0.85, "--picture", picture,
    )  # fmt: skip
    assert ran.code == 0, ran.err
    assert picture.stat().st_size > 10_000
    assert "best" in ran.out


@pytest.mark.parametrize("ending", ["png", "html"])
def test_show_draws_a_layer(made, tcs_command, tmp_path, ending):
    picture = tmp_path / f"map.{ending}"
    assert tcs_command("capability", "show", made[0], "--out", picture).code == 0
    assert picture.stat().st_size > 10_000
    ran = tcs_command("capability", "show", made[0], "--out", picture, "--height", 3.0)
    assert ran.code == 1
    assert "no base pose for a tool at 3 m; its heights are" in ran.err
    assert (
        "unknown tilt '7'"
        in tcs_command("capability", "show", made[0], "--out", picture, "--tilt", 7).err
    )


def test_an_environment_makes_base_poses_infeasible(made, tcs_command, tmp_path):
    task = ("--task", "linear", "--length", 0.2, "--samples", 2, "--height", 0.65)
    best = tcs_command("capability", "merge", made[0], *task, "--json").json["best"]
    environment = tmp_path / "post.yaml"
    environment.write_text(
        "based_on: wheelchair\nname: post\nmodels: []\nbody_frames: {}\npadding: {}\njoints: {}\n"
        "errors: {}\nobstacles:\n- name: post\n  box: [0.1, 0.1, 1.0]\n"
        f"  xyz: [{best['x'] + 1.0}, {best['y']}, 0.5]\n"
    )
    ran = tcs_command(
        "capability",
        "merge",
        made[0],
        *task,
        "--environment",
        environment,
        "--task-at",
        1,
        0,
        0,
        "--json",
    )
    assert ran.json["best"] == best
    assert ran.json["rejected"] >= 1
    assert ran.json["best_in_environment"]["score"] <= best["score"]
    judged = ("--judge", best["x"] + 3.0, 0.0, 0.0, "--error-samples", 20, "--task-error", 0.02)
    words = ("capability", "merge", made[0], *task, *judged)
    ran = tcs_command(*words, "--environment", environment, "--task-at", 1, 0, 0, "--json")
    found, far = ran.json["success"]
    assert found["base"] == ran.json["best_in_environment"]
    assert (found["samples"], far["complete"], far["positions"]) == (20, 0.0, 0.0)
    assert 0.0 < found["complete"] <= found["positions"] <= 1.0
    assert "score" not in far["base"]
    assert tcs_command(*words).code == 2
    words = (*words[:-1], -0.02, "--environment", environment)
    ran = tcs_command(*words)
    assert ran.code == 1
    assert ran.err.startswith("tcs: errors: task_position")


def test_merge_at_a_located_task(tcs_command, made, tmp_path):
    path = tmp_path / "table.json"
    Located("thesis", PlanarPose(1.0, 0.2, 0.1), np.diag([0.02, 0.02, 0.02]) ** 2).save(path)
    words = ("capability", "merge", made[0], "--task", "pick-and-place", "--height", 0.65)
    result = tcs_command(*words, "--located", path, "--json").json
    best = result["best_under_error"]
    assert best["expected_score"] <= best["score"]
    assert 0.0 < best["feasible"] <= 1.0
    base = PlanarPose(best["x"], best["y"], np.radians(best["yaw_deg"]))
    assert result["drive_to"] == pytest.approx((PlanarPose(1.0, 0.2, 0.1) @ base).to_json())
    assert "drive to x" in tcs_command(*words, "--located", path).out


def test_split_gives_stops_in_order(made, tcs_command):
    ran = tcs_command(
        "capability", "merge", made[0], "--task", "linear", "--length", 2.0, "--samples", 5,
        "--height", 0.65, "--split", "--json",
    )  # fmt: skip
    stops = ran.json["stops"]
    assert [i for stop in stops for i in stop["positions"]] == [0, 1, 2, 3, 4]
    assert len(stops) > 1


def test_no_base_pose_for_all_is_one_line_and_exit_code_1(made, tcs_command):
    ran = tcs_command(
        "capability", "merge", made[0], "--task", "linear", "--length", 2.0, "--samples", 5,
        "--height", 0.65,
    )  # fmt: skip
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "no base pose reaches all 5 positions; best subset:" in ran.err


def test_record_from_a_simulated_operator_and_from_its_csv(tcs_command, tmp_path):
    arm = tmp_path / "arm.csv"
    options = ("--torso-height", 0.15, "--height", 0.6)
    one, two = tmp_path / "one.tcm", tmp_path / "two.tcm"
    first = tcs_command(
        "capability", "record", "--out", one, *options, "--seconds", 30, "--save-csv", arm,
        "--seed", 3, "--json",
    ).json  # fmt: skip
    second = tcs_command("capability", "record", arm, "--out", two, *options, "--json").json
    assert first["samples"] == second["samples"] == 1500
    assert first["cells"] == second["cells"] > 5
    np.testing.assert_array_equal(load_map(one).cells, load_map(two).cells)
    output = tcs_command("capability", "record", arm, "--out", two, *options).out
    assert "yaw " in output
    assert "1,500 samples" in output


def test_a_csv_of_another_robot_is_one_line(tcs_command, tmp_path):
    arm = tmp_path / "arm.csv"
    arm.write_text("elbow,wrist\n0,0\n")
    ran = tcs_command("capability", "record", arm, "--out", tmp_path / "m.tcm")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "joint names do not match robot 'tiago'" in ran.err
    assert not (tmp_path / "m.tcm").exists()


def test_from_bag(tcs_command, tmp_path):
    pytest.importorskip("rosbags")
    from tests.capability.test_bags import write_bag
    from tests.capability.test_recording import LISTING, NAMES

    bag = write_bag(tmp_path / "arm.bag", [(NAMES, LISTING)])
    out = tmp_path / "m.tcm"
    ran = tcs_command("capability", "from-bag", bag, "--out", out, "--grasps", "all", "--json")
    assert ran.json["cells"] == 1
    ran = tcs_command("capability", "from-bag", bag, "--out", out, "--topic", "/none")
    assert ran.code == 1
    assert "has no joint states on topic '/none'" in ran.err


def test_map_check_with_and_without_a_map(made, tcs_command):
    ran = tcs_command("map-check", made[0], "--queries", 2000, "--json")
    stored = ran.json["grasps"]
    assert set(stored) == {"side", "top"}
    planned = tcs_command(
        "map-check", *COARSE, "--grasps", "side", "--queries", 2000, "--json"
    ).json["grasps"]
    assert planned["side"] == stored["side"]
    assert "accuracy" in tcs_command("map-check", made[0], "--queries", 200).out


def test_map_check_refuses_recorded_maps(tcs_command, tmp_path):
    path = tmp_path / "itcm.tcm"
    recorded = ("--seconds", 10, "--torso-height", 0.15, "--height", 0.6)
    assert tcs_command("capability", "record", "--out", path, *recorded).code == 0
    ran = tcs_command("map-check", path)
    assert ran.code == 1
    assert "was recorded or imported" in ran.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("from-ik", "--kind", "ITCM"), "unknown map type 'ITCM'"),
        (("from-ik", "--grasps", "left"), "unknown set of grasps 'left'"),
        (("from-ik", "--tool", "hand"), "unknown tool frame 'hand'"),
        (("from-ik", "--lift", 2), "torso height 2 m is out of range"),
        (("from-ik", "--step", 0), "step of the map is 0.0 m"),
        (
            ("record", "--seconds", 0),
            "its length is 0 s, but a length of a recording must be 0.02 to",
        ),
    ],
)
def test_invalid_options_are_one_line(words, message, tcs_command, tmp_path):
    ran = tcs_command("capability", *words, "--out", tmp_path / "m.tcm")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert message in ran.err


def test_an_unknown_task_or_file_is_one_line(made, tcs_command, tmp_path):
    ran = tcs_command("capability", "merge", made[0], "--task", "pour", "--height", 0.5)
    assert (ran.code, ran.err.count("\n")) == (1, 1)
    assert "unknown task 'pour'. Known: curved, linear, pick-and-place." in ran.err
    ran = tcs_command("capability", "show", tmp_path / "none.tcm", "--out", tmp_path / "a.png")
    assert ran.code == 1
    assert "Capability map" in ran.err


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A user-defined robot file, and a map made with it."""
    from typer.testing import CliRunner

    from tcs.cli.app import app

    folder = tmp_path_factory.mktemp("own")
    robot, path = folder / "mine.yaml", folder / "icm.tcm"
    robot.write_text("based_on: tiago\nname: mine\n")
    words = ["from-ik", "--robot", robot, "--kind", "ICM", "--out", path, *COARSE]
    assert CliRunner().invoke(app, ["capability", *map(str, words)]).exit_code == 0
    return robot, path


IN_AN_ENVIRONMENT = ("--task", "pick-and-place", "--height", 0.65, "--environment", "wheelchair")
FAR_AWAY = ("--task-at", 6.0, 6.0, 0.0)


@pytest.fixture
def moved(own, tmp_path):
    """The map, and its robot file, moved."""
    robot, path = own
    elsewhere = tmp_path / "elsewhere.yaml"
    robot.rename(elsewhere)
    yield elsewhere, path
    elsewhere.rename(robot)


def test_a_map_stores_the_path_of_the_robot_file(own, tcs_command, tmp_path):
    robot, path = own
    assert load_map(path).metadata["robot"] == str(robot)
    assert set(tcs_command("map-check", path, "--queries", 300, "--json").json["grasps"]) == {
        "side", "top",
    }  # fmt: skip
    ran = tcs_command("capability", "merge", path, *IN_AN_ENVIRONMENT, *FAR_AWAY, "--json")
    assert ran.json["best_in_environment"] == ran.json["best"]
    picture = tmp_path / "map.svg"
    assert tcs_command("capability", "show", path, "--out", picture).code == 0


def test_the_head_option(own, tcs_command, tmp_path):
    robot, _ = own
    out, plain = tmp_path / "own.tcm", tmp_path / "tiago.tcm"
    ran = tcs_command("capability", "from-ik", "--robot", robot, "--out", out, *COARSER)
    assert ran.code == 1
    assert "'mine': no head file ships for it, only for pr2, tiago" in ran.err
    assert ran.err.count("\n") == 1
    head = tmp_path / "head.yaml"
    shipped = data_folder() / "models" / "heads" / "tiago.yaml"
    head.write_text(shipped.read_text().replace("fov_deg: 58", "fov_deg: 20"))
    seen = {}
    for name, words in (("mine", ("--robot", robot, "--head", "tiago")), ("tiago", ())):
        path = out if words else plain
        assert tcs_command("capability", "from-ik", *words, "--out", path, *COARSER).code == 0
        seen[name] = load_map(path).visibility
    np.testing.assert_array_equal(seen["mine"], seen["tiago"])
    assert tcs_command("capability", "from-ik", "--head", head, "--out", out, *COARSER).code == 0
    # A camera with a narrower view, which changes nothing straight ahead.
    narrow = load_map(out).visibility
    assert (narrow <= seen["tiago"]).all()
    assert (narrow < seen["tiago"]).any()


def test_a_robot_file_that_has_moved(moved, tcs_command):
    elsewhere, path = moved
    for words in (
        ("map-check", path),
        ("capability", "merge", path, *IN_AN_ENVIRONMENT, *FAR_AWAY),
    ):
        ran = tcs_command(*words)
        assert ran.code == 1
        assert ran.err.count("\n") == 1
        assert "Name its file with --robot FILE" in ran.err
        assert tcs_command(*words, "--robot", elsewhere).code == 0


def test_map_check_refuses_another_robot(own, tcs_command, tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text("based_on: tiago\nname: mine\nlimits: hard\n")
    ran = tcs_command("map-check", own[1], "--robot", other)
    assert ran.code == 1
    assert "another model of robot" in ran.err


def test_the_old_option_names_work(tcs_command, tmp_path):
    path = tmp_path / "icm.tcm"
    old = ("--step", 0.2, "--turns", 4, "--lift", 0.15, "--kind", "ICM", "--grasps", "side")
    assert tcs_command("capability", "from-ik", "--out", path, *old).code == 0
    capability = load_map(path)
    assert (capability.grid.yaw_bins, capability.torso_height) == (4, 0.15)
    assert capability.map_type == "ICM"
    ran = tcs_command("map-check", *old[:6], "--grasps", "side", "--queries", 100, "--json")
    assert ran.json["yaw_bins"] == 4


@pytest.mark.parametrize("ending", ["png", "html"])
@pytest.mark.parametrize("height", ["nan", "inf", "-inf", "1e300", "-1e300", "99999999999"])
def test_show_refuses_odd_heights_in_one_line(made, tcs_command, tmp_path, height, ending):
    picture = tmp_path / f"map.{ending}"
    ran = tcs_command("capability", "show", made[0], "--out", picture, "--height", height)
    assert (ran.code, ran.err.count("\n")) == (1, 1)
    assert "height" in ran.err or "no base pose for a tool at" in ran.err
    assert not picture.exists()


@pytest.mark.parametrize("tilt", ["2", "99999999999999999999999"])
def test_show_refuses_odd_tilts_in_one_line(made, tcs_command, tmp_path, tilt):
    for ending in ("png", "html"):
        out = tmp_path / f"map.{ending}"
        ran = tcs_command("capability", "show", made[0], "--out", out, "--tilt", tilt)
        assert (ran.code, ran.err.count("\n")) == (1, 1)
        assert f"unknown tilt '{tilt}'. Known: 0, 1." in ran.err


def test_show_refuses_odd_files_in_one_line(made, tcs_command, tmp_path):
    empty, text = tmp_path / "empty.tcm", tmp_path / "text.tcm"
    empty.write_bytes(b"")
    text.write_text("not a map")
    picture = tmp_path / "map.png"
    for path in (empty, text, tmp_path, tmp_path / "none.tcm"):
        ran = tcs_command("capability", "show", path, "--out", picture)
        assert (ran.code, ran.err.count("\n")) == (1, 1), path
        assert "Capability map" in ran.err
    for out in (tmp_path, tmp_path / "none" / "map.html", tmp_path / "map.xyz", tmp_path / ".html"):
        ran = tcs_command("capability", "show", made[0], "--out", out)
        assert ran.code in (0, 1), out
        assert ran.err.count("\n") == ran.code, out
