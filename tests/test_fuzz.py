"""A short run of `benchmarks/fuzz.py`, and what `benchmarks/fuzz_options.py` counts as a defect."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from tcs.errors import TcsError

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"
MUTANTS = 60
"""Mutants of each type that are read; building what they describe is left to the benchmark."""


@pytest.fixture(scope="session")
def scripts():
    """The modules of the fuzzer."""
    sys.path.insert(0, str(FOLDER))
    try:
        import fuzz
        import fuzz_further_files
        import fuzz_options
    finally:
        sys.path.remove(str(FOLDER))
    return fuzz, fuzz_further_files, fuzz_options


@pytest.fixture(scope="session")
def folder(scripts, tmp_path_factory):
    """A valid example of every file; what `tcs` makes comes from the suites of the formats."""
    from fuzz_files import write_texts as write_scene_texts

    from tcs.capability import save_map
    from tcs.capability.arplace import query, save_arplace, save_probability_map
    from tcs.model.robots import load_robot
    from tcs.motion import save_plan
    from tcs.placement.store import save_motions, save_scores
    from tcs.teleop.runs.run_files import save_run
    from tests.capability.arplace.example import model
    from tests.capability.test_map import small_map
    from tests.placement.store.example import score_file
    from tests.placement.store.test_motion_file import motion_file, motion_table
    from tests.teleop.runs.test_run_files import made

    made_in = tmp_path_factory.mktemp("fuzz")
    write_scene_texts(made_in)
    scripts[1].write_texts(made_in)
    scores = score_file()
    save_scores(made_in / "scores.tcs", scores)
    sets = scores.nominal.sets
    save_motions(made_in / "scores.tcs.motions", motion_file(motion_table(sets, sets.reached)))
    save_plan(made_in / "plan.json", small_plan())
    write_block(made_in / "kept.block", scripts[1].BLOCK)
    write_manifest(made_in)
    save_map(made_in / "map.tcm", small_map([[0, 0, 0, 0, 0], [1, 2, 3, 4, 1]], [0.5, 0.2], [1, 1]))
    save_arplace(made_in / "model.arp", model())
    save_probability_map(made_in / "map.apm", query(model()).map)
    save_run(made_in / "run.csv", made())
    joints = load_robot("pr2").arm_joints
    scripts[1].write_bag(made_in / "arm.bag", list(joints), np.full((3, len(joints)), -0.3))
    rows = [",".join(joints), *([",".join(["-0.3"] * len(joints))] * 5)]
    (made_in / "recording.csv").write_text("\n".join(rows))
    return made_in


def small_plan():
    """A plan of one segment, as `tcs plan` would write it."""
    from tcs.model.grid import InitialConfiguration
    from tcs.motion import GoalResult, MotionPlan, Segment, StopPlan, Timed

    times = np.linspace(0.0, 1.0, 4)
    positions = np.linspace(0.0, 0.3, 4)[:, None] * np.ones(7)
    timing = Timed(times=times, positions=positions, velocities=np.full((4, 7), 0.3))
    segment = Segment("move", None, 0, timing)
    at = InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    return MotionPlan(
        made_from={"task": "fetch"},
        joints=tuple("abcdefg"),
        stops=(StopPlan(at=at, index=3, segments=(segment,), returns=False),),
        results=(GoalResult(0, 0, True, "done"),),
        edges=3,
        false=0,
        seed=0,
        seconds=1.0,
    )


def write_manifest(folder):
    """Write a finished run of one block."""
    from tcs.files.blocks import Blocks

    blocks = Blocks(folder, "key")
    blocks.save("one", {})
    blocks.finish()


def write_block(path, rows):
    """Write a block of random scores."""
    from tcs.files.blocks import Blocks
    from tcs.placement.scoring.blocks import Block, Kept

    rng = np.random.default_rng(0)
    reason = rng.integers(0, 7, (rows, 3)).astype(np.uint8)
    reached = reason == 0
    block = Block(
        reason,
        np.where(reached, -1, rng.integers(0, 50, reason.shape)).astype(np.int32),
        np.where(reached, rng.random(reason.shape), 0.0).astype(np.float32),
        rng.random((np.count_nonzero(reached), 7)).astype(np.float32),
    )
    Kept(Blocks(path.parent, "key"), goals=3, joints=7, contacts=10_000).save(0, block)
    (path.parent / "0000000000.block").replace(path)


@pytest.mark.parametrize("number", range(28))
def test_no_mutant_ends_in_anything_but_one_line(scripts, folder, number):
    fuzz, fuzz_files, _ = scripts
    file_type = fuzz_files.ALL_TYPES[number]
    path = folder / file_type.file
    original = path.read_bytes()
    refused = 0
    try:
        file_type.read(path)
        for mutant in range(MUTANTS):
            path.write_bytes(fuzz.mutant(file_type, original, 0, mutant))
            try:
                file_type.read(path)
            except TcsError as error:
                message = str(error)
                assert message, mutant
                assert "\n" not in message, mutant
                refused += 1
    finally:
        path.write_bytes(original)
    # A fuzzer whose mutants are all accepted, or all refused, checks nothing.
    assert MUTANTS // 10 < refused < MUTANTS


def test_every_type_has_its_entry(scripts):
    assert len(scripts[1].ALL_TYPES) == 28


def test_a_mutant_is_the_same_in_every_run(scripts, folder):
    fuzz, fuzz_files, _ = scripts
    for file_type in fuzz_files.ALL_TYPES:
        original = (folder / file_type.file).read_bytes()
        one, two = (fuzz.mutant(file_type, original, 7, 3) for _ in range(2))
        assert one == two
        assert any(fuzz.mutant(file_type, original, 7, k) != one for k in range(4, 8))


def test_a_mutation_of_the_largest_number_is_no_defect(scripts):
    from fuzz_mutations import plausible

    rng = np.random.default_rng(0)
    # Ten times the largest number, without a warning, which would end the worker.
    assert max(plausible(1e308, rng) for _ in range(50)) == np.inf


def test_defects_differ(scripts, folder):
    """The judge of a mutant reports a traceback and more than one line as what they are."""
    fuzz, fuzz_files, _ = scripts

    def judged(error):
        def use(path, number):
            raise error

        broken = fuzz_files.FileType("broken", "task.yaml", None, None, use)
        return fuzz.judged(broken, folder / "task.yaml", 1, score=False)[0]

    assert judged(TcsError("one line")) == "refused"
    assert judged(TcsError("two\nlines")) == "traceback"
    assert judged(ZeroDivisionError()) == "traceback"
    assert judged(MemoryError()) == "traceback"


@pytest.fixture
def worker(scripts, tmp_path):
    """Return a function that starts a worker which does an action when asked."""
    made = []

    def start(action, seconds):
        script = tmp_path / "script.py"
        code = f"import os, sys, time\nprint('ready', flush=True)\nsys.stdin.readline()\n{action}"
        script.write_text(code)
        made.append(scripts[0].Worker(script, (), FOLDER / "figures", seconds))
        return made[-1]

    yield start
    for one in made:
        one.close()


@pytest.mark.parametrize(
    ("action", "outcome", "seconds"),
    [
        # Long enough for a process to die, short enough for a test.
        ("os.abort()", "abort", 5.0),
        ("time.sleep(60)", "hang", 0.02),
        ("while True: pass", "hang", 0.1),
    ],
    ids=["abort", "waits", "computes"],
)
def test_a_dead_or_silent_worker_is_reported_and_replaced(worker, action, outcome, seconds):
    started = worker(action, seconds)
    assert started.judge(0)["outcome"] == outcome
    assert not started.runs


def test_only_processor_time_of_the_worker_counts(worker):
    started = worker('time.sleep(0.8)\nprint(\'{"outcome": "accepted"}\')', 0.4)
    assert started.judge(0) == {"outcome": "accepted"}


def test_every_command_and_option_gets_odd_values(scripts):
    options = scripts[2]
    names = options.command_names()
    assert {command.name for command in options.COMMANDS} == set(names)
    for name in names:
        calls = [
            call for one in options.COMMANDS if one.name == name for call in options.calls(one)
        ]
        given = {word for call in calls for word in call.words}
        parameters = [p for p in options.click_command(name).params if p.name != "help"]
        assert {p.opts[0] for p in parameters if p.param_type_name == "option"} <= given, name


@pytest.mark.parametrize(
    ("code", "err", "changes", "outcome"),
    [
        (0, "", ["out.csv"], "done"),
        (0, "", [".out.csv.1-2.part"], "file left"),
        (1, "tcs: no such file.\n", [], "refused"),
        (1, "tcs: no such file.\n", ["out.csv"], "file left"),
        (1, "tcs: no such\nfile.\n", [], "not one line"),
        (1, "", [], "not one line"),
        (2, "Usage: tcs\n\u2502 Missing option. \u2502\n", [], "misuse"),
        (2, "", [], "not one line"),
        (3, "tcs: no such file.\n", [], "other exit code"),
        (1, "Traceback (most recent call last):\n", [], "traceback"),
        (0, "RuntimeWarning: overflow\n", [], "traceback"),
    ],
)
def test_outcomes_of_calls_differ(scripts, code, err, changes, outcome):
    assert scripts[2].outcome_of(code, err, changes)[0] == outcome
