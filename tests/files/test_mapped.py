"""Large arrays in scratch files: same values, no names left, and one line when there is no room."""

import errno
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from tcs.errors import OutputError
from tcs.files import mapped
from tcs.files.compression import compress, decompress
from tcs.files.mapped import chunks, large_zeros, release


@pytest.fixture
def everything_is_large(monkeypatch, tmp_path):
    monkeypatch.setattr(mapped, "LEAST_BYTES", 1)
    monkeypatch.setattr(mapped, "CHUNK_BYTES", 64)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def scratch_kilobytes(folder):
    """Memory of this process that is backed by deleted files of a folder [kB]."""
    total, inside = 0, False
    for line in Path("/proc/self/smaps").read_text().splitlines():
        if "-" in line.split(maxsplit=1)[0]:
            inside = f" {folder}/" in line and line.endswith("(deleted)")
        elif inside and line.startswith("Rss:"):
            total += int(line.split()[1])
    return total


def test_a_large_array_is_mapped_and_leaves_no_file(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(mapped, "LEAST_BYTES", 1_000_000)
    array = large_zeros((1000, 500), np.float32)
    array[:] = 2.5
    assert list(tmp_path.iterdir()) == []
    assert scratch_kilobytes(tmp_path) > 1900
    view = array[10:]
    view.flags.writeable = False
    release(view)
    assert scratch_kilobytes(tmp_path) == 0
    assert float(view.sum()) == 990 * 500 * 2.5
    small = large_zeros((10,), np.int16)
    release(small)
    assert small.tolist() == [0] * 10


@pytest.mark.usefixtures("everything_is_large")
def test_an_array_in_memory_keeps_its_values():
    array = np.arange(100)
    release(array)
    assert array.tolist() == list(range(100))


@pytest.mark.usefixtures("everything_is_large")
@pytest.mark.parametrize("rows", [0, 1, 7, 100])
def test_chunks_cover_every_row_once(rows):
    narrow, wide = large_zeros((rows, 2), np.uint8), np.zeros((rows, 5))
    parts = list(chunks(narrow, wide))
    assert [row for part in parts for row in range(part.start, part.stop)] == list(range(rows))
    assert max((part.stop - part.start for part in parts), default=1) == 1


def test_a_full_disk_is_told_in_one_line(monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(mapped, "LEAST_BYTES", 1)
    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(OutputError, match=r"^Scratch file of 24 bytes .*No space left.* TMPDIR"):
        large_zeros((3,), np.float64)


@pytest.mark.usefixtures("everything_is_large")
@pytest.mark.parametrize("element", ["u1", "u2", "u4", "i4", "f4", "f8"])
def test_chunks_compress_to_the_same_bytes(element, monkeypatch):
    rng = np.random.default_rng(4)
    values = (rng.random((300, 3)) * 200).astype(element)
    parts = compress(values)
    monkeypatch.undo()
    assert parts["bytes"].tobytes() == compress(values)["bytes"].tobytes()
    if element != "i4":
        np.testing.assert_array_equal(decompress({"a": parts}, "a", element, values.shape), values)
