"""Blocks: the same scores as without, whatever was finished, damaged or of other inputs before."""

import importlib
import logging
import os
from types import SimpleNamespace

import numpy as np
import pytest

from tcs.errors import OutputError, StoreFormatError
from tcs.files import mapped
from tcs.files.blocks import FORMAT, BlockFolder, load_block
from tcs.files.compression import compress
from tcs.placement.scoring.blocks import with_goals
from tcs.placement.scoring.engines import Work
from tcs.placement.scoring.sweep import sweep

# The package has a function of the module's name.
SWEEP = importlib.import_module("tcs.placement.scoring.sweep")
KERNEL_START = importlib.import_module("tcs.placement.scoring.kernel_start")
BLOCK = 20


@pytest.fixture(scope="module")
def lowered(small_job):
    return small_job.lowered(small_job.scene())


@pytest.fixture(scope="module")
def plain(lowered, small_job):
    return sweep(lowered, small_job.task.weights).tables[0]


@pytest.fixture
def small_blocks(monkeypatch):
    """Blocks so small that the grid has several; the list of the parts that were scored."""
    scored = []
    scores_of = Work.score

    def counted(work, part):
        scored.append(part)
        return scores_of(work, part)

    monkeypatch.setattr(SWEEP, "BLOCK", BLOCK)
    monkeypatch.setattr(Work, "score", counted)
    return scored


@pytest.fixture
def run(lowered, small_job, small_blocks, tmp_path):
    """Function that scores with blocks and returns the table, and the number of scored blocks."""

    def scored(*, restart=False, **options):
        small_blocks.clear()
        folder = BlockFolder(tmp_path / "blocks", restart)
        swept = sweep(lowered, small_job.task.weights, blocks=folder, **options)
        return swept.tables[0], len(small_blocks)

    return scored


def files(folder):
    return sorted((folder / "blocks").rglob("*.block"))


def assert_same(first, second):
    for name in ("reason", "dexterity", "pair", "arm_joints"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert first.pair_names == second.pair_names


def test_finished_blocks_are_not_scored_again(run, plain, small_job, tmp_path):
    table, scored = run()
    assert_same(table, plain)
    assert scored == len(files(tmp_path)) == -(-small_job.grid.size // BLOCK) > 2
    table, scored = run()
    assert_same(table, plain)
    assert scored == 0
    assert run(restart=True)[1] == len(files(tmp_path))


def test_only_a_missing_block_starts_the_kernel(run, plain, tmp_path, monkeypatch):
    run()

    def start(*_arguments):
        raise MemoryError("the kernel is started")

    monkeypatch.setattr(KERNEL_START, "warm_up", start)
    monkeypatch.setattr(SWEEP, "Scorer", SimpleNamespace(of=start))
    assert_same(run()[0], plain)
    files(tmp_path)[0].unlink()
    with pytest.raises(MemoryError, match="is started"):
        run()


def test_scores_beyond_the_memory_are_the_same(run, plain, monkeypatch):
    monkeypatch.setattr(mapped, "LEAST_BYTES", 1)
    monkeypatch.setattr(mapped, "CHUNK_BYTES", 100)
    table, _ = run()
    for name in ("reason", "dexterity", "pair", "arm_joints", "reached", "has_no_free_body"):
        np.testing.assert_array_equal(getattr(table, name), getattr(plain, name))
    assert table.pair_names == plain.pair_names


def test_an_interrupted_run_continues(run, plain, small_job, tmp_path):
    def interrupt(done, _total):
        if done > small_job.grid.size / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(on_progress=interrupt, jobs=1)
    kept = len(files(tmp_path))
    assert kept >= 2
    table, scored = run()
    assert_same(table, plain)
    assert scored == len(files(tmp_path)) - kept
    assert not list(tmp_path.rglob("*.part"))


def changed_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def emptied(path):
    path.write_bytes(b"")


def with_codes(name, value):
    """Return a change that writes a code which does not exist."""

    def change(path):
        content = FORMAT.load(path, dict)
        shape = content[name]["shape"]
        element = np.uint8 if name == "reason" else np.uint32
        content[name] = compress(np.full(shape, value, element))
        FORMAT.save(path, {k: v for k, v in content.items() if not k.startswith("format")})

    return change


@pytest.mark.parametrize(
    "damage",
    [changed_byte, emptied, with_codes("reason", 99), with_codes("contact", 10**9),
     with_codes("reason", 1)],
)  # fmt: skip
def test_a_damaged_block_is_told_and_scored_again(damage, run, plain, tmp_path, caplog):
    run()
    damage(files(tmp_path)[1])
    with caplog.at_level(logging.WARNING):
        table, scored = run()
    assert_same(table, plain)
    assert scored == 1
    (record,) = caplog.records
    assert str(files(tmp_path)[1]) in record.getMessage()
    assert run()[1] == 0


def test_a_block_of_another_place_is_not_taken(run, plain, tmp_path):
    run()
    first, second = files(tmp_path)[:2]
    second.write_bytes(first.read_bytes())
    table, scored = run()
    assert_same(table, plain)
    assert scored == 1


def test_other_inputs_have_their_own_blocks(run, small_job, tmp_path):
    total = run()[1]
    excluded = np.zeros(small_job.grid.size, dtype=np.bool_)
    excluded[:5] = True
    assert run(excluded=excluded)[1] >= total
    assert run(measure="inverse-condition")[1] == total
    assert len(list((tmp_path / "blocks").iterdir())) == 3
    assert run()[1] == 0


def test_a_second_run_on_the_same_blocks_is_refused_with_the_process(run, tmp_path):
    run()
    (folder,) = (tmp_path / "blocks").iterdir()
    with (
        BlockFolder(tmp_path / "blocks").opened(folder.name),
        pytest.raises(OutputError, match=f"is in use by process {os.getpid()}"),
    ):
        run()
    assert run()[1] == 0


def test_a_lock_that_cannot_be_written_is_refused(run, tmp_path):
    run()
    (folder,) = (tmp_path / "blocks").iterdir()
    (folder / "lock").unlink()
    (folder / "lock").symlink_to("/dev/full")
    with pytest.raises(OutputError, match="cannot be written"):
        run()


def test_a_folder_that_cannot_be_made_is_refused(run, tmp_path):
    (tmp_path / "blocks").write_text("a file")
    with pytest.raises(OutputError, match="cannot be created"):
        run()


def scored_goals(monkeypatch):
    """Record how many goals each scored part has."""
    counts, scores_of = [], Work.score

    def counted(work, part):
        counts.append(work.scorer.problem.goals.p.shape[1])
        return scores_of(work, part)

    monkeypatch.setattr(Work, "score", counted)
    return counts


@pytest.mark.parametrize(
    ("before", "now"),
    [
        pytest.param([0, 1, 2, 3, 4], [0, 1, 2, 3, 4, 5], id="one added at the end"),
        pytest.param([1, 2, 7], [7, 0, 2], id="one added, one removed, in another order"),
        pytest.param([0, 3, 5, 6], [5, 3], id="only removed"),
        pytest.param([0, 1], [2, 3], id="none in common"),
    ],
)
def test_goals_that_were_scored_before_are_not_scored_again(
    before, now, lowered, small_job, small_blocks, tmp_path, monkeypatch, plain
):
    counts = scored_goals(monkeypatch)
    folder = BlockFolder(tmp_path / "blocks")

    def scored(goals, **options):
        counts.clear()
        weights = np.full(len(goals), 1.0 / len(goals))
        return sweep(with_goals(lowered, goals), weights, **options).tables[0]

    scored(before, blocks=folder)
    fresh = scored(now)
    table = scored(now, blocks=folder)
    new = len(set(now) - set(before))
    parts = -(-small_job.grid.size // BLOCK)
    assert counts == [new] * (parts if new else 0)
    assert_same(table, fresh)
    np.testing.assert_array_equal(table.reason, plain.reason[:, now])
    np.testing.assert_array_equal(table.dexterity, plain.dexterity[:, now])
    # They are kept like others, and a restart scores all.
    assert_same(scored(now, blocks=folder), fresh)
    assert counts == []
    scored(now, blocks=BlockFolder(tmp_path / "blocks", restart=True))
    assert counts == [len(now)] * parts


def test_damaged_blocks_of_other_goals_are_not_taken(
    run, lowered, small_job, plain, tmp_path, caplog
):
    weights = np.full(3, 1.0 / 3.0)
    sweep(with_goals(lowered, [0, 1, 2]), weights, blocks=BlockFolder(tmp_path / "blocks"))
    changed_byte(files(tmp_path)[1])
    manifest = next((tmp_path / "blocks").rglob("goals.json"))
    with caplog.at_level(logging.WARNING):
        assert_same(run()[0], plain)
    assert "block" in caplog.text
    for text in ("", "[]", '{"key": 1, "rest": "", "goals": [2]}', '{"key": "", "goals": 3}'):
        manifest.write_text(text)
        assert_same(run(restart=True)[0], plain)
        assert_same(run()[0], plain)


def test_containers_of_a_block_are_read_once_each(tmp_path):
    array = compress(np.arange(3.0))
    # As a tree it would have 2^60 leaves; and it holds itself.
    inside = {"array": array}
    for _ in range(60):
        inside = {"first": inside, "second": inside}
    inside["self"] = inside
    path = tmp_path / "0000000000.block"
    FORMAT.save(path, {"key": "k", "block": "b", "inside": inside})
    # Who decodes it takes the array as often as it is referred to.
    with pytest.raises(StoreFormatError, match="claims arrays of 4,611,686,018,427,387,904 bytes"):
        load_block(path)
    del inside["second"], inside["first"], inside["self"]
    inside |= {"first": array, "self": inside}
    FORMAT.save(path, {"key": "k", "block": "b", "inside": inside})
    assert load_block(path).key == "k"
    array["bytes"] = array["bytes"][:-1]
    FORMAT.save(path, {"key": "k", "block": "b", "inside": inside})
    with pytest.raises(StoreFormatError, match="array"):
        load_block(path)
