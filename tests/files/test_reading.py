"""Every reader of a file refuses what is not a regular file, at once and in one line."""

from __future__ import annotations

import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

import tcs
from tcs.capability import load_map, read_csv
from tcs.capability.head import load_head
from tcs.errors import DataFileError, TcsError
from tcs.files.reading import read_bytes
from tcs.model.robots import load_robot
from tcs.model.robots.primitives import read_primitives
from tcs.model.robots.urdf import read_urdf
from tcs.model.robots.urdf.meshes import mesh_triangles
from tcs.model.scene import load_environment
from tcs.model.tasks import load_task
from tcs.teleop.runs.run_files import load_run

READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "task": (".yaml", load_task),
    "environment": (".yaml", load_environment),
    "robot": (".yaml", load_robot),
    "head": (".yaml", lambda path: load_head(load_robot("pr2"), path)),
    "URDF": (".urdf", read_urdf),
    "primitives": (".csv", read_primitives),
    "STL": (".stl", mesh_triangles),
    "OBJ": (".obj", mesh_triangles),
    "scores": (".tcs", tcs.load),
    "map": (".tcm", load_map),
    "run": (".csv", load_run),
    "recording": (".csv", lambda path: read_csv(path, load_robot("iiwa7"))),
}


def fifo(path):
    os.mkfifo(path)
    return path


def device(path):
    path.symlink_to("/dev/zero")
    return path


def folder(path):
    path.mkdir()
    return path


PATHS = {
    "pipe": (fifo, "named pipe"),
    "device": (device, "a device"),
    "folder": (folder, "a folder"),
    "loop": (lambda path: (path.symlink_to(path), path)[1], "symbolic link"),
    "NUL": (lambda path: path.with_stem("a\0b"), "NUL"),
    "long": (lambda path: path.with_stem("a" * 300), "too long"),
    "deep": (lambda path: path.parent / ("a/" * 3000) / path.name, "too long"),
}


@pytest.mark.parametrize("kind", PATHS)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_regular_file_is_one_line(tmp_path, reader, kind):
    ending, read = READERS[reader]
    make, words = PATHS[kind]
    # Before, a pipe without a writer hung here, and a device never ended.
    with pytest.raises(TcsError) as caught:
        read(make(tmp_path / f"file{ending}"))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_beyond_the_limit_is_not_read(tmp_path):
    path = tmp_path / "large"
    with path.open("wb") as stream:
        stream.truncate(2**40)
    with pytest.raises(DataFileError, match=r"has 1,099,511,627,776 bytes; at most 10 are read"):
        read_bytes(path, "it", DataFileError, limit=10)


def test_a_file_that_grows_is_read_to_the_limit(tmp_path, monkeypatch):
    path = tmp_path / "growing"
    path.write_bytes(bytes(11))
    small = os.stat_result((0o100600, 0, 0, 1, 0, 0, 3, 0, 0, 0))
    monkeypatch.setattr("tcs.files.reading.os.fstat", lambda _: small)
    with pytest.raises(DataFileError, match="has more than the expected 10 bytes"):
        read_bytes(path, "it", DataFileError, limit=10)


def test_no_file_stays_open(tmp_path):
    before = len(os.listdir("/proc/self/fd"))
    path = fifo(tmp_path / "pipe")
    for _ in range(3):
        with pytest.raises(DataFileError):
            read_bytes(path, "it", DataFileError, limit=10)
    assert len(os.listdir("/proc/self/fd")) == before


def test_the_memory_taken_is_that_of_the_file_and_not_of_the_limit(tmp_path):
    path = tmp_path / "small"
    path.write_bytes(bytes(1000))
    tracemalloc.start()
    try:
        assert read_bytes(path, "it", DataFileError, limit=2**31) == bytes(1000)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 10**6
