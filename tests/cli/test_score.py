import dataclasses
import os
import re
import resource
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import tcs
from tcs.files.paths import data_folder
from tests.chosen import some_of
from tests.environments import CORNER, write_environment


@pytest.fixture(scope="module")
def corner_file(corner) -> Path:
    """Shaving, scored there."""
    path = corner.parent / "corner.tcs"
    tcs.save(path, tcs.score("shaving", corner))
    return path


def test_score_on_a_real_scene(tcs_command, corner, tmp_path):
    path = tmp_path / "out.tcs"
    ran = tcs_command("score", "shaving", "--environment", corner, "--out", path, "--json")
    assert ran.code == 0
    result = ran.json
    assert set(result) >= {
        *("configurations", "goals", "pairs", "reached_pairs", "scoring_seconds"),
        *("compile_seconds", "candidates", "sets", "best", "best_single", "reasons", "file"),
    }
    assert (result["configurations"], result["goals"], result["pairs"]) == (36, 8, 288)
    assert result["file"] == str(path)
    file = tcs.load(path)
    assert result["reached_pairs"] == int(file.nominal.scores.reached.sum()) > 0
    assert sum(result["reasons"].values()) == 288
    assert set(result["best"]["members"][0]) == {"base_x", "base_y", "base_yaw_deg", "torso"}
    singles = file.nominal.scores.reachability() + file.nominal.scores.manipulability()
    best = result["best_single"]
    # The report rounds each to twelve decimals.
    assert abs(best["reachability"] + best["manipulability"] - singles.max()) < 2e-12
    assert len(best["members"]) == 1
    assert list(tmp_path.iterdir()) == [path]


def test_number_of_jobs_changes_nothing(tcs_command, corner, corner_file, tmp_path):
    path = tmp_path / "one.tcs"
    ran = tcs_command("score", "shaving", "--environment", corner, "--jobs", 1, "--out", path)
    assert ran.code == 0
    one, two = tcs.load(path), tcs.load(corner_file)
    np.testing.assert_array_equal(one.nominal.scores.dexterity, two.nominal.scores.dexterity)
    np.testing.assert_array_equal(one.nominal.scores.arm_joints, two.nominal.scores.arm_joints)


def test_an_engine_that_cannot_be_is_refused(tcs_command, corner, tmp_path):
    path = tmp_path / "out.tcs"
    words = ("score", "shaving", "--environment", corner, "--out", path)
    for more, line in (
        (("--engine", "process"), "unknown engine 'process'"),
        (("--engine", "dask"), "requires --scheduler ADDRESS"),
        (("--scheduler", "tcp://127.0.0.1:1"), "Engine threads: has no scheduler"),
        (("--engine", "dask", "--dry-run"), "is for scoring a whole grid"),
    ):
        ran = tcs_command(*words, *more)
        assert ran.code in {1, 2}
        assert line in " ".join(ran.err.split())


def test_blocks_are_kept_and_taken(tcs_command, corner, corner_file, tmp_path):
    path, blocks = tmp_path / "out.tcs", tmp_path / "blocks"
    words = ("score", "shaving", "--environment", corner, "--blocks", blocks, "--out", path)
    for more in ((), (), ("--restart",)):
        assert tcs_command(*words, *more).code == 0
        table, same = tcs.load(path).nominal.scores, tcs.load(corner_file).nominal.scores
        np.testing.assert_array_equal(table.dexterity, same.dexterity)
        kept = sorted(blocks.rglob("*.block"))
        scored = ["0000000000.block", "0000000000.block", "sets.block"]
        assert sorted(block.name for block in kept) == scored
    assert tcs_command("check", *blocks.rglob("manifest.json"), *kept).code == 0
    ran = tcs_command("score", "shaving", "--restart")
    assert ran.code == 2
    assert "requires --blocks" in " ".join(ran.err.replace("│", " ").split())


def test_a_dry_run_estimates_and_writes_nothing(tcs_command, corner, corner_file, tmp_path):
    path = tmp_path / "out.tcs"
    words = ("score", "shaving", "--environment", corner, "--dry-run", "--out", path)
    (row,) = tcs_command(*words, "--json").json["rows"]
    scores = tcs.load(corner_file).nominal.scores
    assert (row["configurations"], row["goals"], row["blocks"]) == (36, 8, 1)
    # The grid fits into one slice, so nothing is estimated but the time.
    arrays = (scores.reason, scores.reached, scores.pair, scores.dexterity, scores.arm_joints)
    assert row["memory_bytes"] == sum(array.nbytes for array in arrays)
    assert row["scratch_bytes"] == 0
    assert 0 < row["disk_bytes"] < row["memory_bytes"]
    assert row["scoring_seconds"] > 0
    ran = tcs_command(*words)
    assert (ran.code, "36" in ran.out) == (0, True)
    assert not path.exists()
    # Of a person who is seen elsewhere, other goals are reached.
    seen = ("score", "shaving", "--environment", corner, "--observed", "person_x=0.06")
    (row,) = tcs_command(*seen, "--dry-run", "--json").json["rows"]
    assert tcs_command(*seen, "--out", path).code == 0
    scored = tcs.load(path).nominal.scores
    assert len(scored.arm_joints) != len(scores.arm_joints)
    arrays = (scored.reason, scored.reached, scored.pair, scored.dexterity, scored.arm_joints)
    assert row["memory_bytes"] == sum(array.nbytes for array in arrays)


def test_constraints_when_scoring(tcs_command, corner, tmp_path):
    path, told = tmp_path / "out.tcs", tmp_path / "bedroom.yaml"
    told.write_text('forbid: ["0.9 -1, 1.2 -1, 1.2 -0.5, 0.9 -0.5"]\nprefer: [left]\n')
    words = ("--constraints", told, "--blocked", "0.3 0.9 0.3 0.3 20", "--keep", "torso")
    words = ("score", "shaving", "--environment", corner, *words, "--out", path)
    ran = tcs_command(*words, "--at", "torso=0.2", "--json")
    assert ran.code == 0, ran.err
    texts = ["only torso = 0.15 m", "forbid 0.9 -1, 1.2 -1, 1.2 -0.5, 0.9 -0.5"]
    texts.append("blocked 0.3 0.9 0.3 0.3 20")
    assert ran.json["constraints"] == texts
    assert ran.json["configurations"] == 18
    file = tcs.load(path)
    assert ran.json["reasons"]["excluded"] == 8 * file.metadata["constraints"]["excluded"] > 0
    here = ("--here", 2, 1, 180)
    assert tcs_command("select", path, *here, "--json").json["scored_constraints"] == texts
    assert "scored under constraints: only torso = 0.15 m; forbid" in tcs_command(
        "select", path, *here
    ).out.replace("\n", " ")
    excluded = int(np.flatnonzero(file.nominal.scores.reason[:, 0] == 7)[0])
    out = tcs_command("explain", path, "--goal", 1, "--configuration", excluded).out
    assert "excluded by a constraint when scoring" in out
    assert tcs_command("map", path, "--out", tmp_path / "map.png").code == 0


def test_constraints_that_cannot_be_met_when_scoring(tcs_command, corner, tmp_path):
    words = ("score", "shaving", "--environment", corner, "--out", tmp_path / "out.tcs")
    ran = tcs_command(*words, "--keep", "torso")
    assert ran.code == 1
    assert ran.err.startswith("tcs: keep torso: the current state lacks its value.")
    ran = tcs_command(*words, "--forbid", "0 0, 1")
    assert ran.code == 1
    assert "Region '0 0, 1' must be X1 Y1" in ran.err
    assert tcs_command(*words, "--at", "torso=0.2").code == 2
    assert not (tmp_path / "out.tcs").exists()


def test_verify_finds_a_sound_file_sound(tcs_command, corner_file):
    ran = tcs_command("verify", corner_file, "--pairs", 20, "--dense", 6, "--seed", 3, "--json")
    assert ran.code == 0, ran.err
    found = ran.json
    assert set(found) >= {
        *("checked", "false_reached", "max_position_error", "max_rotation_error"),
        *("max_isotropy_error", "limit_violations", "dense_checked", "missed", "recall"),
        *("recall_ci95", "mean_shortfall"),
    }
    assert found["checked"] == min(20, int(tcs.load(corner_file).nominal.scores.reached.sum()))
    assert found["false_reached"] == found["limit_violations"] == 0


def test_verify_gives_no_figure_for_what_it_did_not_scan(tcs_command, corner_file):
    ran = tcs_command("verify", corner_file, "--pairs", 5, "--dense", 0)
    assert ran.code == 0
    printed = " ".join(ran.out.split())
    assert "recall not estimated: no unreached pair was scanned" in printed
    assert "mean shortfall of isotropy not estimated: no reached pair was scanned" in printed
    scanned = tcs_command("verify", corner_file, "--pairs", 5, "--dense", 6)
    assert "not estimated" not in scanned.out


def test_verify_scans_whole_strata(tcs_command, corner_file):
    words = ("verify", corner_file, "--pairs", 5, "--dense", 2, "--strata", "--jobs", 2)
    found = tcs_command(*words, "--json").json
    reasons = tcs.load(corner_file).nominal.scores.reason_counts()
    assert {s["reason"]: s["scanned"] for s in found["strata"]} == {
        reason: reasons[reason] for reason in ("joint_limits", "arm_blocked", "too_far")
    }
    assert found["dense_checked"] == sum(s["pairs"] for s in found["strata"])
    assert found["recall"] == 1.0
    assert found["scan_seconds"] > 0.0
    printed = " ".join(tcs_command(*words).out.split())
    n = reasons["too_far"]
    assert f"stored as too far 0 of {n:,} reachable, recall 100.00%" in printed
    assert "time of the scan" in printed
    limited = tcs_command(*words, "--limit", 1).out
    assert f"0 of 1 reachable, {n:,} in all" in " ".join(limited.split())


def test_a_limit_needs_strata(tcs_command, corner_file):
    ran = tcs_command("verify", corner_file, "--limit", 5)
    assert ran.code == 2
    assert "requires --strata" in ran.err


def test_verify_finds_a_forged_answer(tcs_command, corner_file, tmp_path):
    file = tcs.load(corner_file)
    joints = file.nominal.scores.arm_joints.copy()
    joints[:, 0] += np.float32(0.01)
    scores = dataclasses.replace(file.nominal.scores, arm_joints=joints)
    forged = dataclasses.replace(
        file, tables=(tcs.placement.store.StateTables.of(scores, file.nominal.sets),)
    )
    path = tmp_path / "forged.tcs"
    tcs.save(path, forged)
    ran = tcs_command("verify", path, "--pairs", 5, "--dense", 0, "--json")
    assert ran.code == 1
    assert ran.json["false_reached"] == ran.json["checked"] > 0
    assert "some answers" in ran.err
    ran = tcs_command("verify", path, "--pairs", 5, "--dense", 0)
    assert ran.code == 1
    assert "SOME ANSWERS ARE FALSE" in ran.out


@pytest.mark.parametrize("verb", ["verify", "map", "picture"])
def test_other_models_are_refused(tcs_command, corner_file, tmp_path, verb):
    file = tcs.load(corner_file)
    path = tmp_path / "older.tcs"
    other = {**file.metadata, "scene_digest": "0" * 64}
    tcs.save(path, dataclasses.replace(file, metadata=other))
    ran = tcs_command(verb, path, *(() if verb == "verify" else ("--out", tmp_path / "p.png")))
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "from other models" in ran.err
    assert list(tmp_path.iterdir()) == [path]
    assert tcs_command("select", path, "--here", 1, -1, 0).code == 0


@pytest.mark.parametrize("verb", some_of(["map", "picture"], "map"))
def test_pictures_are_written(tcs_command, corner_file, tmp_path, verb):
    path = tmp_path / "p.png"
    # A picture of the scene takes seconds.
    for here in ((), ("--here", 1.6, -1.4, 90))[verb == "picture" :]:
        ran = tcs_command(verb, corner_file, "--out", path, *here, "--json")
        assert (ran.code, ran.err) == (0, "")
        assert ran.json["file"] == str(path)
        assert path.read_bytes().startswith(b"\x89PNG")
    chosen = tcs_command("select", corner_file, "--here", 1.6, -1.4, 90, "--json").json
    assert ran.json["members"] == chosen["members"]
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("verb", ["map", "picture"])
def test_pictures_have_a_known_format_and_a_place(tcs_command, small_file, tmp_path, verb):
    ran = tcs_command(verb, small_file, "--out", tmp_path / "p.gif")
    assert ran.code == 1
    assert "must end in one of .png, .pdf, .svg" in ran.err
    ran = tcs_command(verb, small_file, "--out", tmp_path / "none" / "p.png")
    assert ran.code == 1
    assert "p.png' cannot be written: No such file or directory." in ran.err
    assert tcs_command(verb, small_file).code == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        pytest.param(("shavin",), "unknown task 'shavin'.*Did you mean 'shaving'", id="task"),
        pytest.param(
            ("shaving", "--environment", "wheelchiar"),
            "Did you mean 'wheelchair'",
            id="environment",
        ),
        pytest.param(("shaving", "--robot", "pr3"), "unknown robot 'pr3'", id="robot"),
        pytest.param(
            ("shaving", "--measure", "isotropy-limitd"),
            "unknown measure 'isotropy-limitd'.*Did you mean 'isotropy-limited'",
            id="measure",
        ),
        pytest.param(("none.yaml",), "task file 'none.yaml' cannot be read", id="no file"),
    ],
)
def test_unknown_names(tcs_command, tmp_path, words, message):
    path = tmp_path / "out.tcs"
    ran = tcs_command("score", *words, "--out", path)
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert re.search(message, ran.err)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("count", "message"),
    [
        pytest.param(0, "corner.yaml", id="empty grid"),
        pytest.param(10_000_000, "120,000,000", id="huge"),
    ],
)
def test_impossible_grids(tcs_command, tmp_path, count, message):
    environment = write_environment(tmp_path, "corner", CORNER | {"base_x": (0.95, 1e-6, count)})
    ran = tcs_command("score", "shaving", "--environment", environment, "--out", tmp_path / "o.tcs")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert message in ran.err


def test_unknown_frame_names_the_nearest(tcs_command, tmp_path):
    task = tmp_path / "mine.yaml"
    text = (data_folder() / "tasks/adl/shaving.yaml").read_text()
    task.write_text(text.replace("body_frame: head", "body_frame: haed", 1))
    ran = tcs_command("score", task, "--out", tmp_path / "o.tcs")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "Did you mean 'head'?" in ran.err


@pytest.mark.parametrize(
    "place",
    [
        pytest.param("none/out.tcs", id="no such folder"),
        pytest.param("file/out.tcs", id="a file for a folder"),
        pytest.param("folder", id="a folder"),
        pytest.param("/proc/out.tcs", id="no files allowed"),
    ],
)
def test_an_unwritable_path_is_refused_before_the_work(tcs_command, tmp_path, stand_in, place):
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    ran = tcs_command("score", "shaving", "--out", tmp_path / place)
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert stand_in == []


def test_file_is_named_after_its_content(tcs_command, tmp_path, stand_in, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ran = tcs_command("score", "my/shave.yaml", "--environment", "hall.yaml", "--json")
    assert ran.code == 0
    assert ran.json["file"] == "shave-hall-pr2.tcs"
    assert [path.name for path in tmp_path.iterdir()] == ["shave-hall-pr2.tcs"]
    ((arguments, options),) = stand_in
    assert arguments == ("my/shave.yaml", "hall.yaml", "pr2")
    assert options["jobs"] == 2


def test_the_measure_is_passed_on_and_named(tcs_command, example, tmp_path, monkeypatch):
    measures = []

    def score(*_arguments, measure, **_options):
        measures.append(measure)
        file = example()
        return dataclasses.replace(file, metadata={**file.metadata, "measure": measure})

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    path = tmp_path / "o.tcs"
    words = ("score", "shaving", "--measure", "inverse-condition", "--out", path)
    assert "(inverse-condition)" in tcs_command(*words).out
    assert tcs_command(*words, "--json").json["measure"] == "inverse-condition"
    select = ("select", path, "--here", 1, -1, 0)
    assert "(inverse-condition)" in tcs_command(*select).out
    assert tcs_command(*select, "--json").json["measure"] == "inverse-condition"
    assert tcs_command("score", "shaving", "--out", path, "--json").json["measure"] == "isotropy"
    assert measures == ["inverse-condition", "inverse-condition", "isotropy"]


def test_score_as_text(tcs_command, tmp_path, stand_in):
    ran = tcs_command("score", "shaving", "--out", tmp_path / "o.tcs")
    assert ran.code == 0
    for word in ("configurations", "recommended (", "base x [m]", "o.tcs"):
        assert word in ran.out
    # What to do next is said last.
    assert ran.out.splitlines()[-1].startswith(f"next: tcs robustify {tmp_path / 'o.tcs'} ")
    # Neither constraints nor approaches were requested.
    assert "constraint" not in ran.out
    assert "approach" not in ran.out


def test_nothing_reached_is_an_answer(tcs_command, example, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "tcs.placement.scoring.score_to_file.score", lambda *_, **__: example(share=0.0)
    )
    path = tmp_path / "o.tcs"
    ran = tcs_command("score", "shaving", "--out", path)
    assert ran.code == 0
    assert "no configuration reaches a goal" in ran.out
    result = tcs_command("score", "shaving", "--out", path, "--json").json
    assert (result["best"], result["recommended"]) == (None, None)


@pytest.mark.parametrize("jobs", ["0", "-1", "two"])
def test_impossible_jobs_are_misuse(tcs_command, stand_in, jobs):
    assert tcs_command("score", "shaving", "--jobs", jobs).code == 2
    assert stand_in == []


def test_defects_of_the_program_keep_their_traceback(tcs_command, tmp_path, monkeypatch):
    def score(*_arguments, **_options):
        raise ZeroDivisionError("a mistake")

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    with pytest.raises(ZeroDivisionError):
        tcs_command("score", "shaving", "--out", tmp_path / "o.tcs")


def test_commands_work_off_the_main_thread(tcs_command, small_file):
    codes = []
    thread = threading.Thread(
        target=lambda: codes.append(tcs_command("select", small_file, "--here", 0, 0, 0).code)
    )
    thread.start()
    thread.join()
    assert codes == [0]


def test_script_is_the_command(tmp_path):
    script = Path(__file__).resolve().parents[2] / "scripts" / "score_task.py"
    done = subprocess.run(
        [sys.executable, script, "shavin", "--out", tmp_path / "o.tcs"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(script.parents[1])},
    )
    assert done.returncode == 1
    assert "Did you mean 'shaving'?" in done.stderr


def test_scoring_with_approach(tcs_command, corner, tmp_path):
    path, without = tmp_path / "out.tcs", tmp_path / "without.tcs"
    words = ("score", "shaving", "--environment", corner, "--json")
    result = tcs_command(*words, "--no-approach", "--out", without).json
    assert (result["approach"], result["no_approach"]) == (None, None)
    ran = tcs_command(*words, "--out", path)
    assert ran.err == ""
    result, postures = ran.json, tcs.load(without)
    found = result["approach"]
    assert (found["tool_speed"], found["approachable"]) == (0.1, result["reached_pairs"])
    assert (found["limits"], found["blocked"]) == tuple(
        result["reasons"][f"approach_{name}"] for name in ("limits", "blocked")
    )
    before = postures.nominal.scores
    assert found["approachable"] + found["limits"] + found["blocked"] == before.reached.sum()
    assert 0.3 < found["fraction"] < 1.0
    file = tcs.load(path)
    after = file.nominal.scores
    assert not np.any(after.reached & ~before.reached)
    assert file.metadata["approach"] == {"tool_speed": 0.1}
    assert file.task["goals"][0]["approach"] == {"direction": [1.0, 0.0, 0.0], "distance": 0.1}
    h, g = np.argwhere(after.reason >= 8)[0]
    told = tcs_command("explain", path, "--goal", g + 1, "--configuration", h, "--json").json
    assert told["explained"]["reason"].startswith("approach_")
    checks = [check["reason"] for check in told["checks"]]
    assert checks[-2:] == ["approach_limits", "approach_blocked"]
    assert "approach" in tcs_command("explain", path, "--goal", g + 1, "--configuration", h).out
    chosen = tcs_command(*words, "--approach", "--out", tmp_path / "chosen.tcs").json
    assert chosen["reasons"] == result["reasons"]


def test_goals_with_freedom_are_scored_with_approach(tcs_command, tmp_path):
    path, environment = tmp_path / "out.tcs", write_environment(tmp_path, "corner", CORNER)
    task = Path(__file__).parents[2] / "examples" / "feeding_from_any_side.yaml"
    words = ("score", task, "--environment", environment, "--out", path)
    assert tcs_command(*words).err.count("without approach") == 0
    assert "approach" in tcs.load(path).metadata
    assert tcs_command(*words, "--no-approach").err.count("without approach") == 0
    assert "approach" not in tcs.load(path).metadata


def test_scoring_as_in_the_papers(tcs_command, corner, tmp_path):
    path = tmp_path / "out.tcs"
    task = Path(__file__).parents[2] / "examples" / "feeding_from_any_side.yaml"
    words = ("score", task, "--environment", corner, "--out", path, "--paper")
    ran = tcs_command(*words)
    assert "as in the papers: each goal at its exact pose, without approach" in ran.out
    assert ran.err.count("without approach") == 0
    file = tcs.load(path)
    assert file.metadata["paper"] is True
    assert not any("free" in goal for goal in file.task["goals"])
    result = tcs_command(*words, "--json").json
    assert (result["paper"], result["approach"], result["no_approach"]) == (True, None, None)
    assert tcs_command(*words, "--no-approach", "--json").json["reasons"] == result["reasons"]


@pytest.mark.parametrize("other", ["--paper", "--no-approach"])
def test_approach_excludes_scoring_without(tcs_command, other):
    ran = tcs_command("score", "shaving", "--approach", other)
    assert ran.code == 2
    assert f"cannot be combined with {other}" in " ".join(ran.err.split())


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [(), ("--blocks", "blocks")], ids=["file", "blocks"])
def test_a_full_disk_is_told_in_one_line_and_leaves_nothing(corner, tmp_path, blocks):
    words = ("score", "shaving", "--environment", str(corner), "--out", "out.tcs", *blocks)
    ended = subprocess.run(
        [sys.executable, "-m", "tcs", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500)),
    )
    assert (ended.returncode, ended.stderr.count("\n")) == (1, 1), ended.stderr
    assert "cannot be written: File too large" in ended.stderr
    left = [path for path in tmp_path.rglob("*") if path.is_file() and path.name != "lock"]
    assert left == [path for path in left if path.name == "goals.json"]
