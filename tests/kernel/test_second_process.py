"""A second process adds machine code to the cache, and is gone at the end."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tcs.kernel import second_process
from tcs.kernel.analytic.ik import within
from tcs.kernel.cache import announced, jit, jit_folder
from tcs.kernel.second_process import compiled_beside


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder of machine code of this test alone; two processors, whatever there are."""
    monkeypatch.setenv("TCS_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(second_process, "_processors", lambda: 2)
    jit_folder.cache_clear()
    yield jit_folder()
    jit_folder.cache_clear()


def compile_one(number):
    """Compile a function; called in the second process."""
    within(number, -1.0, 1.0)


def leave_mark(path):
    """Tell the number of the process, and stay."""
    path.write_text(str(os.getpid()))
    time.sleep(600.0)


def fail():
    """Compile nothing."""
    raise ZeroDivisionError


def compiled():
    """Compile something in this process."""
    assert jit(lambda x: 2 * x)(4) == 8


def found(folder):
    return [path.name for path in folder.glob("tcs.kernel.analytic.ik.within-*")]


def test_what_it_compiles_is_in_the_cache_at_the_end(folder):
    with compiled_beside(compile_one, 0.5):
        compiled()
    (name,) = found(folder)
    compile_one(0.5)
    # This process looks for the same, if in another folder.
    assert within._cache.path(within.signatures[0], within.targetctx).name == name


@pytest.mark.parametrize("why", ["nothing is compiled", "one processor", "no cache"])
def test_it_is_not_begun_in_vain(folder, monkeypatch, why):
    begun = []
    monkeypatch.setattr(second_process.subprocess, "Popen", lambda *_, **__: begun.append(1))
    if why == "one processor":
        monkeypatch.setattr(second_process, "_processors", lambda: 1)
    if why == "no cache":
        monkeypatch.setattr(second_process, "jit_folder", lambda: None)
    with compiled_beside(compile_one, 0.5, first=lambda: begun.append(2)):
        if why != "nothing is compiled":
            compiled()
    assert begun == []


def test_this_process_does_its_share_once_the_other_is_begun(folder):
    told = []
    with compiled_beside(compile_one, 0.5, first=lambda: told.append("share")):
        with announced(lambda: told.append("compiled")):
            compiled()
        compiled()
    assert told == ["compiled", "share"]


def test_its_failure_is_none_of_this_process(folder):
    with compiled_beside(fail):
        compiled()
    assert found(folder) == []


def test_an_error_ends_it(tmp_path):
    mark = tmp_path / "mark"
    with pytest.raises(ZeroDivisionError), compiled_beside(leave_mark, mark):  # noqa: PT012
        compiled()
        while not (mark.exists() and mark.read_text()):
            time.sleep(0.05)
        raise ZeroDivisionError
    assert not Path(f"/proc/{mark.read_text()}").exists()
