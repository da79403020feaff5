"""`tcs evaluate`: what it prints, and what it refuses."""

from __future__ import annotations

import pytest

import tcs
from tests.store.example import score_file

ROOM = """
based_on: wheelchair
name: beside
title: A few places beside the wheelchair
grid:
  base_x: {unit: m, start: 0.6, step: 0.2, count: 4}
  base_y: {unit: m, start: -0.95, step: 1.7, count: 2}
  base_yaw: {unit: deg, start: 90, step: 90, count: 2}
  torso: {unit: m, start: 0.15, step: 0.15, count: 2}
"""


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("beside")
    room = folder / "beside.yaml"
    room.write_text(ROOM)
    path = folder / "beside.tcs"
    tcs.save(path, tcs.score("shaving", room))
    return path


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ((), {}),
        (("--select", "single", "--seed", 3, "--jobs", 1), {"select": "single", "seed": 3}),
        (("--select", "uniform", "--members", 1), {"select": "uniform", "members": 1}),
        (("--check-base",), {"check_base": True}),
    ],
    ids=str,
)
def test_json_is_what_python_returns(tcs_command, stored, words, options):
    ran = tcs_command("evaluate", stored, "--samples", 40, *words, "--json")
    assert (ran.code, ran.err) == (0, "")
    expected = tcs.evaluate(tcs.load(stored), samples=40, **options).to_json()
    told = ran.json
    assert told.pop("seconds") > 0
    expected.pop("seconds")
    assert told == expected


def test_a_person_reads_the_mean_and_the_errors(tcs_command, stored):
    ran = tcs_command("evaluate", stored, "--samples", 40)
    found = tcs.evaluate(tcs.load(stored), samples=40)
    assert f"under error {found.summary.mean:.1%} of the goals" in ran.out
    assert "person_yaw sd 5 deg" in ran.out
    assert "the base is not checked, as in the paper" in ran.out


def test_an_error_file_takes_the_place_of_the_environments(tcs_command, stored, tmp_path):
    path = tmp_path / "errors.yaml"
    path.write_text("errors: {person_x: {distribution: uniform, half_width: 0.01}}\n")
    told = tcs_command("evaluate", stored, "--errors", path, "--samples", 5, "--json").json
    assert told["errors"] == {"person_x": {"distribution": "uniform", "half_width": 0.01}}


def test_a_misspelt_joint_is_named_with_the_nearest(tcs_command, stored, tmp_path):
    path = tmp_path / "errors.yaml"
    path.write_text("errors: {head_tlit: {distribution: normal, std_deg: 5}}\n")
    ran = tcs_command("evaluate", stored, "--errors", path)
    assert (ran.code, ran.out) == (1, "")
    assert "Did you mean 'head_tilt'?" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--samples", 0), 1, "samples is 0; must be 1 to 1,000,000."),
        (("--select", "bets"), 1, "Did you mean 'best'?"),
        (("--members", 1), 2, "--members"),
        (("--observed", "person_y=0.1"), 1, "unknown observed axis 'person_y'"),
        (("--errors", "nowhere.yaml"), 1, "nowhere.yaml' cannot be read"),
    ],
    ids=str,
)
def test_what_makes_no_sense_is_refused(tcs_command, stored, words, code, said):
    ran = tcs_command("evaluate", stored, *words)
    assert (ran.code, ran.out) == (code, "")
    assert said in ran.err


def test_a_file_of_other_models_is_refused(tcs_command, tmp_path):
    path = tmp_path / "old.tcs"
    tcs.save(path, score_file())
    ran = tcs_command("evaluate", path)
    assert ran.code == 1
    assert "were made by tcs 0.1.0 from other models" in ran.err
