"""Sets from a block: those that would be built, of these scores and options alone."""

import dataclasses
import importlib
import logging

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.files.blocks import BlockFolder
from tcs.placement.scoring import score
from tcs.placement.scoring.sets import build_sets, checked_options, kept_sets
from tcs.stored import check_file
from tests.placement.tables.small import random_scores, small_grid

KEPT = importlib.import_module("tcs.placement.scoring.sets")
OPTIONS = (
    {},
    {"rule": "code2015"},
    {"max_members": 1},
    {"max_members": 3},
    {"min_distance": 0.2},
    {"same_environment": True},
)


@pytest.fixture
def folder(tmp_path):
    return BlockFolder(tmp_path / "blocks")


@pytest.fixture
def built(monkeypatch):
    """The options of every call that built sets."""
    calls = []

    def counted(scores, grid, **options):
        calls.append(options)
        return build_sets(scores, grid, **options)

    monkeypatch.setattr(KEPT, "build_sets", counted)
    return calls


def assert_equal(first, second):
    for field in dataclasses.fields(first):
        one, other = getattr(first, field.name), getattr(second, field.name)
        if dataclasses.is_dataclass(one):
            assert_equal(one, other)
        else:
            np.testing.assert_array_equal(one, other)
            assert getattr(one, "dtype", None) == getattr(other, "dtype", None)


@pytest.mark.parametrize("given", OPTIONS)
@pytest.mark.parametrize("share", [0.0, 0.6])
def test_sets_of_a_block_are_those_that_are_built(given, share, folder, built):
    grid = small_grid(bed=2)
    scores = random_scores(grid, seed=3, goals=4, levels=4, share=share)
    options = checked_options(**given)
    expected = build_sets(scores, grid, **options)
    for _ in range(2):
        assert_equal(kept_sets(folder, scores, grid, jobs=1, **options), expected)
    assert len(built) == 1


def test_other_options_scores_or_grids_have_other_sets(folder, built):
    grid = small_grid(bed=2)
    options = checked_options()
    scores = random_scores(grid, seed=3, goals=4, levels=4, share=0.6)
    others = [(scores, grid, checked_options(**given)) for given in OPTIONS]
    others.append((random_scores(grid, seed=4, goals=4, levels=4, share=0.6), grid, options))
    other_weights = dataclasses.replace(scores, weights=np.array([0.4, 0.3, 0.2, 0.1]))
    others.append((other_weights, grid, options))
    raised = np.where(scores.reached, scores.dexterity + np.float32(1e-6), np.float32(0.0))
    others.append((dataclasses.replace(scores, dexterity=raised), grid, options))
    for number, (table, of_grid, of_sets) in enumerate(others, start=1):
        found = kept_sets(folder, table, of_grid, jobs=1, **of_sets)
        assert_equal(found, build_sets(table, of_grid, **of_sets))
        assert len(built) == number


def test_a_damaged_block_is_told_and_built_again(folder, built, caplog):
    grid, options = small_grid(), checked_options()
    scores = random_scores(grid, seed=3, goals=4, levels=4, share=0.6)
    kept_sets(folder, scores, grid, jobs=1, **options)
    (block,) = folder.path.rglob("sets.block")
    content = bytearray(block.read_bytes())
    content[len(content) // 2] ^= 1
    block.write_bytes(content)
    with pytest.raises(TcsError, match="damaged"):
        check_file(block)
    with caplog.at_level(logging.WARNING):
        found = kept_sets(folder, scores, grid, jobs=1, **options)
    assert "computed again" in caplog.text
    assert_equal(found, build_sets(scores, grid, **options))
    assert len(built) == 2
    check_file(block)


def test_a_command_that_was_finished_builds_nothing(small_environment, small_file, folder, built):
    for _ in range(2):
        file = score("shaving", small_environment, blocks=folder, paper=True)
        assert_equal(file.nominal.sets, small_file.nominal.sets)
    assert len(built) == 1
