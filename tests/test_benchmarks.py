from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from tcs.placement.scoring import load_job
from tests.reference.kinematics import link_poses

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"
WITHOUT_PEERS = """
import runpy, sys
# Python reads None as "there is no such module".
sys.modules.update(eaik=None, trac_ik=None, pinocchio=None)
sys.argv = sys.argv[1:]
sys.path.insert(0, {folder!r})
runpy.run_path({script!r}, run_name="__main__")
"""


@pytest.fixture
def module(monkeypatch):
    """Import a script's module by its plain name, as the scripts do, and forget it afterwards."""
    monkeypatch.syspath_prepend(str(FOLDER))
    yield importlib.import_module
    for path in FOLDER.glob("*.py"):
        sys.modules.pop(path.stem, None)


@pytest.fixture(scope="module")
def chain():
    job = load_job("shaving", "wheelchair", "pr2", paper=True)
    return job.lowered(job.scene()).arrays.chain


def refused_or_told(main, monkeypatch, *words: str) -> int:
    """Run a script that ends with its command line; return the exit code."""
    monkeypatch.setattr(sys, "argv", list(words))
    with pytest.raises(SystemExit) as left:
        main()
    return left.value.code


def peers(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run peers.py on a machine without any of the optional peers."""
    program = WITHOUT_PEERS.format(folder=str(FOLDER), script=str(FOLDER / "peers.py"))
    command = [sys.executable, "-c", program, "peers.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "script",
    [
        *(
            "campaign.py",
            "scale.py",
            "faults.py",
            "freedom.py",
            "live.py",
            "numeric_arms.py",
            "robots.py",
            "rows.py",
            "run.py",
        ),
        *("constraints.py", "motion.py", "planning.py", "selection.py", "teleop.py"),
    ],
)
def test_each_script_describes_its_usage(module, monkeypatch, capsys, script):
    assert refused_or_told(module(Path(script).stem).main, monkeypatch, script, "--help") == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert f"usage: {script}" in printed.out


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--help"], 0, "--problems"),
        (["--peers", "eaik,moveit"], 2, "'moveit' is unknown; there are drake, eaik, tracik"),
        (["--problems", "1"], 2, "--problems must be 2 or more"),
    ],
)
def test_the_command_line_is_checked_before_anything_is_built(
    module, monkeypatch, capsys, arguments, code, said
):
    for package in ("eaik", "trac_ik", "pinocchio"):
        monkeypatch.setitem(sys.modules, package, None)
    assert refused_or_told(module("peers").main, monkeypatch, "peers.py", *arguments) == code
    printed = capsys.readouterr()
    assert said in printed.out + printed.err


@pytest.mark.parametrize("package", ["eaik", "trac_ik", "pinocchio"])
def test_an_absent_peer_is_skipped_with_a_line(module, monkeypatch, capsys, package):
    monkeypatch.setitem(sys.modules, package, None)
    script = module("peers")
    kinds = dict(zip(("eaik", "trac_ik", "pinocchio"), script.OPTIONAL.values(), strict=True))
    assert script.made(*kinds[package], None) == []
    printed = capsys.readouterr().out
    assert printed.startswith(kinds[package][0])
    assert "skipped: " in printed
    assert printed.count("\n") == 1


def test_a_peer_that_cannot_solve_the_arm_gives_the_reason(module, capsys):
    script = module("peers")

    def refuse(chain):
        raise module("peer_arms").UnfitArmError("no closed form")

    assert script.made("EAIK", refuse, None) == []
    assert re.fullmatch(r"EAIK +skipped: no closed form\n", capsys.readouterr().out)


def test_the_exported_urdf_is_the_arm(module, chain):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(module("peer_arms").urdf(chain), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("arm_base"))
    plant.Finalize()
    # The URDF says "continuous" by leaving the limits out.
    np.testing.assert_array_equal(plant.GetPositionLowerLimits(), chain.lower)
    np.testing.assert_array_equal(plant.GetPositionUpperLimits(), chain.upper)
    context = plant.CreateDefaultContext()
    for q in np.random.default_rng(0).uniform(-3.0, 3.0, (5, 7)):
        plant.SetPositions(context, q)
        X = plant.GetFrameByName("tool").CalcPoseInWorld(context)
        R, p = link_poses(chain, q)[-1]
        # Eight rotations written as angles: some roundings of 1e-16 each.
        np.testing.assert_allclose(X.rotation().matrix(), R, atol=1e-14)
        np.testing.assert_allclose(X.translation(), p, atol=1e-14)


def test_angles_are_turned_to_their_limits(module):
    turned = module("peer_problems").turned
    lower, upper = np.array([-1.0, 5.0, -np.inf]), np.array([1.0, 7.0, np.inf])
    q = turned(np.array([6.0, 0.0, 7.0]), lower, upper)
    # One turn is subtracted or added: one rounding.
    np.testing.assert_allclose(q, np.array([6.0, 0.0, 7.0]) + 2 * np.pi * np.array([-1, 1, -1]))


@pytest.mark.slow
def test_a_small_run_prints_every_part():
    done = peers("--problems", "4", "--repeats", "1")
    assert done.returncode == 0, done.stderr
    texts: dict[str, list[str]] = {}
    for line in done.stdout.splitlines():
        # Columns are two spaces or more apart, and names may be indented.
        name, *cells = re.split(r"  +", line.strip())
        texts.setdefault(name, []).append(" | ".join(cells))
    # The kernel finds what the dense scan finds, and Drake confirms it.
    answers, times = texts["tcs kernel, the best one"]
    assert answers == "2 of 2 | 2 of 2 | 0 of 2 | 0 of 2 | 1.0"
    assert "(" in times
    free = texts["Drake IK, min distance, 5 tries"][0].split(" | ")[3]
    assert free == "0 of 2"
    assert all(texts[name][0].startswith("skipped: ") for name in ("EAIK", "TRAC-IK"))
    # Drake's checker has a context for each thread, and finds no winner in collision.
    assert texts["floor: checker's contexts; winners hit"] == ["2; 0"]
    parts = ("base check", "prefilter: too far", "inverse kinematics", "measure")
    parts = (*parts, "collision of arm and gripper")
    shares = [float(texts[f"of it {part}"][0].split(" %")[0]) for part in parts]
    # The parts add up to the whole within the rounding to three digits, and none is zero.
    assert sum(shares) == pytest.approx(100.0, abs=0.01)
    assert min(shares) > 0.0


def test_the_base_poses_of_the_thesis_are_as_far_apart_as_published(module):
    script = module("itcm_task")
    high, expert = (script.base_of(task) for task in (script.HIGH, script.EXPERT))
    # "14 cm apart and the yaw angle difference was only 2.8 deg", from figures of two digits.
    assert np.hypot(high[0] - expert[0], high[1] - expert[1]) == pytest.approx(0.14, abs=0.005)
    assert np.degrees(high[2] - expert[2]) == pytest.approx(2.8, abs=0.15)
    # A task to the right of the robot has the robot on its left, along its y axis.
    assert script.base_of(script.LOW) == pytest.approx((-0.45, -0.55, np.pi / 2))


class StandIn:
    """A job, a score file and its verification, without Drake."""

    def __init__(self, robot: str, recall: float = 1.0) -> None:
        self.robot, self.is_sound, self.scan_seconds = robot, True, 12.0
        self.checked, self.false_reached, self.unconfirmed_hits = 500, 0, 0
        self.dense_checked, self.missed = 30, 4
        self.recall, self.recall_ci95, self.recall_note = recall, (recall, recall), None
        self.measure, self.mean_shortfall = "isotropy", None
        self.max_position_error = self.max_rotation_error = self.max_isotropy_error = 0.0
        self.tables = ()

    def scene(self):
        return None

    def lowered(self, _scene):
        return self

    def digest(self):
        return "d"

    def to_json(self):
        strata = [
            {"reason": "joint_limits", "pairs": 10, "scanned": 10, "missed": 4},
            {"reason": "arm_blocked", "pairs": 2000, "scanned": 20, "missed": 0},
            {"reason": "too_far", "pairs": 0, "scanned": 0, "missed": 0},
        ]
        counts = {key: getattr(self, key) for key in ("checked", "false_reached", "recall")}
        return {
            **counts,
            "strata": strata,
            "ik": "analytic",
            "unconfirmed_hits": 0,
            "scan_seconds": 12.0,
            "reached": 996,
        }


def test_an_interrupted_run_of_the_robots_is_continued(module, monkeypatch, tmp_path, capsys):
    robots = module("robots")
    verified = []

    def verify(file, **_options):
        verified.append(file.robot)
        if len(verified) == 2:
            raise KeyboardInterrupt
        return file

    monkeypatch.setattr(robots, "load_job", lambda _task, _environment, robot, **_: StandIn(robot))
    monkeypatch.setattr(robots, "score", lambda _task, _environment, robot, **_: StandIn(robot))
    monkeypatch.setattr(robots, "verify", verify)
    path = tmp_path / "rows.jsonl"
    words = ["--tasks", "shaving", "--robots", "pr2,panda", "--repeats", "0"]
    monkeypatch.setattr(sys, "argv", ["robots.py", *words, "--finished", str(path)])
    with pytest.raises(KeyboardInterrupt):
        robots.main()
    with path.open("a") as stream:
        stream.write('\n{"key": {"task"')
    assert robots.main() == 0
    assert verified == ["pr2", "panda", "panda"]
    printed = capsys.readouterr().out
    assert "pr2, shaving" in printed
    assert "(measured before)" in printed
    assert robots.main() == 0
    assert len(verified) == 3
    # A changed kernel makes every row anew.
    monkeypatch.setattr(robots, "kernel_digest", lambda _folder: "another")
    assert robots.main() == 0
    assert verified[3:] == ["pr2", "panda"]


def test_the_recall_of_a_robot_is_that_of_all_its_rows(module, capsys):
    robots = module("robots")
    works = [robots.Work("shaving", "wheelchair", "pr2"), robots.Work("shaving", "bed", "pr2")]
    found = [{**StandIn("pr2").to_json(), "reached": 496}, StandIn("pr2").to_json()]
    robots.by_robot(works, found)
    printed = capsys.readouterr().out
    # 1492 are reached, and 4 of each row's 10 pairs were missed.
    assert f"joint limits 8 of 20, recall {1492 / 1500:.5f}" in printed
    assert "arm blocked 0 of 40 (of 4,000), recall 1.00000" in printed
    assert works[1].line == "pr2, shaving, bed"


@pytest.mark.parametrize(
    ("found", "fault"),
    [
        (([1.0], 2, ["a line"]), None),
        (([1.5], 2, ["a line"]), "false results"),
        (([1.0], 3, ["a line"]), "false results"),
        (([1.0], 2, []), "not one warning"),
        (([1.0], 2, ["one", "two"]), "not one warning"),
        ("dead processes", "dead processes"),
    ],
)
def test_faults_are_told_apart(module, found, fault):
    faults = module("faults")
    counted = {name for name, count in faults.judged(found, [1.0], 2).items() if count}
    assert counted == ({fault} if fault else set())


class MadeRow:
    """Configurations along a line, with goals that each reaches in samples as a table says."""

    goals = 3

    def __init__(self, exact, table, order, apart):
        self.exact, self.table, self.order = exact, table, order
        self.samples = self
        self.file = SimpleNamespace(
            nominal=SimpleNamespace(sets=SimpleNamespace(min_distance=apart))
        )

    def contenders(self):
        flat = np.arange(len(self.table)) + 100
        xy = np.stack([0.1 * np.arange(flat.size), np.zeros(flat.size)], axis=1)
        return self.exact.Contenders(flat, xy, np.zeros((flat.size, 0), np.uint64))

    def reached(self, flat, which):
        yield self.table[flat - 100][:, which]


@pytest.mark.parametrize("apart", [0.0, 1.55])
@pytest.mark.parametrize("alone", [False, True])
def test_the_surest_pair_loses_no_more_than_any(module, monkeypatch, rng, apart, alone):
    exact = module("surest_exact")
    # With few guesses the first pairs are not the best.
    monkeypatch.setattr(exact, "GUESSES", 2)
    monkeypatch.setattr(exact, "SCREENED", 2)
    monkeypatch.setattr(exact, "TRIED", 1)
    often = rng.uniform(0.6, 0.9, size=(40, 1, 1))
    table = rng.uniform(size=(40, 300, 3)) < often
    # Two that complement each other and have nothing in common, and one that does so from too near.
    table[5] = rng.uniform(size=(300, 3)) < 0.5
    table[30] = ~table[5] & (rng.uniform(size=(300, 3)) < 0.99)
    table[9] = ~table[5]
    if alone:
        table[11] = True
    row = MadeRow(exact, table, rng.permutation(300), apart)
    found = exact.surest_pair(row)
    lost = {
        (i, j): np.count_nonzero(~(table[i] | table[j]))
        for i in range(40)
        for j in range(i, 40)
        if i == j or 0.1 * (j - i) >= apart - 1e-9
    }
    assert lost[tuple(sorted((found - 100).tolist()))] == min(lost.values())
