"""`tcs teleop`: what it writes, and what it refuses."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest


def test_unknown_robots_are_refused_in_a_line(tcs_command, tmp_path):
    ran = tcs_command("teleop", "experiment", "--robot", "iwa7", "--out", tmp_path / "out")
    assert ran.code == 1
    assert "Did you mean 'iiwa7'?" in ran.err
    assert list(tmp_path.iterdir()) == []


def test_maps_of_a_robot_without_a_head_are_refused_before_the_work(tcs_command, tmp_path):
    ran = tcs_command("teleop", "experiment", "--maps", "--out", tmp_path / "out")
    assert ran.code == 1
    assert "'iiwa7': no head" in ran.err


@pytest.mark.parametrize(("robot", "height"), [("tiago", 2.0), ("tiago", "nan"), ("iiwa7", 0.1)])
def test_a_torso_height_out_of_range_is_refused(tcs_command, tmp_path, robot, height):
    words = ["--robot", robot, "--lift", height, "--out", tmp_path / "out"]
    ran = tcs_command("teleop", "experiment", *words)
    assert ran.code == 1
    assert "is out of range; its torso goes from" in ran.err


@pytest.mark.parametrize(
    ("option", "count"),
    [("--operators", 2), ("--operators", 10**12), ("--trials", 10**12), ("--training", 10**12)],
)
def test_fewer_or_more_than_can_be_run_are_a_misuse(tcs_command, tmp_path, option, count):
    ran = tcs_command("teleop", "experiment", option, count, "--out", tmp_path)
    assert ran.code == 2
    assert option in ran.err


def test_a_folder_that_cannot_be_made_is_refused_before_the_work(tcs_command, tmp_path):
    (tmp_path / "file").write_text("")
    ran = tcs_command("teleop", "experiment", "--out", tmp_path / "file" / "out")
    assert ran.code == 1
    assert "cannot be created" in ran.err


@pytest.mark.slow
def test_a_small_experiment(tcs_command, tmp_path):
    words = ["--operators", 3, "--training", 1, "--trials", 1, "--jobs", 1, "--runs"]
    ran = tcs_command("teleop", "experiment", *words, "--out", tmp_path / "out", "--json")
    assert ran.code == 0
    result = ran.json
    assert result["scripted"] is True
    assert set(result["medians"]) == {"end-effector", "novel", "assisted"}
    assert result["tests"]["accuracy"]["count"] == 3
    assert result["maps"] is None
    for name in ("experiment.html", "experiment.md", "trials.csv", "line.json"):
        assert (tmp_path / "out" / name).stat().st_size > 100
    assert len(list((tmp_path / "out" / "runs").glob("*.csv"))) == 9
    with (tmp_path / "out" / "trials.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 18
    times = [
        float(r["time"]) for r in rows if r["controller"] == "novel" and r["training"] == "False"
    ]
    assert sorted(times)[1] == pytest.approx(result["medians"]["novel"]["time"])
    ran = tcs_command("teleop", "experiment", *words[:-1], "--out", tmp_path / "again")
    assert ran.code == 0
    assert "3 scripted operators, not people" in ran.out


SHORT = ("--operators", 1, "--repetitions", 1, "--training", 0, "--jobs", 1)


def test_pick_and_place_prints_the_measures_of_each_base_pose(tcs_command):
    words = ["--condition", "ITCM-high", "--base", 0.7, 0.1, 5]
    ran = tcs_command("teleop", "pick-and-place", *SHORT, *words, "--json")
    assert ran.code == 0
    assert set(ran.json["conditions"]) == {"ITCM-high", "given"}
    one = ran.json["conditions"]["given"]
    assert set(one["tct"]) == {"mean", "std"}
    assert {"tct", "csa", "cst", "sal", "failures"} <= set(one)
    assert ran.json["files"] == []


@pytest.mark.slow
def test_pick_and_place_writes_page_table_and_pictures(tcs_command, tmp_path):
    words = ["--operators", 3, "--repetitions", 1, "--training", 0]
    ran = tcs_command("teleop", "pick-and-place", *words, "--out", tmp_path / "out", "--json")
    assert ran.code == 0
    assert set(ran.json["variance"]) >= {"tct", "csa"}
    assert all(Path(name).stat().st_size > 100 for name in ran.json["files"])
    with (tmp_path / "out" / "repetitions.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["part"] == "experiment"]
    times = [float(row["tct"]) for row in rows if row["condition"] == "Expert" and row["tct"]]
    mean = ran.json["conditions"]["Expert"]["tct"]["mean"]
    assert sum(times) / len(times) == pytest.approx(mean)
    page = (tmp_path / "out" / "pick-and-place.md").read_text()
    assert "scripted operators, not people" in page


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["--operators", 0], 2, "--operators"),
        (["--condition", "Exprt"], 1, "Did you mean 'Expert'?"),
        (["--base", 0.2, 0, 0], 1, "Move the base away from the table."),
        (["--base", "nan", 0, 0], 1, "base pose 'given'"),
        (["--latency", 11], 2, "--latency"),
    ],
)
def test_pick_and_place_refuses_in_a_line(tcs_command, tmp_path, words, code, text):
    ran = tcs_command("teleop", "pick-and-place", *words, "--out", tmp_path / "out")
    assert ran.code == code
    assert list(tmp_path.iterdir()) == []
    assert text in ran.err
    if code == 1:
        assert len(ran.err.strip().splitlines()) == 1
