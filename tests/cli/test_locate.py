"""The command `tcs locate`."""

from __future__ import annotations

import pytest

from tcs.perception import load_located


def test_a_simulated_table_is_found(tcs_command, tmp_path):
    out, scans = tmp_path / "table.json", tmp_path / "scans.csv"
    words = ("locate", "--table-at", 1.0, 0.2, 10, "--task", 0.1, 0, 0)
    result = tcs_command(*words, "--out", out, "--save-scans", scans, "--json").json
    assert result["error"]["position"] < 0.02
    assert result["pose"]["yaw_deg"] == pytest.approx(10, abs=1)
    assert [leg["name"] for leg in result["legs"]][:1] == ["front left"]
    assert load_located(out).pose.x == pytest.approx(result["pose"]["x"], abs=1e-9)
    again = tcs_command("locate", scans, "--task", 0.1, 0, 0, "--json").json
    assert "error" not in again
    for key, value in result["pose"].items():
        # Scans are written to a tenth of a millimetre.
        assert again["pose"][key] == pytest.approx(value, abs=0.02)
    text = tcs_command("locate", scans, "--method", "two-blobs").out
    assert "back left not seen" in text


def test_beside_a_wheelchair(tcs_command):
    words = ("locate", "--environment", "wheelchair", "--here", -1, -1.6, 0)
    result = tcs_command(*words, "--table-at", 0, -1.5, 0, "--json").json
    assert result["error"]["position"] < 0.02
    ran = tcs_command(*words)
    assert ran.code == 1
    assert "table 'thesis' is not found" in ran.err or "not in view" in ran.err


def test_what_cannot_be_done_is_refused(tcs_command, tmp_path):
    assert tcs_command("locate", tmp_path / "none.csv").code == 1
    assert tcs_command("locate", tmp_path / "none.csv", "--seed", 1).code == 2
    assert tcs_command("locate", "--table", "round").code == 1
    assert tcs_command("locate", "--table-at", 1, 0, 1e9).code == 1
