"""The command `tcs locate`."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.perception import Located, PlanarPose, load_located
from tests.capability.arplace.example import discs, model


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


@pytest.fixture
def located(tmp_path):
    """A table 1 m before the base with an error of some centimetres."""
    path = tmp_path / "table.json"
    Located("thesis", PlanarPose(1.0, 0.2, 0.1), np.diag([0.03, 0.02, 0.02]) ** 2).save(path)
    return path


def test_selection_from_a_located_table(tcs_command, small_file, located):
    words = ("select", small_file, "--located", located, "--task-at", 2, 0.5, 0)
    result = tcs_command(*words, "--json").json
    base = PlanarPose(2.0, 0.5, 0.0) @ PlanarPose(1.0, 0.2, 0.1).inverse()
    assert result["located"]["here"] == pytest.approx(
        {"x": base.x, "y": base.y, "yaw_deg": np.degrees(base.yaw)}
    )
    assert 0.0 <= result["located"]["same_set"] <= 1.0
    there = result["located"]["here"]
    given = tcs_command("select", small_file, "--here", *there.values(), "--json").json
    assert given["members"] == result["members"]
    assert "located at x" in tcs_command(*words).out
    assert tcs_command("select", small_file, "--located", located).code == 2
    assert tcs_command("select", small_file, "--here", 1, 0, 0, "--task-at", 0, 0, 0).code == 2


def test_arplace_at_a_located_table(tcs_command, located, tmp_path):
    from tcs.capability.arplace import save_arplace

    path = tmp_path / "made-up.arp"
    save_arplace(path, model(discs()))
    words = ("arplace", "query", path, "--samples", 1)
    result = tcs_command(*words, "--located", located, "--json").json
    best = result["best"]
    target = PlanarPose(1.0, 0.2, 0.1) @ PlanarPose(best["x"], best["y"], 0.0)
    assert result["drive_to"] == pytest.approx(target.to_json())
    assert result["success"] < tcs_command(*words, "--json").json["success"]
    assert "drive to x" in tcs_command(*words, "--located", located).out
