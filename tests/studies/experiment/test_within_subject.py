"""The experiment: orders of the conditions, and that its numbers are those of its trials."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.capability import read_csv
from tcs.errors import TcsError
from tcs.output.report import as_html, as_markdown
from tcs.output.report.blocks import Collapsible, Picture, Table
from tcs.teleop import load_arm
from tcs.teleop.runs.run_files import load_run
from tcs_studies.experiment.course import find_course
from tcs_studies.experiment.maps import controller_maps
from tcs_studies.experiment.trial import CONDITIONS, END_EFFECTOR, MEASURES, NOVEL, measure
from tcs_studies.experiment.within_subject import (
    SCRIPTED,
    ExperimentPlan,
    median_ratio,
    run_experiment,
    trial_rows,
)
from tcs_studies.output.report.experiment.page import experiment_page

SMALL = ExperimentPlan(operators=3, training=0, trials=1, time_limit=12.0)


@pytest.fixture(scope="module")
def saved(iiwa, course, tmp_path_factory):
    """A very small experiment with a short time limit, and the folder of its runs."""
    folder = tmp_path_factory.mktemp("runs")
    return run_experiment(iiwa, course, SMALL, runs=folder), folder


def test_two_controllers_take_turns_as_in_table_1():
    plan = ExperimentPlan(conditions=(END_EFFECTOR, NOVEL))
    orders = [[one.name for one in plan.order(k)] for k in range(26)]
    assert orders[0::2] == [["end-effector", "novel"]] * 13
    assert orders[1::2] == [["novel", "end-effector"]] * 13


def test_three_controllers_take_turns_evenly():
    plan = ExperimentPlan(operators=24)
    first = [plan.order(k)[0].name for k in range(24)]
    assert sorted(first) == sorted([c.name for c in CONDITIONS] * 8)


def test_every_operator_uses_every_controller(saved):
    experiment, _ = saved
    assert list(experiment.drives) == [one.name for one in CONDITIONS]
    for drives in experiment.drives.values():
        assert [drive.operator for drive in drives] == [0, 1, 2]
        assert all(len(drive.trials) == 1 and not drive.training for drive in drives)


def test_numbers_are_those_of_the_saved_runs(saved, course):
    experiment, folder = saved
    assert len(list(folder.iterdir())) == 9
    for condition, drives in experiment.drives.items():
        for drive in drives:
            name = f"{condition}-operator-{drive.operator + 1:02d}-trial-1.csv"
            found = measure(load_run(folder / name), course, time_limit=12.0)
            for what in MEASURES:
                # Ten digits are written; work and arc length are sums over differences of them.
                assert getattr(found, what) == pytest.approx(
                    getattr(drive.trials[0], what), rel=1e-4, abs=1e-9
                )


def test_saved_runs_feed_capability_maps(saved, iiwa):
    _, folder = saved
    run = load_run(folder / "novel-operator-01-trial-1.csv")
    recording = read_csv(folder / "novel-operator-01-trial-1.csv", iiwa.robot)
    np.testing.assert_allclose(recording.joints, run.joints, atol=1e-8)


def test_an_operator_is_the_same_person_with_each_controller(iiwa, course):
    plan = ExperimentPlan(operators=3, training=0, trials=1, time_limit=1.0)
    small = run_experiment(iiwa, course, plan)
    more = run_experiment(
        iiwa, course, ExperimentPlan(operators=4, training=0, trials=1, time_limit=1.0)
    )
    # Other operators change neither the traits nor the trials of an operator.
    assert more.traits[:3] == small.traits
    for condition in small.drives:
        for one, other in zip(small.drives[condition], more.drives[condition], strict=False):
            assert one.trials == other.trials


@pytest.mark.slow
def test_the_number_of_processes_changes_no_result(saved, iiwa, course):
    experiment, _ = saved
    again = run_experiment(iiwa, course, SMALL, jobs=2)
    for condition, drives in experiment.drives.items():
        assert [d.trials for d in drives] == [d.trials for d in again.drives[condition]]


@pytest.mark.parametrize(
    "changes",
    [
        {"operators": 2},
        {"trials": 0},
        {"training": -1},
        {"time_limit": 0.0},
        {"time_limit": float("nan")},
        {"conditions": (NOVEL,)},
        {"conditions": (NOVEL, NOVEL)},
    ],
)
def test_a_plan_that_compares_nothing_is_refused(changes):
    with pytest.raises(TcsError, match="experiment"):
        ExperimentPlan(**changes)


def test_rows_of_all_trials(saved):
    experiment, _ = saved
    rows = trial_rows(experiment, ["time", "accuracy"])
    assert len(rows) == 9
    assert {row[0] for row in rows} == {1, 2, 3}
    assert {row[2] for row in rows} == {1, 2, 3}
    assert not any(row[3] for row in rows)


def tables(blocks):
    for block in blocks:
        if isinstance(block, Collapsible):
            yield from tables(block.blocks)
        elif isinstance(block, Table | Picture):
            yield block


def varied(experiment):
    """The trials of the small experiment all take 12 s; give their times some spread to test."""
    from dataclasses import replace

    drives = {
        name: tuple(
            replace(drive, trials=tuple(replace(t, time=t.time + k + i % 2) for t in drive.trials))
            for i, drive in enumerate(of_one)
        )
        for k, (name, of_one) in enumerate(experiment.drives.items())
    }
    return replace(experiment, drives=drives)


def test_every_table_and_picture_says_that_no_people_took_part(saved):
    experiment, _ = saved
    page = experiment_page(varied(experiment), seconds=1.0, command="tcs teleop experiment")
    shown = [block for section in page.sections for block in tables(section.blocks)]
    assert len(shown) >= 9
    for block in shown:
        assert SCRIPTED.lower() in block.caption.lower(), block.caption
    assert SCRIPTED in page.lead
    assert SCRIPTED in page.foot
    html, markdown = as_html(page), as_markdown(page)
    assert html.count("<svg") == 6
    assert "r = z/√(2N)" in markdown


@pytest.mark.slow
def test_from_operator_to_recording_to_map():
    """On TIAGo, which has a head: the recorded postures give base poses."""
    arm = load_arm("tiago", torso_height=0.175)
    plan = ExperimentPlan(operators=3, training=1, trials=1)
    found = controller_maps(run_experiment(arm, find_course(arm), plan))
    assert [one.condition for one in found.maps] == [one.name for one in CONDITIONS]
    assert found.maps[0].shared_fraction == 1.0
    sizes = {one.condition: len(one.capability.cells) for one in found.maps}
    # Recovery by hand motion brings the arm to more postures than following the line.
    assert sizes["end-effector"] > sizes["novel"] > sizes["assisted"] > 10
    for one in found.maps:
        assert one.best is not None
        assert one.grasp_cells > 0
        assert 0.0 < one.mean_score <= 1.0


@pytest.mark.slow
def test_the_experiment_of_the_paper(iiwa, course):
    """26 operators with three trials each, as in the paper, with traits that were not fitted."""
    plan = ExperimentPlan(conditions=(END_EFFECTOR, NOVEL))
    experiment = run_experiment(iiwa, course, plan, jobs=2)
    assert median_ratio(experiment, "accuracy") <= 0.5
    tests = experiment.tested()
    assert tests["accuracy"].p < 0.001
    assert tests["effort"].p < 0.001
    assert experiment.sample("novel", "finished").mean() > 0.9
