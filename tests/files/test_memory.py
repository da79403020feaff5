"""A limited address space: refused before code that would wait for ever or end the process."""

import os
import resource
import subprocess
import sys

import pytest

from tcs.files import memory
from tcs.files.memory import is_for_want_of_memory

MEGABYTE = 1024**2


def test_room_is_checked_only_where_it_is_limited(monkeypatch):
    memory.check_room(2**60)
    monkeypatch.setattr(memory, "is_limited", lambda: True)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (100 * MEGABYTE, 0))
    with pytest.raises(MemoryError, match="bytes of address space are left"):
        memory.check_room()
    monkeypatch.setattr(resource, "getrlimit", lambda _: (2**60, 0))
    memory.check_room()


def test_what_fails_to_load_is_told_as_want_of_memory_only_with_a_limit(monkeypatch):
    errors = [
        ImportError("initialization failed"),
        OSError("Could not find/load shared object file 'libllvmlite.so'"),
        OSError(12, "Cannot allocate memory"),
    ]
    assert not any(map(is_for_want_of_memory, errors))
    assert is_for_want_of_memory(RuntimeError("can't allocate read lock"))
    monkeypatch.setattr("tcs.files.memory.is_limited", lambda: True)
    assert all(map(is_for_want_of_memory, errors))
    assert not is_for_want_of_memory(ImportError("No module named 'yaml'"))
    assert not is_for_want_of_memory(FileNotFoundError(2, "No such file", "libllvmlite.so"))


def test_a_command_that_would_compile_in_too_little_room_ends_in_one_line(tmp_path):
    # Enough for Drake and numba, but LLVM ends the process where it finds no room for its code.
    megabytes = memory.START // MEGABYTE + 670
    done = subprocess.run(
        [sys.executable, "-m", "tcs", "capability", "from-ik", "--out", str(tmp_path / "out.icm")],
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
        env={**os.environ, "TCS_CACHE_DIR": str(tmp_path / "cache")},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (megabytes * MEGABYTE,) * 2),
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("tcs: the memory does not suffice")
    assert not (tmp_path / "out.icm").exists()


# From too little for NumPy and the commands, and for the BLAS of SciPy, which would ask for ever,
# to too little for Drake.
@pytest.mark.parametrize("megabytes", [60, 100, 400, 600])
def test_a_command_ends_in_one_line(megabytes, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "tcs", "score", "shaving", "--out", str(tmp_path / "out.tcs")],
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (megabytes * MEGABYTE,) * 2),
    )
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert "the memory does not suffice" in done.stderr
    assert not list(tmp_path.iterdir())
