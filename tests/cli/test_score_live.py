from __future__ import annotations

import math
from pathlib import Path

import pytest

import tcs


def test_the_environment_is_scored_as_observed(tcs_command, corner, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = (
        "--environment",
        corner,
        "--observed",
        "person_x=0.025",
        "--observed",
        "head_tilt_deg=3",
    )
    ran = tcs_command("score", "shaving", *words, "--json")
    assert ran.code == 0
    assert ran.json["tables"][0]["observed"] == {"person_x": 0.025, "head_tilt_deg": 3.0}
    # Not the name of the file that is scored offline.
    path = Path(ran.json["file"])
    assert path == Path("shaving-corner-pr2-live.tcs")
    expected = tcs.score_observed(
        "shaving",
        corner,
        observation={"person_x": 0.025, "head_tilt": math.radians(3.0)},
    )
    assert (tcs.load(path).nominal.scores.dexterity == expected.nominal.scores.dexterity).all()
    assert tcs_command("verify", path, "--pairs", 5, "--dense", 0).code == 0
    assert tcs_command("map", path, "--out", tmp_path / "map.png").code == 0


def test_observed_frames_and_their_residual_are_reported(tcs_command, corner, tmp_path):
    # The head belongs at (0.451, 0, 1.232); no joint raises it by 20 mm.
    words = ("--frames", "head=0.451,0,1.252", "--out", tmp_path / "live.tcs")
    ran = tcs_command("score", "shaving", "--environment", corner, *words)
    assert ran.code == 0
    assert ran.out.splitlines()[:2] == [
        "scored as observed: everything at its nominal position",
        "observed frames fit to 0.0200 m",
    ]


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--observed", "head_tilt=3"), 1, "Write head_tilt_deg=VALUE"),
        (("--observed", "persn_x=0.1"), 1, "Did you mean 'person_x'"),
        (("--frames", "head=0,0"), 1, "three finite numbers"),
        (("--frames", "head=0.451,0,1.5"), 1, "0.268 m from the scene's"),
        (("--at", "bed_height=0.1"), 2, "--at"),
    ],
)
def test_impossible_observations_are_reported(tcs_command, corner, tmp_path, words, code, message):
    path = tmp_path / "live.tcs"
    ran = tcs_command("score", "shaving", "--environment", corner, "--out", path, *words)
    assert ran.code == code
    assert message in ran.err
    assert not path.exists()


def test_all_rows_are_not_scored_as_observed(tcs_command):
    ran = tcs_command("score", "--all", "--observed", "person_x=0.1")
    assert ran.code == 2
    assert "requires one task" in ran.err
