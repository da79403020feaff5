"""Approaches of score files, re-checked with Drake: true ones hold, false ones are found."""

from __future__ import annotations

import dataclasses
import json

import pytest
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tcs.errors import TcsError
from tcs.motion import approach_check, check_approaches
from tcs.placement.scoring.rebuild import rebuild_scenes
from tests.environments import CORNER, write_environment
from tests.placement.scoring.test_hands import GOALS, write_task


@pytest.fixture(scope="module")
def claimed(two_goals):
    """A file whose two goals claim to be approachable: from one posture no approach exists."""
    file = tcs.load(two_goals)
    return dataclasses.replace(file, metadata={**file.metadata, "approach": {"tool_speed": 0.1}})


@pytest.fixture(scope="module")
def findings(claimed):
    """The scene of the claims, and the finding on each."""
    scene = approach_check.ApproachScene.of(*rebuild_scenes(claimed)[0])
    scores = claimed.nominal.scores
    return scene, [scene.check(0, g, scores.joints_of(0, g).astype(float)) for g in (0, 1)]


def test_a_true_approach_is_straight_and_within_limits(findings):
    _, found = findings
    true = next(one for one in found if one is not None)
    assert true.is_true
    assert 0.0 < true.line_error < 1e-3
    assert 0.0 < true.speed < 1.1


def test_a_bent_approach_is_false(findings, claimed, monkeypatch):
    scene, found = findings
    g = next(g for g, one in enumerate(found) if one is not None)
    original = approach_check.approach_spline

    def bent(*words):
        points, tangents = original(*words)
        points[1] += 0.02
        return points, tangents

    monkeypatch.setattr(approach_check, "approach_spline", bent)
    again = scene.check(0, g, claimed.nominal.scores.joints_of(0, g).astype(float))
    assert not again.is_true
    assert again.line_error > 1e-3


def test_verify_finds_a_posture_without_approach(claimed, tmp_path):
    path = tmp_path / "claimed.tcs"
    tcs.save(path, claimed)
    words = ["verify", str(path), "--pairs", "40", "--dense", "0"]
    ran = CliRunner().invoke(app, [*words, "--json"])
    found = json.loads(ran.stdout)
    assert ran.exit_code == 1
    assert found["false_reached"] == 0
    assert (found["approaches"]["checked"], found["approaches"]["false"]) == (2, 1)
    assert found["verdict"] == "SOME ANSWERS ARE FALSE"


def test_each_hand_is_checked_by_itself(tmp_path):
    file = tcs.score(write_task(tmp_path, GOALS), write_environment(tmp_path, "corner", CORNER))
    assert len(file.hands) > 1
    assert file.nominal.scores.reached.any(axis=0).sum() > 1
    found = check_approaches(file, pairs=3)
    assert (found.checked, found.false) == (3, 0)


def test_files_without_approaches_are_refused(two_goals):
    with pytest.raises(TcsError, match="without approach"):
        check_approaches(tcs.load(two_goals))
