"""Motions in blocks: the same outcomes as without, whatever was finished or damaged before."""

from __future__ import annotations

import importlib
import logging

import numpy as np
import pytest

import tcs
from tcs.files.blocks import FORMAT, MANIFEST, BlockFolder
from tcs.files.compression import compress
from tests.killed import killed_at_block

# The package has a function of the module's name.
EXAMINE = importlib.import_module("tcs.motion.examine")
PLACES = ("base_x = 0.6 m", "base_y = -0.9 m", "base_yaw = 0..90 deg", "torso = 0.3 m")


@pytest.fixture(scope="module")
def file():
    """Shaving from one base position with several headings."""
    return tcs.score("shaving", "wheelchair", "pr2", only=PLACES, paper=True)


@pytest.fixture(scope="module")
def plain(file):
    (table,) = tcs.examine(file, within=None, most=3).tables
    assert len(table.configurations) == 3
    assert len(np.unique(table.outcome)) > 2
    return table


@pytest.fixture
def run(file, tmp_path, monkeypatch):
    """Function that examines in blocks of one configuration; the table, and how many are new."""
    examined, examine = [], EXAMINE._examine_slice

    def counted(arms, sets, rows, table, seed):
        examined.extend(rows)
        return examine(arms, sets, rows, table, seed)

    monkeypatch.setattr(EXAMINE, "SLICE", 1)
    monkeypatch.setattr(EXAMINE, "_examine_slice", counted)

    def done(restart=False, **options):
        examined.clear()
        folder = BlockFolder(tmp_path / "blocks", restart)
        (table,) = tcs.examine(file, within=None, most=3, blocks=folder, **options).tables
        return table, len(examined)

    return done


def assert_same(one, other):
    for name in ("configurations", "outcome", "pair"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.pair_names == other.pair_names


def files(folder):
    return sorted((folder / "blocks").rglob("*.block"))


def test_a_killed_run_continues_with_the_same_outcomes(file, run, plain, tmp_path):
    killed_at_block(
        1, file, tmp_path / "blocks",
        "import importlib\nimportlib.import_module('tcs.motion.examine').SLICE = 1",
        "tcs.examine(file, within=None, most=3, blocks=blocks, jobs=1)",
    )  # fmt: skip
    assert len(files(tmp_path)) == 1
    told = []
    table, examined = run(on_progress=lambda *done: told.append(done))
    assert_same(table, plain)
    assert examined == 2
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert len(list((tmp_path / "blocks").rglob(MANIFEST))) == 1
    table, examined = run()
    assert_same(table, plain)
    assert examined == 0
    assert run(seed=1)[1] == 3


def changed_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def with_other(name, value):
    """Return a change that writes something else, with a valid checksum."""

    def change(path):
        content = FORMAT.load(path, dict)
        if isinstance(value, int):
            shape, element = content[name]["shape"], content[name]["type"]
            content[name] = compress(np.full(shape, value, element))
        else:
            content[name] = value
        FORMAT.save(path, {k: v for k, v in content.items() if not k.startswith("format")})

    return change


def test_damaged_blocks_are_told_and_examined_again(run, plain, tmp_path, caplog):
    run()
    damages = [
        changed_byte, with_other("outcome", 99), with_other("pair", 10**6),
        with_other("names", [["a"]]), with_other("names", None),
    ]  # fmt: skip
    for damage in damages:
        damage(files(tmp_path)[0])
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            table, examined = run()
        assert_same(table, plain)
        assert examined == 1
        assert str(files(tmp_path)[0]) in caplog.text
