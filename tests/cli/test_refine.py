"""`tcs refine`: output and files."""

from __future__ import annotations

import tcs
from tcs.output.terminal.set_tables import report_refined
from tcs.placement.refinement import refined_file, refinement_summary
from tests.placement.refinement.test_refine import BESIDE


def test_json_and_text(tcs_command, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 20)
    environment, path, out = (tmp_path / name for name in ("beside.yaml", "a.tcs", "b.tcs"))
    environment.write_text(BESIDE)
    tcs.save(path, tcs.score("shaving", environment, paper=True))
    words = ("refine", path, "--out", out, "--starts", 1, "--rounds", 1, "--json")
    ran = tcs_command(*words, "--body-collisions", "none")
    assert (ran.code, ran.err) == (0, "")
    assert ran.json == {"file": str(out), **refinement_summary(tcs.load(out))}
    assert {"before", "after", "seconds"} <= set(ran.json)
    report_refined(ran.json)
    printed = capsys.readouterr().out
    assert "P_R + P_M changes by" in printed
    assert "success under error from" in printed
    assert "collisions of the robot's body are ignored" in printed
    assert tcs_command("select", out, "--here", 1.4, -1.2, 180, "--gamma", 0).code == 0


def test_scoring_with_refinement(tcs_command, tmp_path, monkeypatch):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 20)
    monkeypatch.setattr("tcs.placement.refinement.refined_file.starting_sets", one_start)
    # Of forty rounds; what more of them find is tested with the search.
    monkeypatch.setitem(refined_file.refine.__kwdefaults__, "rounds", 2)
    environment, path = tmp_path / "beside.yaml", tmp_path / "a.tcs"
    environment.write_text(BESIDE)
    words = ("score", "shaving", "--environment", environment, "--out", path, "--refine")
    ran = tcs_command(*words, "--json")
    assert ran.code == 0
    assert ran.json["refinement"] == refinement_summary(tcs.load(path))
    assert ran.json["approach"] is not None


def one_start(file, table, count):
    return [file.tables[table].sets.best]
