"""Evaluations in blocks: the same numbers as without, whatever was finished or damaged before."""

from __future__ import annotations

import dataclasses
import logging
import os

import numpy as np
import pytest

from tcs.errors import OutputError
from tcs.files.blocks import FORMAT, MANIFEST, BlockFolder
from tcs.files.compression import compress
from tcs.model.scene import ErrorDistribution
from tcs.placement.robustness import evaluate, kept_runs, robustify
from tcs.placement.robustness import trials as module
from tcs.placement.robustness.perturbed_scenes import PerturbedScenes
from tcs.placement.scoring import kernel_start
from tcs.stored import check_file
from tests.killed import killed_at_block


def best(bed_trials, _chair_file, **options):
    return evaluate(bed_trials, samples=60, **options).reached


def drawn(bed_trials, _chair_file, **options):
    return evaluate(bed_trials, samples=40, select="uniform", **options).reached


def estimated(_bed_trials, chair_file, **options):
    done = robustify(chair_file, sets=30, samples=40, **options).tables[0].success
    return np.column_stack([getattr(done, f.name) for f in dataclasses.fields(done)])


WORK = pytest.mark.parametrize("work", [best, drawn, estimated])


@pytest.fixture
def evaluated(monkeypatch):
    """Blocks so small that there are several; the runs that were evaluated."""
    runs, reached = [], PerturbedScenes.reached

    def counted(scenes, poses, some, jobs):
        runs.extend(some)
        return reached(scenes, poses, some, jobs)

    monkeypatch.setattr(module, "BATCH", 20)
    monkeypatch.setattr(PerturbedScenes, "reached", counted)
    return runs


@pytest.fixture
def run(bed_trials, chair_file, evaluated, tmp_path, monkeypatch):
    """Function that does some work with blocks; the result, and how much was evaluated."""

    def done(work, restart=False, **options):
        evaluated.clear()
        monkeypatch.setattr(kept_runs, "PAIRS", 2000 if work is estimated else 20)
        folder = BlockFolder(tmp_path / "blocks", restart)
        return work(bed_trials, chair_file, blocks=folder, **options), len(evaluated)

    return done


def files(folder):
    return sorted((folder / "blocks").rglob("*.block"))


@WORK
def test_finished_blocks_are_not_evaluated_again(work, run, bed_trials, chair_file, tmp_path):
    plain = work(bed_trials, chair_file)
    found, first = run(work)
    np.testing.assert_array_equal(found, plain)
    assert first > 0 < len(files(tmp_path))
    found, again = run(work)
    np.testing.assert_array_equal(found, plain)
    assert again == 0
    assert run(work, restart=True)[1] == first
    (manifest,) = (tmp_path / "blocks").rglob(MANIFEST)
    assert check_file(manifest).kind == "manifest of blocks"
    assert {check_file(path).kind for path in files(tmp_path)} == {"block"}


def from_file(_bed_trials, chair_file, **options):
    return evaluate(chair_file, samples=60, **options).reached


@pytest.mark.parametrize("work", [from_file, estimated])
def test_only_a_missing_block_starts_the_kernel(work, run, tmp_path, monkeypatch):
    first, _ = run(work)

    def start(*_arguments):
        raise MemoryError("the kernel is started")

    monkeypatch.setattr(kernel_start, "warm_up", start)
    np.testing.assert_array_equal(run(work)[0], first)
    files(tmp_path)[0].unlink()
    with pytest.raises(MemoryError, match="is started"):
        run(work)


@WORK
def test_an_interrupted_run_continues(work, run, bed_trials, chair_file, tmp_path):
    plain = work(bed_trials, chair_file)
    total = run(work)[1]
    saved = len(files(tmp_path))
    for path in files(tmp_path)[::2]:
        path.unlink()
    found, missing = run(work)
    np.testing.assert_array_equal(found, plain)
    assert 0 < missing < total
    assert len(files(tmp_path)) == saved


def test_a_killed_run_continues_with_the_same_bytes(run, bed_file, bed_trials, tmp_path):
    plain = best(bed_trials, None)
    folder = tmp_path / "blocks"
    killed_at_block(
        2, bed_file, folder,
        "from tcs.placement.robustness import kept_runs, trials\n"
        "kept_runs.PAIRS = trials.BATCH = 20",
        "tcs.evaluate(file, samples=60, jobs=1, blocks=blocks)",
    )  # fmt: skip
    assert len(files(tmp_path)) == 2
    assert not list(folder.rglob(MANIFEST))
    assert len(list(folder.rglob("*.part"))) == 1
    found, evaluated = run(best)
    assert 0 < evaluated < 6
    np.testing.assert_array_equal(found, plain)
    assert not list(folder.rglob("*.part"))
    assert len(list(folder.rglob(MANIFEST))) == 1


def test_more_samples_need_only_the_further_ones(run, bed_trials, monkeypatch, evaluated):
    monkeypatch.setattr("tcs.placement.robustness.trials.CHUNK", 20)

    def some(samples):
        return lambda trials, _file, **options: evaluate(trials, samples=samples, **options).reached

    first = run(some(40))[1]
    plain = some(80)(bed_trials, None)
    found, further = run(some(80))
    np.testing.assert_array_equal(found, plain)
    assert further == first


@pytest.mark.parametrize(
    "options",
    [
        {"seed": 1},
        {"body_collisions": "paper"},
        {"table": 1},
        {"errors": {"person_x": ErrorDistribution(distribution="normal", std=0.01)}},
    ],
    ids=lambda options: next(iter(options)),
)
def test_other_inputs_are_evaluated(options, run, bed_file):
    def work(*_, **further):
        return evaluate(bed_file, samples=30, **further).reached

    run(work)
    assert run(work, **options)[1] > 0
    assert run(work)[1] == 0


def test_a_joint_that_the_grid_does_not_move_counts(run, monkeypatch):
    """The arrays of the grid are the same if only the direction of an error's joint has changed."""
    run(best)
    before = module.environment_at

    def reversed_joint(lowered, scene, task, states):
        turned = ({**state, "person_x": -state["person_x"]} for state in states)
        return before(lowered, scene, task, turned)

    monkeypatch.setattr(module, "environment_at", reversed_joint)
    assert run(best)[1] > 0


def changed_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def emptied(path):
    path.write_bytes(b"")


def cut(path):
    content = FORMAT.load(path, dict)
    content["reached"] = compress(np.zeros(1, np.uint8))
    FORMAT.save(path, {k: v for k, v in content.items() if not k.startswith("format")})


def of_another(path):
    other = next(one for one in path.parent.glob("*.block") if one != path)
    path.write_bytes(other.read_bytes())


@pytest.mark.parametrize("damage", [changed_byte, emptied, cut, of_another])
def test_a_damaged_block_is_told_and_evaluated_again(damage, run, bed_trials, tmp_path, caplog):
    plain = best(bed_trials, None)
    run(best)
    damaged = files(tmp_path)[0]
    damage(damaged)
    with caplog.at_level(logging.WARNING):
        found, again = run(best)
    np.testing.assert_array_equal(found, plain)
    assert again > 0
    (record,) = caplog.records
    assert str(damaged) in record.getMessage()
    assert run(best)[1] == 0


def test_a_second_run_is_refused_with_the_process(run, bed_trials, tmp_path):
    with (
        bed_trials.kept_in(BlockFolder(tmp_path / "blocks")),
        pytest.raises(OutputError, match=f"is in use by process {os.getpid()}"),
    ):
        run(best)
    run(best)
