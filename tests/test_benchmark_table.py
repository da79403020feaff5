"""Saved figures: a run of some rows keeps the others, and says which run they are of."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"
SAVE = argparse.Namespace(save=True)
COLUMNS = ("task", "time")


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Return a function that saves tables as a run of a script of its own; it returns the file."""
    monkeypatch.syspath_prepend(str(FOLDER))

    def saved(arguments, tables, *, load="0", keep=True, measured=()):
        sys.modules.pop("table", None)
        table = importlib.import_module("table")
        monkeypatch.setattr(table, "FIGURES", tmp_path)
        monkeypatch.setattr(sys, "argv", ["benchmarks/made.py", *arguments.split(), "--save"])
        table._began["load"] = load
        for name, rows in tables.items():
            table.record(name, COLUMNS, rows)
            table.save(SAVE, keep=keep, measured=measured)
        return json.loads((tmp_path / "made.json").read_text(encoding="utf-8"))

    yield saved
    sys.modules.pop("table", None)


def rows_of(saved, table):
    return {cells[0]: cells[1] for cells in saved["tables"][table]["rows"]}


def test_rows_and_tables_that_a_run_did_not_measure_are_kept(run):
    run("", {"rows": [["a", "1"], ["b", "2"]], "cma": [["a", "7"]]}, load="1")
    saved = run("--rows b c --seeds 0", {"rows": [["b", "3"], ["c", "4"]]}, load="2")
    assert rows_of(saved, "rows") == {"a": "1", "b": "3", "c": "4"}
    assert rows_of(saved, "cma") == {"a": "7"}
    assert saved["command"] == "python benchmarks/made.py --rows b c --seeds 0"
    assert {name: [run["rows"] for run in runs] for name, runs in saved["earlier"].items()} == {
        "rows": [["a"]],
        "cma": [["a"]],
    }
    assert saved["earlier"]["rows"][0]["command"] == "python benchmarks/made.py"
    assert saved["earlier"]["rows"][0]["load"] == "1"


def test_all_rows_of_a_first_cell_are_replaced_together(run):
    run("", {"rows": [["a", "1"], ["a", "2"], ["b", "3"], ["c", "4"], ["c", "5"]]}, load="1")
    saved = run("--rows a b", {"rows": [["b", "6"], ["b", "7"], ["a", "8"]]}, load="2")
    rows = saved["tables"]["rows"]["rows"]
    assert rows == [["a", "8"], ["b", "6"], ["b", "7"], ["c", "4"], ["c", "5"]]
    assert [run["rows"] for run in saved["earlier"]["rows"]] == [["c"]]


def test_rows_are_of_the_run_that_measured_them_last(run):
    run("", {"rows": [["a", "1"], ["b", "2"], ["c", "3"]]}, load="1")
    run("--rows b", {"rows": [["b", "4"]]}, load="2")
    saved = run("--rows c", {"rows": [["c", "5"]]}, load="3")
    found = {run["load"]: run["rows"] for run in saved["earlier"]["rows"]}
    assert found == {"1": ["a"], "2": ["b"]}
    saved = run("", {"rows": [["a", "6"], ["b", "6"], ["c", "6"]]}, load="4")
    assert "earlier" not in saved
    assert set(rows_of(saved, "rows").values()) == {"6"}


def test_rows_that_a_run_no_longer_finds_are_left_out(run):
    tables = {
        "rows": [["a", "1"], ["b", "2"]],
        "crossing": [["a", "3"], ["b", "4"]],
        "cma": [["a", "7"]],
    }
    run("", tables, load="1")
    saved = run("--rows a", {"rows": [["a", "5"]], "crossing": []}, load="2", measured=["a"])
    assert rows_of(saved, "rows") == {"a": "5", "b": "2"}
    assert rows_of(saved, "crossing") == {"b": "4"}
    # This table was not measured at all.
    assert rows_of(saved, "cma") == {"a": "7"}
    assert [run["rows"] for run in saved["earlier"]["crossing"]] == [["b"]]


def test_a_run_that_saves_after_each_table_is_one_run(run):
    saved = run("", {"rows": [["a", "1"]], "cma": [["a", "7"]]})
    assert "earlier" not in saved
    assert saved["tables"].keys() == {"rows", "cma"}


def test_other_columns_replace_a_table(run, monkeypatch):
    run("", {"rows": [["a", "1"]]}, load="1")
    monkeypatch.setattr(sys.modules[__name__], "COLUMNS", ("task", "share"))
    saved = run("--rows b", {"rows": [["b", "2"]]}, load="2")
    assert rows_of(saved, "rows") == {"b": "2"}
    assert "earlier" not in saved


def test_a_whole_run_keeps_nothing(run):
    run("", {"rows": [["a", "1"]], "cma": [["a", "7"]]}, load="1")
    saved = run("", {"rows": [["b", "2"]]}, load="2", keep=False)
    assert saved["tables"].keys() == {"rows"}
    assert rows_of(saved, "rows") == {"b": "2"}
