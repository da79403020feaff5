"""`tcs refine`: output and files."""

from __future__ import annotations

import tcs
from tcs.output.terminal.refinement_tables import report_refined
from tcs.placement.refinement import refinement_summary
from tests.placement.refinement.test_refine import BESIDE


def test_json_and_text(tcs_command, tmp_path, capsys):
    environment, path, out = (tmp_path / name for name in ("beside.yaml", "a.tcs", "b.tcs"))
    environment.write_text(BESIDE)
    tcs.save(path, tcs.score("shaving", environment))
    ran = tcs_command("refine", path, "--out", out, "--starts", 1, "--rounds", 1, "--json")
    assert (ran.code, ran.err) == (0, "")
    assert ran.json == {"file": str(out), **refinement_summary(tcs.load(out))}
    assert {"before", "after", "bound", "seconds"} <= set(ran.json)
    report_refined(ran.json)
    assert "no set between the grid's ends exceeds" in capsys.readouterr().out
    assert tcs_command("select", out, "--here", 1.4, -1.2, 180, "--gamma", 0).code == 0
