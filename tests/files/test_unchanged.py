"""What was read from a file is kept until the file changes."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tcs.files.unchanged import YOUNG, kept_while_unchanged


@pytest.fixture
def readings() -> list[Path]:
    return []


@pytest.fixture
def read(readings):
    @kept_while_unchanged(files=2)
    def content(path: Path, encoding: str) -> str:
        readings.append(path)
        return path.read_text(encoding)

    return content


def old_file(path: Path, text: str) -> Path:
    """Write a file, and wait until its last change is no longer a matter of a clock's step."""
    path.write_text(text)
    time.sleep(1.5 * YOUNG / 1e9)
    return path


def test_an_unchanged_file_is_read_once(tmp_path, read, readings):
    path = old_file(tmp_path / "a", "one")
    assert [read(path, "utf-8") for _ in range(3)] == ["one"] * 3
    assert len(readings) == 1


def test_a_changed_file_is_read_again_though_size_and_time_are_the_same(tmp_path, read):
    path = old_file(tmp_path / "a", "one")
    assert read(path, "utf-8") == "one"
    before = path.stat()
    path.write_text("two")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    time.sleep(1.5 * YOUNG / 1e9)
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert read(path, "utf-8") == "two"


def test_a_replaced_file_is_read_again(tmp_path, read):
    path, other = old_file(tmp_path / "a", "one"), old_file(tmp_path / "b", "two")
    assert read(path, "utf-8") == "one"
    other.replace(path)
    assert read(path, "utf-8") == "two"


def test_two_changes_within_one_step_of_the_clock_show(tmp_path, read):
    path = tmp_path / "a"
    for text in ("one", "two", "six"):
        path.write_text(text)
        assert read(path, "utf-8") == text


def test_a_file_that_has_just_changed_is_read_each_time(tmp_path, read, readings):
    # Whatever the step of the clock: a later change may bear the same time.
    path = tmp_path / "a"
    path.write_text("one")
    assert [read(path, "utf-8") for _ in range(2)] == ["one"] * 2
    assert len(readings) == 2


def test_a_file_that_is_gone_is_told_by_its_reader(tmp_path, read):
    path = old_file(tmp_path / "a", "one")
    assert read(path, "utf-8") == "one"
    path.unlink()
    with pytest.raises(FileNotFoundError):
        read(path, "utf-8")


def test_the_other_arguments_count(tmp_path, read, readings):
    path = old_file(tmp_path / "a", "ü")
    assert (read(path, "utf-8"), read(path, "latin-1")) == ("ü", "Ã¼")
    assert len(readings) == 2


def test_the_oldest_answer_goes_first(tmp_path, read, readings):
    first, second, third = (tmp_path / name for name in "abc")
    for path in (first, second, third):
        path.write_text(path.name)
    time.sleep(1.5 * YOUNG / 1e9)
    for path in (first, second, third, third, first):
        assert read(path, "utf-8") == path.name
    assert readings == [first, second, third, first]


def test_what_several_files_say_is_kept_until_one_of_them_changes(tmp_path):
    readings = []

    @kept_while_unchanged(files=2)
    def both(paths: tuple[Path, ...], end: str) -> str:
        readings.append(paths)
        return "".join(path.read_text() for path in paths) + end

    first, second = old_file(tmp_path / "a", "one"), old_file(tmp_path / "b", "two")
    assert [both((first, second), "."), both((first, second), ".")] == ["onetwo."] * 2
    assert len(readings) == 1
    assert both((first, second), "!") == "onetwo!"
    old_file(second, "six")
    assert both((first, second), ".") == "onesix."
    # Of a file that is not there, nothing is kept.
    second.unlink()
    with pytest.raises(FileNotFoundError):
        both((first, second), ".")
    assert both((), ".") == "."
