"""People in blocks: the same answers as without, whatever was finished or damaged before."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import tcs
from tcs.files.blocks import FORMAT, BlockFolder
from tcs.files.compression import compress
from tcs.model.people import Bodies, draw_bodies
from tcs.placement.population import outcomes, population
from tcs.placement.scoring import kernel_start
from tests.environments import CORNER, write_environment
from tests.killed import killed_at_block

PEOPLE = draw_bodies(7, seed=1)
FIRST = """
from tcs.placement.population import outcomes
from tcs.model.people import draw_bodies
outcomes.BLOCK = 2
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Shaving from a few base poses."""
    return tcs.score(
        "shaving",
        write_environment(tmp_path_factory.mktemp("corner"), "corner", CORNER),
        paper=True,
    )


@pytest.fixture(scope="module")
def plain(file):
    return {errors: answer(file, errors=errors) for errors in (False, True)}


def answer(file, people=PEOPLE, **options):
    """What each of two sets reaches for each person, shape (sets, people, goals)."""
    found = population(file, people, top=tcs.Top(count=2, min_apart=0.05), **options)
    return np.stack([one.reached for one in found.sets])


@pytest.fixture
def run(file, tmp_path, monkeypatch):
    """Function that evaluates with small blocks; the answer, and the number of people evaluated."""
    evaluated, evaluate = [], outcomes._evaluated

    def counted(prepared, scales, batch, *others):
        evaluated.extend(batch.tolist())
        return evaluate(prepared, scales, batch, *others)

    monkeypatch.setattr(outcomes, "BLOCK", 2)
    monkeypatch.setattr(outcomes, "_evaluated", counted)

    def done(restart=False, **options):
        evaluated.clear()
        found = answer(file, blocks=BlockFolder(tmp_path / "blocks", restart), **options)
        return found, sorted(evaluated)

    return done


def files(folder):
    return sorted((folder / "blocks").rglob("*.block"))


@pytest.mark.parametrize("errors", [False, True])
def test_people_of_finished_blocks_are_not_evaluated_again(errors, run, plain, tmp_path):
    everybody = list(range(len(PEOPLE)))
    told = []
    found, evaluated = run(errors=errors, on_progress=lambda *done: told.append(done))
    np.testing.assert_array_equal(found, plain[errors])
    assert evaluated == everybody
    assert len(files(tmp_path)) == 4
    assert told[-1] == (7, 7)
    for path in files(tmp_path)[:2]:
        path.unlink()
    found, evaluated = run(errors=errors, on_progress=lambda *done: told.append(done))
    np.testing.assert_array_equal(found, plain[errors])
    assert 3 <= len(evaluated) <= 4
    assert told[-1] == (7, 7)
    assert run(errors=errors)[1] == []
    assert run(errors=not errors)[1] == everybody
    assert run(errors=errors, restart=True)[1] == everybody


def test_only_a_missing_block_starts_the_kernel(run, plain, tmp_path, monkeypatch):
    run()

    def start(*_arguments):
        raise MemoryError("the kernel is started")

    monkeypatch.setattr(kernel_start, "warm_up", start)
    np.testing.assert_array_equal(run()[0], plain[False])
    files(tmp_path)[0].unlink()
    with pytest.raises(MemoryError, match="is started"):
        run()


def test_a_killed_run_continues_with_the_same_answers(file, run, plain, tmp_path):
    killed_at_block(
        2, file, tmp_path / "blocks", FIRST,
        "tcs.population(file, draw_bodies(7, seed=1), blocks=blocks, jobs=1, "
        "top=tcs.Top(count=2, min_apart=0.05))",
    )  # fmt: skip
    assert len(files(tmp_path)) == 2
    found, evaluated = run()
    np.testing.assert_array_equal(found, plain[False])
    assert evaluated == [4, 5, 6]
    assert not list((tmp_path / "blocks").rglob("*.part"))


def test_other_people_and_other_seeds_are_evaluated(run, plain):
    run()
    taller = Bodies(PEOPLE.measures, PEOPLE.is_male, PEOPLE.values[::-1].copy())
    found, evaluated = run(people=taller)
    np.testing.assert_array_equal(found, plain[False][:, ::-1])
    assert len(evaluated) == len(PEOPLE)
    run(errors=True)
    assert len(run(errors=True, seed=1)[1]) == len(PEOPLE)


def with_a_code_that_does_not_exist(path):
    content = FORMAT.load(path, dict)
    content["reason"] = compress(np.full(content["reason"]["shape"], 99, np.uint8))
    FORMAT.save(path, {k: v for k, v in content.items() if not k.startswith("format")})


def changed_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("damage", [changed_byte, with_a_code_that_does_not_exist])
def test_a_damaged_block_is_told_and_evaluated_again(damage, run, plain, tmp_path, caplog):
    run()
    damage(files(tmp_path)[0])
    with caplog.at_level(logging.WARNING):
        found, evaluated = run()
    np.testing.assert_array_equal(found, plain[False])
    assert 1 <= len(evaluated) <= 2
    assert str(files(tmp_path)[0]) in caplog.text
