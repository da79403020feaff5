"""Motion files: round trip, and what does not belong together."""

from __future__ import annotations

import joblib
import numpy as np
import pytest

from tcs.errors import StoreError, StoreFormatError, StoreMismatchError, TcsError
from tcs.placement.store import MotionFile, load_motions, motion_path, motions_of, save_motions
from tcs.placement.tables import MotionTable
from tests.placement.store.example import METADATA, score_file


def motion_table(sets, done, rows=None):
    """Motions for candidates `rows`: `done` says which reached goals can be done."""
    rows = np.arange(len(sets.candidates)) if rows is None else rows
    outcome = np.where(done[rows] & sets.reached[rows], 1, 5).astype(np.uint8)
    outcome[~sets.reached[rows]] = 0
    return MotionTable(
        configurations=sets.candidates[rows],
        outcome=outcome,
        pair=np.where(outcome == 5, 0, -1).astype(np.int32),
        pair_names=(("elbow", "head"),),
    )


def motion_file(*tables):
    """A motion file of the example."""
    metadata = {"scene_digest": METADATA["scene_digest"], "seed": 0, "within": None, "seconds": 1.0}
    return MotionFile(metadata=metadata, tables=tables)


@pytest.fixture
def sets():
    return score_file().nominal.sets


def test_round_trip(sets, tmp_path):
    table = motion_table(sets, np.ones(sets.reached.shape, bool), np.arange(0, 20, 3))
    save_motions(tmp_path / "a.motions", motion_file(None, table))
    none, stored = load_motions(tmp_path / "a.motions").tables
    assert none is None
    for name in ("configurations", "outcome", "pair"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(table, name))
    assert stored.pair_names == table.pair_names


def test_motions_of_other_scores_are_refused(sets, tmp_path):
    file = score_file()
    path = tmp_path / "s.tcs"
    with pytest.raises(StoreError, match=r"Make it with: tcs motions .*s\.tcs"):
        motions_of(file, path)
    table = motion_table(sets, sets.reached)
    save_motions(motion_path(path), motion_file(table))
    assert motions_of(file, path).tables[0].done.any()
    other = score_file(metadata=METADATA | {"scene_digest": "00" * 32})
    with pytest.raises(StoreMismatchError, match="tcs motions"):
        motions_of(other, path)
    with pytest.raises(StoreMismatchError):
        motion_file(table, None).check_belongs(file)


@pytest.mark.parametrize(
    "change",
    [
        {"tables": [3]},
        {"tables": None},
        {"metadata": {"seed": 0}},
        {"format": "tcs scores"},
        {"tables": [{"pair_names": [["one"]]}]},
    ],
)
def test_damaged_files_are_one_line(sets, tmp_path, change):
    path = tmp_path / "a.motions"
    save_motions(path, motion_file(motion_table(sets, sets.reached)))
    joblib.dump(joblib.load(path) | change, path)
    with pytest.raises(StoreFormatError, match="tcs motions") as found:
        load_motions(path)
    assert len(str(found.value).splitlines()) == 1


def test_tables_that_contradict_themselves_are_refused(sets):
    table = motion_table(sets, sets.reached)
    parts = {name: getattr(table, name) for name in ("configurations", "outcome", "pair")}
    for name, wrong in (
        ("configurations", parts["configurations"][::-1].copy()),
        ("outcome", np.full_like(parts["outcome"], 9)),
        ("pair", np.full_like(parts["pair"], 4)),
        ("pair", parts["pair"][:1].copy()),
    ):
        with pytest.raises(TcsError):
            MotionTable(**(parts | {name: wrong}), pair_names=table.pair_names)
