"""A short run of `benchmarks/fuzz.py`: a mutant of any file is refused in one line or used."""

from __future__ import annotations

import os
import sys
from pathlib import Path

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
        import fuzz_files
    finally:
        sys.path.remove(str(FOLDER))
    return fuzz, fuzz_files


@pytest.fixture(scope="session")
def folder(scripts, tmp_path_factory):
    """A valid example of every file; what `tcs` makes comes from the suites of the formats."""
    from tcs.capability import save_map
    from tcs.model.robots import load_robot
    from tcs.placement.store import save_scores
    from tcs.teleop.runs.files import save_run
    from tests.capability.test_map import small_map
    from tests.placement.store.example import score_file
    from tests.teleop.runs.test_files import made

    made_in = tmp_path_factory.mktemp("fuzz")
    scripts[1].write_texts(made_in)
    save_scores(made_in / "scores.tcs", score_file())
    save_map(made_in / "map.tcm", small_map([[0, 0, 0, 0, 0], [1, 2, 3, 4, 1]], [0.5, 0.2], [1, 1]))
    save_run(made_in / "run.csv", made())
    joints = load_robot("pr2").arm_joints
    rows = [",".join(joints), *([",".join(["-0.3"] * len(joints))] * 5)]
    (made_in / "recording.csv").write_text("\n".join(rows))
    return made_in


@pytest.mark.parametrize("number", range(14))
def test_no_mutant_ends_in_anything_but_one_line(scripts, folder, number):
    fuzz, fuzz_files = scripts
    file_type = fuzz_files.FILE_TYPES[number]
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
    assert len(scripts[1].FILE_TYPES) == 14


def test_a_mutant_is_the_same_in_every_run(scripts, folder):
    fuzz, fuzz_files = scripts
    for file_type in fuzz_files.FILE_TYPES:
        original = (folder / file_type.file).read_bytes()
        one, two = (fuzz.mutant(file_type, original, 7, 3) for _ in range(2))
        assert one == two
        assert any(fuzz.mutant(file_type, original, 7, k) != one for k in range(4, 8))


def test_defects_are_told_apart(scripts, folder):
    """The judge of a mutant reports a traceback and more than one line as what they are."""
    fuzz, fuzz_files = scripts

    def judged(error):
        def use(path, number):
            raise error

        broken = fuzz_files.FileType("broken", "task.yaml", None, None, use)
        return fuzz.judged(broken, folder / "task.yaml", 1, score=False)[0]

    assert judged(TcsError("one line")) == "refused"
    assert judged(TcsError("two\nlines")) == "traceback"
    assert judged(ZeroDivisionError()) == "traceback"
    assert judged(MemoryError()) == "traceback"


@pytest.mark.parametrize(
    ("action", "outcome"), [(os.abort, "abort"), (None, "hang")], ids=["abort", "hang"]
)
def test_a_dead_or_silent_worker_is_told_and_replaced(scripts, monkeypatch, action, outcome):
    fuzz, _ = scripts
    code = "import os, sys, time\nprint('ready', flush=True)\nsys.stdin.readline()\n"
    code += "os.abort()" if action else "time.sleep(60)"
    worker = fuzz.Worker("task", FOLDER / "figures", 0, 25)
    popen = fuzz.subprocess.Popen
    monkeypatch.setattr(
        fuzz.subprocess, "Popen", lambda _, **rest: popen([sys.executable, "-c", code], **rest)
    )
    # Long enough for a process to die, short enough for a test.
    monkeypatch.setattr(fuzz, "SECONDS", 5.0 if action else 0.2)
    try:
        assert worker.judge(0)["outcome"] == outcome
        assert worker._process is None
    finally:
        worker.close()
