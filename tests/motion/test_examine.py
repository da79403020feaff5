"""Which goals can be done from the configurations of a file, and their selection."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tcs.errors import TcsError
from tcs.motion.examine import drawn, worth_examining
from tcs.placement.store import load_motions, motion_path
from tcs.placement.tables import MotionOutcome
from tests.placement.store.example import score_file


def run(*words):
    ran = CliRunner().invoke(app, [*map(str, words)])
    assert ran.exception is None or isinstance(ran.exception, SystemExit)
    return ran


def test_examination_agrees_with_the_plan(two_goals, planned):
    file = tcs.load(two_goals)
    (table,) = tcs.examine(file, jobs=1).tables
    assert table.configurations.tolist() == [0]
    assert table.done.tolist() == [[result.done for result in planned.results]]
    assert table.outcome.tolist() == [[MotionOutcome.DONE, MotionOutcome.APPROACH_LIMITS]]


def test_the_command_writes_beside_the_file_and_select_counts_only_what_can_be_done(two_goals):
    ran = run("motions", two_goals, "--json", "--jobs", 1)
    result = json.loads(ran.stdout)
    assert result["file"] == str(motion_path(two_goals))
    assert (result["pairs"], result["done"]) == (2, 1)
    assert result["not_done"]["approach_limits"] == 1
    (one,) = result["results"]
    assert one["done"] == [0]
    assert one["not_done"] == [{"goal": 1, "reason": "approach_limits", "pair": None}]
    chosen = json.loads(
        run("select", two_goals, "--here", 0.6, -0.9, 45, "--executable", "--json").stdout
    )
    assert chosen["reachability"] == 0.5
    found = chosen["executable"]
    assert (found["goals_done"], found["examined"], found["candidates"]) == ([0], 1, 1)
    assert found["by_postures"]["reachability"] == 1.0
    assert found["by_postures"]["reachability_done"] == 0.5
    assert found["costs"]["reachability"] == 0.5
    text = run("select", two_goals, "--here", 0.6, -0.9, 45, "--executable").stdout
    assert "goals with motions: 1" in text
    assert "1 of 2 reached pairs can be done" in run("motions", two_goals, "--jobs", 1).stdout


def test_outcomes_do_not_depend_on_the_threads_and_are_those_of_the_file(two_goals, tmp_path):
    file = tcs.load(two_goals)
    tables = [tcs.examine(file, jobs=jobs).tables[0] for jobs in (1, 2)]
    run("motions", two_goals, "--out", tmp_path / "m.motions", "--pairs", "--most", 7)
    (stored,) = load_motions(tmp_path / "m.motions").tables
    for table in (*tables, stored):
        np.testing.assert_array_equal(table.outcome, tables[0].outcome)
        np.testing.assert_array_equal(table.pair, tables[0].pair)


def test_the_best_candidates_come_first():
    sets = score_file(share=0.3).nominal.sets
    everything = worth_examining(sets, None, None)
    np.testing.assert_array_equal(everything, np.arange(len(sets.candidates)))
    near, nearer = worth_examining(sets, 0.2, None), worth_examining(sets, 0.02, None)
    assert 0 < len(nearer) < len(near) < len(everything)
    assert set(nearer) <= set(near)
    members = np.searchsorted(sets.candidates, sets.best)
    assert set(worth_examining(sets, None, len(members))) == set(members)
    assert set(members) <= set(worth_examining(sets, 0.0, None))


@pytest.mark.parametrize("wrong", [{"within": -0.1}, {"within": float("nan")}, {"most": 0}])
def test_impossible_fractions_and_numbers_are_refused(wrong):
    with pytest.raises(TcsError, match=next(iter(wrong))):
        worth_examining(score_file().nominal.sets, **({"within": None, "most": None} | wrong))


def test_a_sample_is_drawn_by_its_seed_without_repetition():
    rows = np.arange(5, 45)
    samples = [drawn(rows, 12, seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(*samples[:2])
    assert set(samples[0]) != set(samples[2])
    for sample in samples:
        assert np.all(np.diff(sample) > 0)
        assert (len(sample), set(sample) <= set(rows)) == (12, True)
    assert drawn(rows, None, 0) is drawn(rows, 40, 0) is rows
    with pytest.raises(TcsError, match="sample"):
        drawn(rows, 0, 0)


def test_nothing_is_examined_by_no_thread(two_goals):
    with pytest.raises(TcsError, match="jobs"):
        tcs.examine(tcs.load(two_goals), jobs=0)
