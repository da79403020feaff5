from __future__ import annotations

import itertools
import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tcs.teleop import Command, Teleoperation, load_arm
from tcs.teleop.line import Line
from tcs.teleop.runs.recorder import run_from_steps
from tcs.teleop.runs.run_files import load_run, save_run
from tcs_studies.experiment.course import find_course
from tcs_studies.experiment.trial import line_result
from tcs_studies.output.terminal_tables import line_text

READY_DEG = (0, 34, 0, -80, 0, 57, 0)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A run of the iiwa, 1 s long."""
    arm = load_arm("iiwa7")
    session = Teleoperation(arm, np.radians(READY_DEG))
    command = Command(linear=(0.1, 0.0, 0.0))
    rows = [(command, session.step(command)) for _ in range(100)]
    path = tmp_path_factory.mktemp("run") / "run.csv"
    save_run(
        path,
        run_from_steps(arm, rows, {"robot": "iiwa7", "torso_height": 0.0, "condition": "novel"}),
    )
    return path


def refused(ran, *words):
    """Return whether a command failed with one line that contains these words."""
    return ran.code == 1 and ran.err.count("\n") == 1 and all(word in ran.err for word in words)


def test_an_unknown_robot_is_refused(tcs_command):
    assert refused(tcs_command("teleop", "--robot", "unknown", "--no-browser"), "unknown", "iiwa7")


def test_a_start_beyond_the_limits_is_refused_before_the_page_opens(tcs_command):
    start = (0, 0, 0, 130, 0, 0, 0)
    ran = tcs_command("teleop", "--start-deg", *start, "--no-browser")
    assert refused(ran, "joint 4", "2.2689", "--start-deg")


def test_an_arm_of_six_joints_is_refused(tcs_command, tmp_path):
    import yaml

    models = Path(__file__).resolve().parents[2] / "models" / "robots"
    content = yaml.safe_load((models / "iiwa7.yaml").read_text())
    content["arm_joints"].pop()
    content["name"] = "six"
    for name in ("urdf", "primitives"):
        content[name] = str(models / content[name])
    path = tmp_path / "six.yaml"
    path.write_text(yaml.safe_dump(content))
    assert refused(tcs_command("teleop", "--robot", path, "--no-browser"), "six.yaml", "arm_joints")


@pytest.mark.parametrize("name", ["run.txt", "none/run.csv"])
def test_a_run_that_cannot_be_written_is_refused_before_the_page_opens(tcs_command, tmp_path, name):
    ran = tcs_command("teleop", "--save", tmp_path / name, "--no-browser")
    assert refused(ran, str(tmp_path / name))


def test_options_of_the_live_page_are_refused_before_a_command(tcs_command, saved):
    ran = tcs_command("teleop", "--robot", "pr2", "replay", saved)
    assert ran.code == 2
    assert "live page" in ran.err


def test_an_occupied_port_is_refused(tcs_command):
    with socket.socket() as taken:
        taken.bind(("localhost", 0))
        taken.listen()
        port = taken.getsockname()[1]
        ran = tcs_command("teleop", "--port", port, "--no-browser", "--duration", 0)
    assert refused(ran, f"port {port}")


def test_nothing_is_written_without_a_connected_browser(tcs_command, tmp_path):
    path = tmp_path / "run.csv"
    ran = tcs_command("teleop", "--no-browser", "--duration", 0.2, "--save", path)
    assert ran.code == 0
    assert "no browser was connected" in ran.err
    assert "control steps: median" in ran.err
    assert list(tmp_path.iterdir()) == []


def test_a_run_is_written_as_a_page(tcs_command, saved, tmp_path):
    page = tmp_path / "run.html"
    ran = tcs_command("teleop", "replay", saved, "--export", page, "--json")
    assert ran.code == 0
    assert ran.json["bytes"] == page.stat().st_size < 5e6
    assert ran.json["samples"] == 100
    assert "controller novel" in page.read_text()


def test_a_page_of_another_name_is_not_written(tcs_command, saved, tmp_path):
    page = tmp_path / "run.pdf"
    ran = tcs_command("teleop", "replay", saved, "--export", page)
    assert refused(ran, "run.pdf", ".html")
    assert not page.exists()


@pytest.mark.parametrize(("robot", "height"), [("tiago", "99"), ("tiago", "nan"), ("iiwa7", "0.1")])
def test_a_torso_height_out_of_range_is_refused(tcs_command, robot, height):
    ran = tcs_command(
        "teleop", "--robot", robot, "--torso-height", height, "--no-browser", "--duration", 0.1
    )
    assert refused(ran, robot, height, "out of range")


def test_a_run_is_played_back(tcs_command, saved):
    ran = tcs_command("teleop", "replay", saved, "--no-browser", "--duration", 0.2)
    assert ran.code == 0
    assert "100 samples; controller novel" in ran.out
    assert "http://localhost:" in ran.err


def test_runs_that_cannot_be_played_are_refused(tcs_command, saved, tmp_path):
    broken = tmp_path / "broken.csv"
    broken.write_text("time,x\n0,1\n")
    unnamed = tmp_path / "unnamed.csv"
    unnamed.write_text(saved.read_text().replace('""robot""', '""belongs to""'))
    misplaced = tmp_path / "misplaced.csv"
    misplaced.write_text(
        saved.read_text().replace('""torso_height"": 0.0', '""torso_height"": ""up""')
    )
    assert refused(tcs_command("teleop", "replay", tmp_path / "none.csv"), "none.csv")
    assert refused(tcs_command("teleop", "replay", broken), "broken.csv", "missing")
    assert refused(tcs_command("teleop", "replay", unnamed), "unnamed.csv", "--robot")
    assert refused(tcs_command("teleop", "replay", misplaced), "misplaced.csv", "'up'")
    ran = tcs_command("teleop", "replay", saved, "--robot", "panda")
    assert refused(ran, saved.name, "panda", "--robot")


def test_meshes_and_json_are_for_pages_only(tcs_command, saved):
    for option in ("--meshes", "--json"):
        ran = tcs_command("teleop", "replay", saved, option)
        assert ran.code == 2
        assert "--export" in ran.err


@contextmanager
def connected_browser(page):
    """Send messages as the page does."""
    left = threading.Event()

    def send():
        for number in itertools.count(1):
            message = {"page": "test", "number": number, "held": [], "clicks": {}}
            try:
                urllib.request.urlopen(f"{page}link", json.dumps(message).encode()).close()
            except OSError:
                return
            if left.wait(0.05):
                return

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        left.set()
        thread.join()


@contextmanager
def live_page(*words):
    """A live page in a separate process, and its address."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    code = "from tcs.cli import main; main()"
    words = ("teleop", "--no-browser", "--port", port, *words)
    with subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as running:  # fmt: skip
        for line in running.stderr:
            if "open http" in line:
                break
        yield running, re.search(r"open (http\S+)", line)[1]


@pytest.mark.slow
def test_ctrl_c_writes_the_run(tmp_path):
    path = tmp_path / "run.csv"
    with live_page("--save", path, "--start-deg", *READY_DEG) as (running, page):
        with connected_browser(page):
            time.sleep(1.5)
            running.send_signal(signal.SIGINT)
            running.wait(30)
        stderr = running.stderr.read()
    assert running.returncode == 0
    assert "closed after" in stderr
    run = load_run(path)
    assert len(run) > 20
    assert run.metadata["robot"] == "iiwa7"
    np.testing.assert_allclose(run.joints[0], np.radians(READY_DEG), atol=1e-9)
    assert [one.name for one in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.slow
def test_the_line_is_stored_in_the_run(tmp_path):
    path = tmp_path / "run.csv"
    with live_page("--line", "--save", path, "--duration", 3) as (running, page):
        with connected_browser(page):
            out = running.communicate(timeout=60)[0]
    assert running.returncode == 0
    course = find_course(load_arm("iiwa7"))
    # The arm was not moved: the whole line remains.
    left = np.linalg.norm(np.subtract(course.line.end, course.line.start))
    assert f"not reached: {1e3 * left:.0f} mm remain" in out
    run = load_run(path)
    assert run.metadata["line_end"] == pytest.approx(course.line.end)
    np.testing.assert_allclose(run.joints[0], course.joints, atol=1e-9)


def test_the_accuracy_along_a_line_is_reported():
    arm = load_arm("iiwa7")
    session = Teleoperation(arm, np.radians(READY_DEG))
    start = session.step().p
    line = Line(tuple(start), (start[0], start[1] + 0.2, start[2]))
    command = Command(linear=(0.0, 0.1, 0.0))
    # Two seconds of waiting and an earlier attempt are not part of the result.
    commands = [Command()] * 200 + [Command(linear=(0.1, 0.0, 0.0))] * 100
    rows = [(one, session.step(one)) for one in commands]
    session.place(np.radians(READY_DEG))
    rows += [(one, session.step(one)) for one in [Command()] * 50 + [command] * 190]
    text = line_text(line_result(run_from_steps(arm, rows, {}), line))
    # 0.18 m to the sphere at 0.1 m/s, and some time to speed up.
    seconds = float(text.split("took ")[1].split(" s")[0])
    assert 1.8 <= seconds <= 1.9
    worst = float(text.split("was ")[1].split(" mm")[0])
    # The last plane that is crossed has samples on one side only, up to 5 mm away.
    assert worst < 5.0


def test_a_line_excludes_a_start_posture(tcs_command):
    ran = tcs_command("teleop", "--line", "--start-deg", *READY_DEG, "--no-browser")
    assert ran.code == 2


@pytest.mark.parametrize("condition", ["end-effector", "novel", "assisted", "drake", "joint"])
def test_every_condition_opens(tcs_command, condition):
    ran = tcs_command(
        "teleop", "--condition", condition, "--start-deg", *READY_DEG, "--no-browser",
        "--duration", 0.1,
    )  # fmt: skip
    assert ran.code == 0
    assert f", {condition}, limits as in clamped" in ran.err


def test_the_work_in_a_run_is_divided_into_phases(tcs_command, saved, tmp_path):
    picture = tmp_path / "work.svg"
    assert refused(tcs_command("teleop", "work", saved), "no line", "--line --save")
    arm = load_arm("iiwa7")
    session = Teleoperation(arm, np.radians(READY_DEG))
    rng = np.random.default_rng(0)
    commands = [Command(linear=(0.1, *(0.01 * rng.normal(size=2)))) for _ in range(150)]
    rows = [(command, session.step(command)) for command in commands]
    ends = {"line_start": rows[0][1].p.tolist(), "line_end": rows[-1][1].p.tolist()}
    save_run(tmp_path / "line.csv", run_from_steps(arm, rows, ends))
    ran = tcs_command("teleop", "work", tmp_path / "line.csv", "--picture", picture, "--json")
    assert ran.code == 0
    assert ran.json["solution"] is None
    assert ran.json["phases"]["start"]["work"] == pytest.approx(ran.json["work"])
    assert ran.json["phases"]["solution"] == {"seconds": 0.0, "work": 0.0, "steps": 0}
    assert picture.read_text().startswith("<?xml")
    assert "did not stop" in tcs_command("teleop", "work", tmp_path / "line.csv").out


def test_xr_opens_the_page_of_the_operator(tcs_command):
    words = ["--start-deg", *READY_DEG, "--no-browser", "--duration", 0.1]
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    ran = tcs_command("teleop", *words, "--xr", "--port", port)
    assert ran.code == 0
    assert f"open http://localhost:{port}/" in ran.err


def test_latency_is_stated_and_its_range_checked(tcs_command):
    words = ["teleop", "--start-deg", *READY_DEG, "--no-browser", "--duration", 0.1]
    ran = tcs_command(*words, "--latency", 0.3, "--latency-of", "command")
    assert ran.code == 0
    assert "latency: 0.3 s for commands." in ran.err
    assert "latency:" not in tcs_command(*words).err
    for latency in (11, -0.1, "nan"):
        assert tcs_command(*words, "--latency", latency).code == 2
