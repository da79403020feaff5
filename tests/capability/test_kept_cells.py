"""Maps in blocks: the same map as without, whatever was finished or damaged before."""

import logging

import numpy as np
import pytest

from tcs.capability import MapGrid, Reach, kept_cells, map_from_ik
from tcs.files.blocks import FORMAT, MANIFEST, BlockFolder
from tcs.files.compression import compress

GRID = MapGrid.of(0.2, 8, "side")


@pytest.fixture(scope="module")
def plain(reach):
    return map_from_ik(reach, GRID, radius=0.5)


@pytest.fixture
def run(reach, tmp_path, monkeypatch):
    """Function that makes the map in blocks of 100 cells; the map, and how many are solved."""
    solved, solve = [], Reach.solve

    def counted(robot, R_BT, p_BT, **options):
        solved.append(len(p_BT))
        return solve(robot, R_BT, p_BT, **options)

    monkeypatch.setattr(kept_cells, "BLOCK", 100)
    monkeypatch.setattr(Reach, "solve", counted)

    def done(restart=False, robot=reach, **options):
        solved.clear()
        folder = BlockFolder(tmp_path / "blocks", restart)
        return map_from_ik(robot, GRID, radius=0.5, blocks=folder, **options), sum(solved)

    return done


def files(folder):
    return sorted((folder / "blocks").rglob("*.block"))


def assert_same(one, other):
    for name in ("cells", "manipulability", "visibility", "free_torso_heights", "joints"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_an_interrupted_map_is_continued_with_the_same_cells(run, plain, tmp_path):
    everything = plain.metadata["cells_considered"]

    def interrupt(done, total):
        assert total == everything
        if done > everything / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(on_progress=interrupt)
    kept = len(files(tmp_path))
    assert 0 < kept < everything // 100
    assert not list((tmp_path / "blocks").rglob(MANIFEST))
    told = []
    found, solved = run(on_progress=lambda *done: told.append(done))
    assert_same(found, plain)
    assert solved == everything - 100 * kept
    assert told[-1] == (everything, everything)
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert run()[1] == 0
    assert len(list((tmp_path / "blocks").rglob(MANIFEST))) == 1
    assert run(restart=True)[1] == everything


def test_free_torso_heights_are_kept_too(run, plain, monkeypatch):
    run()

    def compute(*_arguments, **_options):
        raise AssertionError("computed again")

    monkeypatch.setattr(Reach, "free", compute)
    assert_same(run()[0], plain)


def test_another_measure_and_height_are_solved(run, reach, plain):
    run()
    other = Reach(reach.robot, torso_height=reach.torso_height, measure="isotropy")
    assert run(robot=other)[1] == plain.metadata["cells_considered"]
    higher = Reach(reach.robot, torso_height=float(reach.torso_heights[-1]))
    assert run(robot=higher)[1] > 0
    assert run()[1] == 0


def changed_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def with_fewer_postures(path):
    content = FORMAT.load(path, dict)
    content["joints"] = compress(np.zeros((1, 7), np.float32))
    FORMAT.save(path, {k: v for k, v in content.items() if not k.startswith("format")})


@pytest.mark.parametrize("damage", [changed_byte, with_fewer_postures])
def test_a_damaged_block_is_told_and_solved_again(damage, run, plain, tmp_path, caplog):
    run()
    largest = max(files(tmp_path), key=lambda path: path.stat().st_size)
    damage(largest)
    with caplog.at_level(logging.WARNING):
        found, solved = run()
    assert_same(found, plain)
    assert 0 < solved <= 100
    assert str(largest) in caplog.text
