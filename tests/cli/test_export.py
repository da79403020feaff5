import numpy as np
import pandas as pd
import pytest

import tcs
from tcs.model.grid import Grid
from tcs.placement.tables import Reason
from tests.placement.store.example import score_file


def test_table_holds_the_scores(tcs_command, small_file, tmp_path):
    path = tmp_path / "scores.csv"
    ran = tcs_command("export", small_file, "--out", path, "--all", "--json")
    assert ran.code == 0
    file = tcs.load(small_file)
    table = pd.read_csv(path, index_col="configuration")
    assert ran.json == {"file": str(path), "rows": len(table), "columns": list(table.columns)}
    grid = Grid.from_dict(file.grid)
    assert list(table.index) == list(range(grid.size))
    for h in (0, 7, grid.size - 1):
        row = table.loc[h]
        for name, value in grid.configuration(h).to_json().items():
            # Nine digits are written.
            assert row[name] == pytest.approx(value, rel=1e-8, abs=1e-12)
        for g in range(file.nominal.scores.goals):
            assert row[f"reason_{g}"] == Reason(file.nominal.scores.reason[h, g]).name.lower()
            assert np.float32(row[f"dexterity_{g}"]) == file.nominal.scores.dexterity[h, g]
    np.testing.assert_allclose(table["reachability"], file.nominal.scores.reachability(), rtol=1e-8)
    np.testing.assert_allclose(
        table["manipulability"], file.nominal.scores.manipulability(), rtol=1e-8
    )


def test_only_candidates_by_default(tcs_command, tmp_path):
    stored, path = tmp_path / "s.tcs", tmp_path / "scores.csv"
    file = score_file(share=0.05)
    tcs.save(stored, file)
    ran = tcs_command("export", stored, "--out", path)
    assert ran.code == 0
    table = pd.read_csv(path, index_col="configuration")
    assert list(table.index) == file.nominal.sets.candidates.tolist()
    assert 0 < len(table) < file.nominal.scores.configurations
    assert f"{len(table):,} rows" in ran.out


def test_unwritable_path(tcs_command, small_file, tmp_path):
    ran = tcs_command("export", small_file, "--out", tmp_path / "none" / "scores.csv")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [small_file]


def test_half_a_table_is_not_left(tcs_command, small_file, tmp_path, monkeypatch):
    def to_csv(_frame, stream, **_options):
        stream.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(pd.DataFrame, "to_csv", to_csv)
    ran = tcs_command("export", small_file, "--out", tmp_path / "scores.csv")
    assert ran.code == 130
    assert list(tmp_path.iterdir()) == [small_file]
