"""An arm that no closed form solves, from robot file to verified answers: a bent iiwa."""

from __future__ import annotations

import shutil

import pytest

import tcs
from tcs.files.paths import data_folder
from tcs.model.grid import InitialConfiguration
from tcs.output.terminal.tables import NUMERIC_NOTE, report_scores
from tcs.output.words import summary_in_words
from tcs.placement.reasons import explain
from tcs.placement.scoring import score, summary, verify
from tcs.placement.selection import select
from tcs.placement.tables import Reason

# Axes of shoulder and wrist 2 cm beside the ones before them, the hand 1 cm beside the wrist.
OFFSETS = {'xyz="0 0 0.2155"': 'xyz="0.02 0 0.2155"', 'xyz="0 0.0805 0"': 'xyz="0 0.0805 0.01"'}
ENVIRONMENT = """
based_on: wheelchair
name: small-wheelchair
title: The wheelchair, seen from a few places
grid:
  base_x: {unit: m, start: -1.0, step: 0.25, count: 9}
  base_y: {unit: m, start: -1.0, step: 0.25, count: 9}
  base_yaw: {unit: deg, start: 0, step: 90, count: 4}
  torso: {unit: m, start: 0, step: 0.1, count: 1}
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Paths of a robot file and of an environment file."""
    folder = tmp_path_factory.mktemp("bent")
    for name in ("iiwa7.urdf", "iiwa7.yaml", "iiwa7_primitives.csv"):
        shutil.copy(data_folder() / "models" / "robots" / name, folder / name)
    text = (folder / "iiwa7.urdf").read_text()
    for before, after in OFFSETS.items():
        assert before in text
        text = text.replace(before, after)
    (folder / "iiwa7.urdf").write_text(text)
    (folder / "environment.yaml").write_text(ENVIRONMENT)
    return folder / "iiwa7.yaml", folder / "environment.yaml"


@pytest.fixture(scope="module")
def scored(files):
    """Feeding, scored."""
    robot, environment = files
    return score("feeding", environment, robot, paper=True)


def test_the_file_records_numeric_ik(scored, tmp_path, capsys):
    assert scored.metadata["ik"] == "numeric"
    figures = summary(scored)
    assert figures["ik"] == "numeric"
    path = tmp_path / "bent.tcs"
    tcs.save(path, scored)
    assert tcs.load(path).metadata["ik"] == "numeric"
    report_scores({**summary_in_words(scored, figures), "file": str(path)})
    printed = " ".join(capsys.readouterr().out.split())
    assert NUMERIC_NOTE in printed


def test_the_closed_form_is_recorded_without_a_note(capsys):
    figures = {
        "ik": "analytic", "configurations": 1, "goals": 1, "scoring_seconds": 0.1, "candidates": 0,
        "tile": 0.0, "sets": 0, "reasons": {}, "best_single": None, "best": None, "file": "x",
        "pairs": 1, "paper": False, "approach": None, "recommended": None,
    }  # fmt: skip
    report_scores(figures)
    assert "Numeric" not in capsys.readouterr().out


def test_drake_confirms_what_is_scored_and_many_starts_find_little_more(scored):
    assert scored.nominal.scores.reached.sum() > 50
    found = verify(scored, pairs=100, dense=20)
    assert found.ik == "numeric"
    assert found.checked >= 50
    assert found.false_reached == 0
    assert found.is_sound
    # Twenty unreached pairs to a hundred reached ones: two or three missed would show.
    assert found.recall > 0.98
    # The refined winner is as good as the best of many unrefined ones.
    assert found.mean_shortfall < 1e-3


def test_it_is_chosen_from_and_explained_like_any_other(scored):
    here = InitialConfiguration(base_x=1.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    choice = select(scored, here)
    assert choice.reachability > 0.0
    explanation = explain(scored, 0)
    assert sum(explanation.distribution.reasons.values()) == scored.nominal.scores.reason.shape[0]
    assert explanation.distribution.reasons[Reason.TOO_FAR] > 0


@pytest.mark.slow
def test_baxter_feeds_a_person_in_a_wheelchair():
    """The shipped robot with such an arm, on the whole grid."""
    file = score("feeding", "wheelchair", "baxter", paper=True)
    assert file.metadata["ik"] == "numeric"
    assert file.nominal.sets.best_single
    single = file.nominal.sets.best_single
    reached = file.nominal.scores.reached[list(single)].any(axis=0)
    # Measured: all seven goals from one place.
    assert reached.all()
    found = verify(file, pairs=500, dense=300)
    assert (found.checked, found.false_reached) == (500, 0)
    assert found.is_sound
    # Measured with 2000 pairs of either type: none missed. One of 249 to 2,784 reached gives 0.996.
    assert found.recall > 0.99


def test_jobs_do_not_matter(files, scored):
    robot, environment = files
    one = score("feeding", environment, robot, jobs=1, paper=True)
    for name in ("reason", "pair", "dexterity", "arm_joints"):
        first, second = (getattr(f.nominal.scores, name) for f in (one, scored))
        assert (first == second).all(), name
