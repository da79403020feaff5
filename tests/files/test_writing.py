from __future__ import annotations

import errno
import os

import pytest

from tcs.errors import OutputError
from tcs.files.writing import whole_file


def test_the_old_file_stays_until_the_new_one_is_complete(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")
    with whole_file(path, "Text") as stream:
        stream.write(b"new")
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_written_reaches_the_disk_before_it_takes_the_name(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    sizes = []
    monkeypatch.setattr(os, "fsync", lambda handle: sizes.append(os.fstat(handle).st_size))
    with whole_file(path, "Text") as stream:
        stream.write(b"new")
        assert not path.exists()
    assert sizes == [3]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_whatever_goes_wrong_inside_goes_on_and_leaves_nothing(tmp_path, error):
    def write():
        with whole_file(tmp_path / "a.txt", "Text") as stream:
            stream.write(b"half")
            raise error

    with pytest.raises(error):
        write()
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_told_with_what_to_do(tmp_path):
    path = tmp_path / "a.txt"
    with (
        pytest.raises(OutputError, match=r"^Text '.*a\.txt' cannot be written: full\. Buy one\.$"),
        whole_file(path, "Text", advice="Buy one."),
    ):
        raise OSError(errno.ENOSPC, "full")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_reported(tmp_path):
    with (
        pytest.raises(OutputError, match="existing, writable folder"),
        whole_file(tmp_path / "none" / "a.txt", "Text"),
    ):
        pass
    assert list(tmp_path.iterdir()) == []
