"""Tasks whose goals are free, from the file to Drake's re-check."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import yaml

from tcs.kernel.approach import regions
from tcs.kernel.verification import scans
from tcs.model.tasks import Freedom
from tcs.motion import check_approaches
from tcs.placement.scoring import load_job, score, verify
from tcs.placement.scoring.drake_check import ROTATION_BAR, DrakeChecker
from tcs.placement.tables import Reason
from tests.environments import CORNER, write_environment
from tests.exact import exact_content, exact_task


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    """Return shaving with goals that may rotate about y, and an environment."""
    folder = tmp_path_factory.mktemp("free")
    task = folder / "shaving_free.yaml"
    free = {"name": "shaving_free", "free": {"rotation_about": [0, 1, 0]}}
    task.write_text(yaml.safe_dump(exact_content("shaving") | free))
    return task, write_environment(folder, "free-corner", CORNER)


@pytest.fixture(scope="module")
def file(paths):
    return score(*paths)


def test_freedom_only_adds_to_what_is_reached(file, paths, tmp_path):
    fixed = score(exact_task("shaving", tmp_path), paths[1])
    free, nominal = (f.nominal.scores.reason == Reason.REACHED for f in (file, fixed))
    assert np.all(free | ~nominal)
    assert np.sum(free) > np.sum(nominal) > 0


def test_drake_confirms_poses_within_the_freedom(file, monkeypatch):
    monkeypatch.setattr(scans, "ANGLES", 72)
    found = verify(file, pairs=60, dense=3)
    assert found.is_sound
    assert (found.checked, found.missed) == (60, 0)
    assert found.dense_checked > 0


def test_drake_refutes_the_same_solutions_without_the_freedom(file, paths):
    job = load_job(*paths, "pr2")
    scores, h, g = file.nominal.scores, *np.argwhere(file.nominal.scores.reason == 0)[0]
    q = np.asarray(scores.joints_of(h, g), dtype=np.float64)

    def finding(free):
        goals = tuple(dataclasses.replace(goal, free=free) for goal in job.task.goals)
        task = dataclasses.replace(job.task, goals=goals)
        changed = dataclasses.replace(job, task=task)
        drake = DrakeChecker(changed, changed.scene(), "isotropy")
        return drake.check_at(drake.values(h), g, q, scores.dexterity[h, g])

    assert finding(job.task.goals[g].free).is_true
    assert finding(Freedom.of_orientation()).is_true
    assert finding(None).rotation_error > ROTATION_BAR
    assert not finding(Freedom(axis=(1.0, 0.0, 0.0), rotates=True)).is_true


def test_the_file_says_what_is_free(file):
    assert file.task["goals"][0]["free"] == "any rotation about y"


def test_lines_lead_to_the_poses_that_are_held(file, paths):
    assert "approach" in file.metadata
    found = check_approaches(file, pairs=12)
    assert (found.checked, found.false) == (12, 0)
    without = score(*paths, approach=False)
    before, after = (f.nominal.scores.reached for f in (without, file))
    assert not np.any(after & ~before)
    assert np.any(before & ~after)


def test_other_poses_are_tried_where_no_line_leads_to_the_best(file, paths, monkeypatch):
    monkeypatch.setattr(regions, "_try_other_poses", lambda *_: None)
    first = score(*paths).nominal.scores.reached
    reached = file.nominal.scores.reached
    assert np.all(reached | ~first)
    assert np.any(reached & ~first)
