from __future__ import annotations

import errno
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from tcs.errors import OutputError
from tcs.files import writing
from tcs.files.writing import check_writable, remove_leftovers, scratch_folder, whole_file


@pytest.fixture(autouse=True)
def _looks_again():
    """Let `remove_leftovers` look through every folder again."""
    remove_leftovers.cache_clear()


def test_the_old_file_stays_until_the_new_one_is_complete(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")
    with whole_file(path, "Text") as stream:
        stream.write(b"new")
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_content_is_flushed_to_the_disk_before_the_file_is_renamed(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    sizes = []
    monkeypatch.setattr(os, "fsync", lambda handle: sizes.append(os.fstat(handle).st_size))
    with whole_file(path, "Text") as stream:
        stream.write(b"new")
        assert not path.exists()
    assert sizes == [3]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_an_exception_inside_propagates_and_leaves_no_file(tmp_path, error):
    def write():
        with whole_file(tmp_path / "a.txt", "Text") as stream:
            stream.write(b"half")
            raise error

    with pytest.raises(error):
        write()
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_reported_with_advice(tmp_path):
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


WRITER = """
import sys
from pathlib import Path
from tcs.files.writing import scratch_folder, whole_file
with whole_file(Path(sys.argv[1]), "Text") as stream, scratch_folder() as folder:
    stream.write(b"half")
    stream.flush()
    (folder / "a.txt").write_text("half")
    print(folder, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def writer(tmp_path, monkeypatch):
    """A process that is writing `a.txt`, its temporary folder, and the folder of both."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(writing.tempfile, "tempdir", None)
    checkout = Path(__file__).resolve().parents[2]
    running = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path / "a.txt")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(checkout)},
    )
    try:
        yield running, Path(running.stdout.readline().strip())
    finally:
        running.kill()
        running.communicate()
        writing.tempfile.tempdir = None


def write_beside(path):
    with whole_file(path, "Text") as stream:
        stream.write(b"whole")


def test_what_a_killed_process_left_is_removed_by_the_next_one(writer, tmp_path):
    running, folder = writer
    running.send_signal(signal.SIGKILL)
    running.wait()
    (part,) = tmp_path.glob(".a.txt.*.part")
    assert part.read_bytes() == b"half"
    assert (folder / "a.txt").exists()
    write_beside(tmp_path / "b.txt")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b.txt"]


def test_what_a_living_process_writes_stays(writer, tmp_path):
    running, folder = writer
    write_beside(tmp_path / "b.txt")
    with scratch_folder():
        pass
    assert (folder / "a.txt").exists()
    running.communicate("")
    assert (tmp_path / "a.txt").read_bytes() == b"half"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.txt", "b.txt"]


@pytest.mark.parametrize(
    "name",
    [
        ".a.txt.part",
        "a.txt.12-0123abcd.part",
        ".a.txt.12-0123abcd.part.txt",
        ".a.txt.12-0123abc.part",
        "tcs-12-0123abcd.txt",
    ],
)
def test_files_of_other_names_stay(tmp_path, name):
    (tmp_path / name).touch()
    write_beside(tmp_path / "b.txt")
    assert (tmp_path / name).exists()


def test_files_of_another_user_stay(tmp_path, monkeypatch):
    left, user = tmp_path / ".a.txt.12-0123abcd.part", os.geteuid()
    left.touch()
    monkeypatch.setattr(os, "geteuid", lambda: user + 1)
    write_beside(tmp_path / "b.txt")
    assert left.exists()


def test_a_link_that_has_the_name_of_a_temporary_file_is_not_followed(tmp_path):
    target = tmp_path / "kept"
    target.mkdir()
    (tmp_path / "tcs-12-0123abcd").symlink_to(target)
    (tmp_path / ".a.txt.12-0123abcd.part").symlink_to(tmp_path / "nowhere")
    write_beside(tmp_path / "b.txt")
    assert len(list(tmp_path.iterdir())) == 4


def test_a_check_that_a_path_is_writable_leaves_nothing_and_removes_leftovers(tmp_path):
    (tmp_path / ".a.txt.12-0123abcd.part").touch()
    check_writable(tmp_path / "b.txt")
    assert list(tmp_path.iterdir()) == []


def test_a_temporary_folder_is_removed_with_its_files(tmp_path, monkeypatch):
    monkeypatch.setattr(writing.tempfile, "tempdir", str(tmp_path))

    def fail():
        with scratch_folder() as folder:
            (folder / "a.txt").touch()
            assert folder.parent == tmp_path
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert list(tmp_path.iterdir()) == []


def pipe(path):
    os.mkfifo(path)


def link_to_a_device(path):
    # A link of our own: were it replaced, the device would still be there.
    path.symlink_to("/dev/full")


@pytest.mark.parametrize("make", [pipe, link_to_a_device])
def test_a_device_or_pipe_is_never_replaced_by_a_file(tmp_path, make):
    """Renaming onto a device as root removed it, for every process of the machine."""
    path = tmp_path / "a.txt"
    make(path)
    before = os.lstat(path)
    with pytest.raises(OutputError, match=r"is (a named pipe|a device)"):
        check_writable(path)
    with pytest.raises(OutputError, match=r"is (a named pipe|a device)"), whole_file(path, "Text"):
        pass
    assert os.lstat(path).st_ino == before.st_ino
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["a\0b", "a" * 300])
def test_a_path_that_cannot_exist_is_one_line(tmp_path, name):
    with pytest.raises(OutputError) as caught:
        check_writable(tmp_path / name)
    assert "\n" not in str(caught.value)
    with pytest.raises(OutputError) as caught, whole_file(tmp_path / name, "Text"):
        pass
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_no_other_user_can_look_into_a_scratch_folder():
    with scratch_folder() as folder:
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
