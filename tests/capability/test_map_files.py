import joblib
import numpy as np
import pytest

from tcs.capability import MapGrid, export_text, import_text, load_map, save_map
from tcs.errors import DataFileError, OutputError, StoreFormatError

ARRAYS = ("cells", "manipulability", "visibility", "free_torso_heights", "joints", "torso_heights")


@pytest.fixture
def stored(ihcm, tmp_path):
    path = tmp_path / "map.tcm"
    save_map(path, ihcm)
    return path


def test_load_returns_what_was_saved(ihcm, stored):
    back = load_map(stored)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(back, name), getattr(ihcm, name))
    assert (back.grid, back.map_type, back.torso_height) == (
        ihcm.grid,
        ihcm.map_type,
        ihcm.torso_height,
    )
    assert back.metadata == ihcm.metadata
    assert back.manipulability_scale == ihcm.manipulability_scale


def test_a_truncated_map_is_refused(stored):
    stored.write_bytes(stored.read_bytes()[:-100])
    with pytest.raises(StoreFormatError, match=r"Capability map .* truncated.*from-ik"):
        load_map(stored)


def test_a_score_file_is_not_a_map(tmp_path):
    path = tmp_path / "scores.tcs"
    joblib.dump({"format": "tcs scores", "format_version": 1}, path)
    with pytest.raises(StoreFormatError, match="contains no capability map"):
        load_map(path)


def test_a_map_of_the_first_format_version_is_refused_with_advice(stored):
    content = joblib.load(stored)
    joblib.dump(content | {"format_version": 1}, stored)
    message = r"format version 1, .* reads version 2.*Make the map again"
    with pytest.raises(StoreFormatError, match=message):
        load_map(stored)


def test_text_cannot_be_written_into_a_missing_folder(ihcm, tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        export_text(tmp_path / "none" / "map", ihcm)


def test_text_contains_base_poses_in_the_tool_frame(ihcm, tmp_path):
    path = tmp_path / "map.txt"
    export_text(path, ihcm)
    table = np.loadtxt(path)
    R_TB, p_TB = ihcm.grid.base_in_tool(ihcm.cells)
    np.testing.assert_allclose(table[:, 0], ihcm.manipulability, rtol=1e-6)
    # Nine digits are written.
    np.testing.assert_allclose(table[:, 1:4], p_TB, atol=1e-8)
    np.testing.assert_allclose(table[:, 4:], R_TB.reshape(-1, 9), atol=1e-8)


def test_text_round_trip(ihcm, reach, tmp_path):
    path = tmp_path / "map.txt"
    export_text(path, ihcm)
    back = import_text(path, reach, ihcm.grid, map_type="IHCM")
    np.testing.assert_array_equal(back.cells, ihcm.cells)
    np.testing.assert_allclose(back.manipulability, ihcm.manipulability, rtol=1e-6)
    np.testing.assert_allclose(back.visibility, ihcm.visibility, atol=1e-6)
    assert len(back.joints) == 0
    # A text file has no postures, so every torso height counts as free.
    levels = len(back.torso_heights)
    assert levels > 1
    assert np.all(back.free_torso_heights & ((1 << levels) - 1) == (1 << levels) - 1)


def test_of_two_equal_poses_the_better_score_is_kept(ihcm, reach, tmp_path):
    path = tmp_path / "map.txt"
    export_text(path, ihcm)
    line = path.read_text().splitlines()[0]
    rest = line.split(" ", 1)[1]
    path.write_text(f"0.01 {rest}\n0.07 {rest}\n0.03 {rest}\n")
    back = import_text(path, reach, ihcm.grid)
    assert back.manipulability.tolist() == pytest.approx([0.07])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("0.1 0 0\n", "line 1: must be 13"),
        ("0.1 0 0 0 1 0 0 0 1 0 0 0 nan\n", "line 1: must be 13"),
        ("0.1 0 0 0 1 0 0 0 1 0 0 0 one\n", "line 1: must be 13"),
        ("0.1 0 0 0 1 0 0 0 2 0 0 0 1\n", "does not hold a rotation"),
        ("0.1 0.02 0 0 1 0 0 0 1 0 0 0 1\n", "not a pose of a grid"),
        ("1.5 0.1 0 0 1 0 0 0 1 0 0 0 1\n", "outside 0 to 1"),
    ],
)
def test_invalid_lines(text, message, reach, coarse, tmp_path):
    path = tmp_path / "map.txt"
    path.write_text(text)
    with pytest.raises(DataFileError, match=message):
        import_text(path, reach, coarse)


def test_a_text_file_of_another_grid_is_refused(ihcm, reach, tmp_path):
    path = tmp_path / "map.txt"
    export_text(path, ihcm)
    with pytest.raises(DataFileError, match="not a pose of a grid"):
        import_text(path, reach, MapGrid.of(0.03, 8))
