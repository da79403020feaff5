"""Parking windows in score files: round trip, files without, and forged ones."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import SelectionError, StoreError, TcsError
from tcs.placement.parking import with_windows
from tcs.placement.store import load_scores, save_scores
from tcs.placement.store.encoding import decode, encode
from tcs.placement.tables import Window, WindowTable
from tests.placement.store.example import score_file


def windows_of(file, **changes):
    axes, goals = len(file.configurations.axes), file.nominal.sets.weights.size
    parts = {
        "values": np.arange(2.0 * axes).reshape(2, axes),
        "goals": np.array([[True] + [False] * (goals - 1)] * 2),
        "half": np.array([[0.05, 0.06, 0.1], [0.2, 0.01, 0.3]]),
        "held": np.array([True, False]),
    }
    return WindowTable(**(parts | changes))


def test_windows_that_were_found_are_saved_and_loaded(tmp_path):
    path, file = tmp_path / "file.tcs", score_file()
    save_scores(path, with_windows(file))
    assert load_scores(path).nominal.known_windows is None
    file.nominal.keep_windows(windows_of(file))
    save_scores(path, with_windows(file))
    back = load_scores(path).nominal
    for name in WindowTable.COLUMNS:
        written, read = getattr(windows_of(file), name), getattr(back.windows, name)
        assert np.array_equal(written, read)
        assert written.dtype == read.dtype
    assert back.known_windows is back.windows


def test_files_without_windows_load():
    packed = encode(score_file())
    del packed["tables"][0]["windows"]
    assert decode(packed).nominal.windows is None


def test_windows_of_another_grid_are_refused():
    file = score_file()
    narrow = windows_of(file, values=np.zeros((2, 2)))
    with pytest.raises(StoreError, match="do not belong"):
        dataclasses.replace(file, tables=(dataclasses.replace(file.nominal, windows=narrow),))


@pytest.mark.parametrize(
    "changes",
    [
        {"half": np.array([[0.05, 0.06, -0.1], [0.2, 0.01, 0.3]])},
        {"half": np.array([[0.05, 0.06, np.nan], [0.2, 0.01, 0.3]])},
        {"half": np.zeros((2, 2))},
        {"held": np.array([True])},
        {"goals": np.zeros((2, 5), np.bool_)},
        {"values": np.full((2, 5), np.inf)},
    ],
)
def test_tables_that_make_no_sense_are_refused(changes):
    with pytest.raises(TcsError, match="window table"):
        windows_of(score_file(), **changes)


def test_a_window_for_some_goals_is_one_for_fewer():
    axes = np.zeros(4)
    both, one, other = (np.array(g, np.bool_) for g in ([1, 1, 0], [1, 0, 0], [0, 0, 1]))
    table = WindowTable.empty(4, 3).added(axes, both, (0.05, 0.05, 0.1), held=True)
    assert table.window(axes, one) == table.window(axes, both) == Window(0.05, 0.05, 0.1)
    assert table.window(axes, other) is None
    assert table.window(axes + 0.1, both) is None
    assert table.window(axes, both, Window(0.06, 0.05, 0.1)) is None
    wider = table.added(axes, both, (0.5, 0.01, 0.1), held=True)
    assert len(wider) == 2
    assert wider.window(axes, both).x == 0.5 or wider.window(axes, both).y == 0.05
    assert wider.window(axes, both, Window(0.05, 0.05, 0.1)) == Window(0.05, 0.05, 0.1)


def test_a_miss_refuses_windows_that_contain_it():
    axes, goals = np.zeros(4), np.array([True, True, False])
    one = np.array([True, False, False])
    table = WindowTable.empty(4, 3).added(axes, one, (0.04, 0.0, 0.02), held=False)
    assert table.window(axes, goals) is None
    np.testing.assert_array_equal(table.missed(axes, Window(0.05, 0.05, 0.05)), one)
    assert not table.missed(axes, Window(0.03, 0.05, 0.05)).any()
    # A window is a tenth less than the box that is checked for it.
    assert table.missed(axes, Window(0.0365, 0.05, 0.05)).any()
    assert not table.missed(axes + 0.1, Window(0.05, 0.05, 0.05)).any()


def test_what_is_wanted_is_in_range():
    assert Window.wanted((0.0, 0.05, 0.0)) == Window(0.005, 0.05, np.radians(0.3))
    with pytest.raises(SelectionError, match="three numbers of 0"):
        Window.wanted((0.51, 0.05, 3.0))


def test_half_widths_are_rounded_down_but_not_below_what_was_asked_for():
    plain = Window(0.0549999, 0.05, np.radians(3.0)).to_json()
    assert plain == {"x": 0.0549, "y": 0.05, "yaw_deg": 3.0}
