"""Estimates in score files: round trip, files without estimates, and forged ones."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import StoreError, TcsError
from tcs.files.compression import compress
from tcs.placement.store import load_scores, save_scores
from tcs.placement.store.encoding import decode, encode
from tcs.placement.tables import SuccessTable
from tests.placement.store.example import score_file


def with_estimates(**changes):
    file = score_file()
    table = file.tables[0]
    first, second = (int(h) for h in table.sets.candidates[:2])
    parts = {
        "members": np.array([[first, -1], [first, second]], dtype=np.int32),
        "success": np.array([0.5, 0.625]),
        "low": np.array([0.4, 0.6]),
        "high": np.array([0.6, 0.7]),
        "samples": np.array([64, 1024], dtype=np.int32),
        "rooms_done": np.array([0.5, 0.625]),
    }
    success = SuccessTable(**(parts | changes))
    return dataclasses.replace(file, tables=(dataclasses.replace(table, success=success),))


def test_a_saved_file_is_loaded_unchanged(tmp_path):
    path, file = tmp_path / "file.tcs", with_estimates()
    save_scores(path, file)
    back = load_scores(path).nominal.success
    for name in ("members", "success", "low", "high", "samples", "rooms_done"):
        written, read = getattr(file.nominal.success, name), getattr(back, name)
        assert np.array_equal(written, read)
        assert written.dtype == read.dtype


def test_files_without_estimates_load():
    packed = encode(score_file())
    del packed["tables"][0]["success"]
    assert decode(packed).nominal.success is None


def test_estimates_of_unknown_sets_are_refused():
    other = np.setdiff1d(np.arange(500), score_file().tables[0].sets.candidates)[0]
    with pytest.raises(StoreError, match="the table does not have"):
        with_estimates(members=np.array([[other, -1], [other, 10**6]], dtype=np.int32))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("members_plus_one", compress(np.array([[2**32 - 1, 0]] * 2, dtype=np.uint32))),
        ("members_plus_one", compress(np.array([1, 2], dtype=np.uint8))),
        ("members_plus_one", None),
        ("samples", compress(np.array([2**31, 1], dtype=np.uint32))),
        ("samples", compress(np.array([0, 1], dtype=np.uint8))),
        ("success", compress(np.array([7.0, 0.5]))),
        ("low", compress(np.array([0.1]))),
        ("high", compress(np.array([0.1, 0.2], dtype=np.float32))),
        (None, 3),
        (None, []),
    ],
)
def test_forged_estimates_are_refused(name, value):
    packed = encode(with_estimates())
    table = packed["tables"][0]
    if name is None:
        table["success"] = value
    else:
        table["success"] = {**table["success"], name: value}
    with pytest.raises(TcsError):
        decode(packed)
