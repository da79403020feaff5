"""Machine code on disk is loaded only where it is what this user has written."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.codegen import CPUCodeLibrary, JITCodeLibrary

from tcs.files import memory
from tcs.kernel import cache, machine_code
from tcs.kernel.cache import inner, jit, jit_folder

ROOT = Path(__file__).parents[2]


def scaled(x):
    """Return a value that no neighbour of its machine code returns."""
    return 3.0 * x + 1.0


def shifted(x):
    """Return another one."""
    return x - 7.0


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder of machine code of this test alone."""
    monkeypatch.setenv("TCS_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(machine_code, "_warned", set())
    jit_folder.cache_clear()
    yield jit_folder()
    jit_folder.cache_clear()


@pytest.fixture
def warnings(caplog):
    """Function that returns the warnings so far."""
    caplog.set_level(logging.WARNING, logger="tcs.kernel.machine_code")
    return lambda: [record.getMessage() for record in caplog.records]


def hits(function, expected):
    """Compile or load a function, check its result, and return how often it was loaded."""
    compiled = jit(function)
    assert compiled(2.0) == expected
    return sum(compiled.stats.cache_hits.values())


def test_room_is_checked_before_code_is_compiled_or_loaded(monkeypatch):
    asked = []
    monkeypatch.setattr(cache, "check_room", asked.append)
    hits(scaled, 7.0)
    assert hits(scaled, 7.0) == 1
    assert asked == [memory.COMPILING, memory.CODE]

    def refuse(_needed):
        raise MemoryError

    monkeypatch.setattr(cache, "check_room", refuse)
    with pytest.raises(MemoryError):
        hits(shifted, -5.0)


def summed(x):
    """Return a sum; tests decorate it before they compile its callers."""
    if x > 1e6:
        raise ValueError("too large")
    return x + shifted(x)


def twice_summed(x):
    """Return a value that two compiled functions below take part in."""
    return 2.0 * summed(x)


def thrice_summed(x):
    """Return a value of another caller."""
    return 3.0 * summed(x)


@pytest.fixture
def decorated(monkeypatch):
    """Function that decorates those that compiled functions call, as a new process would."""

    def decorate(decorator=inner):
        for name in ("shifted", "summed"):
            monkeypatch.setitem(globals(), name, decorator(UNDECORATED[name]))
        return summed

    return decorate


UNDECORATED = {"shifted": shifted, "summed": summed}


@pytest.mark.parametrize("decorator", [inner, jit], ids=["inner", "jit"])
def test_code_for_compiled_callers_is_loaded_for_a_new_caller(
    folder, warnings, decorated, decorator
):
    decorated(decorator)
    assert hits(twice_summed, -6.0) == 0
    callee = decorated(decorator)
    assert hits(thrice_summed, -9.0) == 0
    inside = callee if decorator is inner else callee.inner
    assert sum(inside.stats.cache_hits.values()) == 1
    # Loaded as a whole: of functions that only loaded ones call, nothing is looked for.
    assert hits(thrice_summed, -9.0) == 1
    assert warnings() == []


def test_damaged_code_for_compiled_callers_is_compiled_again(folder, warnings, decorated):
    decorated()
    hits(twice_summed, -6.0)
    (path,) = folder.glob("*summed*-inner.*")
    path.write_bytes(path.read_bytes()[:-1])
    callee = decorated()
    assert hits(thrice_summed, -9.0) == 0
    assert sum(callee.stats.cache_hits.values()) == 0
    assert warnings() == [f"Machine code is compiled again: '{path}': its checksum is false."]


def test_code_for_compiled_callers_is_optimised_once_with_all_of_it(folder, decorated, monkeypatch):
    # Otherwise it is optimised once for every level of callers above it.
    optimised, optimise = [], CPUCodeLibrary._optimize_final_module
    monkeypatch.setattr(
        JITCodeLibrary,
        "_optimize_final_module",
        lambda library: (optimised.append(library.name), optimise(library)),
    )
    decorated()
    assert hits(twice_summed, -6.0) == 0
    assert optimised == ["twice_summed"]


def test_an_error_in_a_function_for_compiled_callers_reaches_python(folder, decorated):
    decorated()
    # Compiled, then loaded.
    for _ in range(2):
        with pytest.raises(ValueError, match="too large"):
            jit(twice_summed)(1e7)


def only_file(folder):
    (path,) = folder.iterdir()
    return path


def test_a_later_process_loads_what_an_earlier_one_compiled(folder, warnings):
    assert hits(scaled, 7.0) == 0
    assert hits(scaled, 7.0) == 1
    assert warnings() == []


def test_files_and_folders_are_the_users_alone(folder):
    hits(scaled, 7.0)
    assert only_file(folder).stat().st_mode & 0o777 == 0o600
    assert folder.stat().st_mode & 0o777 == folder.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("place", [0, 18, 19, 50, 51, 60, 0.1, 0.3, 0.5, 0.7, 0.9, -1])
def test_a_flipped_bit_is_compiled_again_with_one_warning(folder, warnings, place):
    hits(scaled, 7.0)
    path = only_file(folder)
    content = bytearray(path.read_bytes())
    content[int(place * len(content)) if isinstance(place, float) else place] ^= 4
    path.write_bytes(content)
    assert hits(scaled, 7.0) == 0
    assert warnings() == [f"Machine code is compiled again: '{path}': its checksum is false."]
    assert hits(scaled, 7.0) == 1


@pytest.mark.parametrize("length", [0, 1, 19, 51, 52, 2000])
def test_a_truncated_file_is_compiled_again(folder, warnings, length):
    hits(scaled, 7.0)
    path = only_file(folder)
    path.write_bytes(path.read_bytes()[:length])
    assert hits(scaled, 7.0) == 0
    assert len(warnings()) == 1
    assert hits(scaled, 7.0) == 1


def test_many_damaged_files_are_reported_in_one_line(folder, warnings):
    hits(scaled, 7.0)
    hits(shifted, -5.0)
    for path in folder.iterdir():
        path.write_bytes(path.read_bytes() + b"\0")
    assert hits(scaled, 7.0) == hits(shifted, -5.0) == 0
    assert len(warnings()) == 1


def test_the_machine_code_of_another_function_is_not_loaded(folder, warnings):
    # Both files are sound: only the names are exchanged.
    hits(scaled, 7.0)
    first = only_file(folder)
    hits(shifted, -5.0)
    (second,) = set(folder.iterdir()) - {first}
    second.write_bytes(first.read_bytes())
    assert hits(shifted, -5.0) == 0
    assert warnings() == []
    assert hits(shifted, -5.0) == 1


def test_the_bytes_that_are_checked_are_those_that_are_loaded(folder, monkeypatch):
    hits(scaled, 7.0)
    path, opened = only_file(folder), Path.open

    def open_and_exchange(self, *arguments, **options):
        stream = opened(self, *arguments, **options)
        if self == path:
            other = folder / "other"
            other.write_bytes(b"exchanged after it was opened")
            other.replace(path)
        return stream

    monkeypatch.setattr(Path, "open", open_and_exchange)
    assert hits(scaled, 7.0) == 1
    assert path.read_bytes() == b"exchanged after it was opened"


def test_a_file_that_others_may_write_to_is_compiled_again(folder, warnings):
    hits(scaled, 7.0)
    only_file(folder).chmod(0o620)
    assert hits(scaled, 7.0) == 0
    assert "others may write to it" in warnings()[0]
    assert only_file(folder).stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("mode", [0o770, 0o707])
@pytest.mark.parametrize("depth", [0, 1])
def test_a_folder_that_others_may_write_to_is_refused(folder, warnings, mode, depth):
    refused = (folder, folder.parent)[depth]
    refused.chmod(mode)
    jit_folder.cache_clear()
    assert jit_folder() is None
    assert hits(scaled, 7.0) == hits(scaled, 7.0) == 0
    assert list(folder.iterdir()) == []
    (line,) = warnings()
    assert f"'{refused}' holds machine code, and other users may write to it." in line


def test_the_folder_of_another_user_is_refused(folder, warnings, monkeypatch):
    user = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: user + 1)
    jit_folder.cache_clear()
    assert jit_folder() is None
    assert hits(scaled, 7.0) == 0
    assert "belongs to another user" in warnings()[0]


def test_recompiling_forgets_what_was_saved(folder):
    compiled = jit(scaled)
    compiled(2.0)
    compiled._cache.flush()
    assert list(folder.iterdir()) == []


SCRIPT = """
import resource, sys
from tcs.kernel.cache import jit
limit = int(sys.argv[1])
if limit:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
@jit
def scaled(x):
    return 3.0 * x + 1.0
@jit
def shifted(x):
    return x - 7.0
print(scaled(2.0), shifted(2.0), sum(scaled.stats.cache_hits.values()))
"""


def start(script, limit=0):
    """Start the script."""
    return subprocess.Popen(
        [sys.executable, str(script), str(limit)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


@pytest.fixture
def script(tmp_path):
    """The script as a file: numba caches no function that stands in a string."""
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    return path


def test_two_processes_may_compile_at_once(script):
    both = start(script), start(script)
    ran = [running.communicate() for running in both]
    # Either may find what the other has just finished.
    assert [(out.split()[:2], err) for out, err in ran] == 2 * [(["7.0", "-5.0"], "")]
    assert start(script).communicate() == ("7.0 -5.0 1\n", "")


def test_on_a_full_disk_the_work_is_done_with_one_warning(script, folder):
    # As on a full disk, a write beyond this size fails in the middle of a file.
    out, err = start(script, limit=1000).communicate()
    assert out == "7.0 -5.0 0\n"
    assert err.startswith("The kernel compiles anew in every run: Machine code '")
    assert err.count("\n") == 1
    assert list(folder.iterdir()) == []
