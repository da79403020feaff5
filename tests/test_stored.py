"""Files are recognised whatever they are called, and damage is found in every part."""

import numpy as np
import pytest

from tcs.capability import save_map
from tcs.capability.arplace import query, save_arplace, save_probability_map
from tcs.errors import StoreFormatError, TcsError
from tcs.files.blocks import FORMAT, MANIFEST, BlockFolder
from tcs.files.compression import compress
from tcs.files.joblib_file import write_joblib
from tcs.placement.store import save_motions, save_scores
from tcs.stored import check_file
from tcs.teleop.runs.run_files import save_run
from tests.capability.arplace.example import model
from tests.capability.test_map import small_map
from tests.placement.store.example import score_file
from tests.placement.store.test_motion_file import motion_file, motion_table
from tests.teleop.runs.test_run_files import made

KINDS = {
    "block": 1,
    "manifest of blocks": None,
    "score file": 4,
    "motion file": 1,
    "capability map": 2,
    "ARPlace model": 1,
    "probability map": 1,
    "run of a teleoperated arm": None,
}


def write(kind, folder):
    """Write a small file of a kind, under a name that says nothing; return its path."""
    path = folder / ("file.csv" if kind.startswith("run") else "file")
    if kind in ("block", "manifest of blocks"):
        with BlockFolder(folder / "blocks").opened("0123456789abcdef0") as blocks:
            for name in ("first", "second"):
                blocks.save(name, {"reason": compress(np.arange(40, dtype=np.uint8))})
        return blocks.folder / (MANIFEST if kind.startswith("manifest") else "first.block")
    if kind == "score file":
        save_scores(path, score_file())
    elif kind == "motion file":
        sets = score_file().nominal.sets
        save_motions(path, motion_file(motion_table(sets, np.ones(sets.reached.shape, bool))))
    elif kind == "capability map":
        save_map(path, small_map([[0, 0, 0, 0, 0], [1, 2, 3, 4, 1]], [0.5, 0.2], [1, 1]))
    elif kind == "ARPlace model":
        save_arplace(path, model())
    elif kind == "probability map":
        save_probability_map(path, query(model()).map)
    else:
        save_run(path, made())
    return path


@pytest.mark.parametrize(("kind", "version"), KINDS.items())
def test_kind_and_version_are_told(kind, version, tmp_path):
    found = check_file(write(kind, tmp_path))
    assert (found.kind, found.format_version) == (kind, version)


def test_what_the_file_says_of_itself(tmp_path):
    found = check_file(write("score file", tmp_path))
    assert (found.made["robot"], found.made["environment"]) == ("pr2", "wheelchair")
    assert found.made["program_version"] == "0.1.0"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if not kind.startswith("run")])
def test_every_changed_byte_and_every_cut_is_found(kind, tmp_path, rng):
    path = write(kind, tmp_path)
    content = path.read_bytes()
    for place in rng.integers(0, len(content), size=60):
        changed = bytearray(content)
        changed[place] ^= 1 << rng.integers(8)
        path.write_bytes(changed)
        with pytest.raises(TcsError):
            check_file(path)
        path.write_bytes(content[:place])
        with pytest.raises(TcsError):
            check_file(path)


def test_missing_and_foreign_blocks_of_a_finished_run_are_found(tmp_path):
    manifest = write("manifest of blocks", tmp_path)
    first, second = sorted(manifest.parent.glob("*.block"))
    whole = first.read_bytes()
    for content in (second.read_bytes(), whole[:-1], None):
        if content is None:
            first.unlink()
        else:
            first.write_bytes(content)
        with pytest.raises(StoreFormatError, match="block 'first'"):
            check_file(manifest)
    plain = FORMAT.load(second, dict)
    FORMAT.save(first, {"key": plain["key"], "block": "first", "reason": {"bytes": 3}})
    with pytest.raises(TcsError, match=r"first\.block"):
        check_file(first)


@pytest.mark.parametrize("content", [{}, {"format": []}, {"format": "tcs scores"}, [1]])
def test_joblib_files_of_others_get_one_line(content, tmp_path):
    write_joblib(tmp_path / "file", content, "File")
    with pytest.raises(TcsError, match="file") as error:
        check_file(tmp_path / "file")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["page.html", "plan.json", "run.csv"])
def test_other_files_get_one_line(name, tmp_path):
    (tmp_path / name).write_text("x")
    with pytest.raises(TcsError) as error:
        check_file(tmp_path / name)
    assert "\n" not in str(error.value)
