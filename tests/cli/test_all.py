"""`tcs score --all`: every row of the paper's table."""

from __future__ import annotations

import pytest

import tcs
from tcs.output.terminal import tables
from tests.placement.store.example import METADATA, score_file

ROWS = {
    *((task, "wheelchair") for task in ("shaving", "feeding", "brushing")),
    *(("shaving", environment) for environment in ("bed", "bed-no-wall")),
    ("bathing", "bed"),
    *(
        (f"scratching_{part}", "bed")
        for part in ("chest", *(f"{p}_{s}" for p in ("forearm", "thigh", "upper_arm")
                               for s in ("left", "right")))
    ),
}  # fmt: skip
TIMINGS = dict.fromkeys(
    ("compile_seconds", "scoring_seconds", "sets_seconds", "total_seconds"), 0.5
)


@pytest.fixture
def stand_in(monkeypatch):
    """Calls of `tcs.score`, which returns an example at once."""
    calls = []

    def score(task, environment, robot, **options):
        calls.append((task, environment))
        names = {"task": {"name": task}, "environment": {"name": environment}}
        return score_file(metadata={**METADATA, "timings": TIMINGS}, **names)

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    return calls


def test_all_thirteen_rows_of_the_paper_are_scored(tcs_command, stand_in, tmp_path):
    folder = tmp_path / "made" / "here"
    ran = tcs_command("score", "--all", "--out", folder, "--json")
    assert ran.code == 0
    assert set(stand_in) == ROWS
    assert len(stand_in) == len(ROWS) == 13
    rows = ran.json["rows"]
    assert [(row["task"], row["environment"]) for row in rows] == stand_in
    assert set(rows[0]) >= {
        *("configurations", "goals", "pairs", "reached_pairs", "scoring_seconds"),
        *("compile_seconds", "candidates", "sets", "best", "best_single", "reasons", "file"),
    }
    assert {row["file"] for row in rows} == {str(path) for path in folder.iterdir()}
    assert all(row["file_bytes"] > 1000 for row in rows)


def test_the_text_has_one_line_for_each_row(tcs_command, stand_in, tmp_path):
    ran = tcs_command("score", "--all", "--environment", "bed-no-wall", "--out", tmp_path)
    assert stand_in == [("shaving", "bed-no-wall")]
    (line,) = [line for line in ran.out.splitlines() if "shaving" in line]
    assert "bed-no-wall" in line
    assert "…" not in ran.out


def test_every_name_and_number_is_printed_in_full(tcs_command, stand_in, tmp_path, capsys):
    rows = tcs_command("score", "--all", "--out", tmp_path, "--json").json["rows"]
    # As many digits as the largest of the real rows has in each column.
    large = {
        **dict.fromkeys(("configurations", "sets"), 8_888_888),
        **dict.fromkeys(("reached_pairs", "candidates"), 88_888),
        **dict.fromkeys(("scoring_seconds", "total_seconds"), 888.88),
        **{"goals": 14, "file_bytes": 88_880_000},
    }
    tables.report_rows({"rows": [row | large for row in rows]})
    lines = capsys.readouterr().out.splitlines()
    for task, environment in ROWS:
        assert sum(line.split()[:3] == [task, environment, "8,888,888"] for line in lines) == 1
    assert not any("…" in line for line in lines)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ((), 2, "give a task"),
        (("shaving", "--all"), 2, "give a task, or --all"),
        (("--all", "--environment", "bath"), 1, "bath"),
        (("--all", "--robot", "pr3"), 1, "pr2"),
    ],
)
def test_misuse_and_unknown_names_are_reported(tcs_command, tmp_path, words, code, message):
    ran = tcs_command("score", *words, "--out", tmp_path / "all")
    assert ran.code == code
    assert message in ran.err


def test_a_folder_that_cannot_be_made_is_reported(process, tmp_path):
    (tmp_path / "file").write_text("x")
    ran = process("score", "--all", "--out", tmp_path / "file" / "all")
    assert ran.code == 1
    assert "cannot be created" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.slow
def test_every_row_is_sound(tcs_command, tmp_path):
    rows = tcs_command("score", "--all", "--out", tmp_path, "--json").json["rows"]
    assert len(rows) == 13
    for row in rows:
        # The published sets of two reach all goals of every task, or nearly all.
        assert row["best"]["reachability"] >= 0.99
        found = tcs.verify(tcs.load(row["file"]), pairs=30, dense=0)
        assert found.is_sound
        assert found.checked == 30
