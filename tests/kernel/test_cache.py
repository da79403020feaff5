"""The machine code on disk must be that of the current sources."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import numba
import pytest

from tcs.errors import OutputError
from tcs.kernel import cache, machine_code
from tcs.kernel.cache import announced, inner, jit, jit_folder, kernel_digest

ROOT = Path(__file__).parents[2]
KERNEL = ROOT / "tcs" / "kernel"


@pytest.fixture
def copy(tmp_path):
    """A copy of the kernel's sources."""
    return Path(
        shutil.copytree(KERNEL, tmp_path / "kernel", ignore=shutil.ignore_patterns("__pycache__"))
    )


def test_a_copy_has_the_same_digest(copy):
    assert kernel_digest(copy) == kernel_digest(copy)
    assert len(kernel_digest(copy)) == 16


@pytest.mark.parametrize("name", ["__init__.py", "workspace.py", "six_joints/roots.py"])
def test_one_byte_in_any_source_changes_the_digest(copy, name):
    before = kernel_digest(copy)
    source = copy / name
    text = source.read_bytes()
    middle = len(text) // 2
    changed = bytes([text[middle] ^ 1]) if text else b"#"
    source.write_bytes(text[:middle] + changed + text[middle + 1 :])
    assert kernel_digest(copy) != before


def test_files_added_renamed_and_removed_change_the_digest(copy):
    digests = {kernel_digest(copy)}
    (copy / "extra.py").write_text("")
    digests.add(kernel_digest(copy))
    (copy / "extra.py").rename(copy / "other.py")
    digests.add(kernel_digest(copy))
    (copy / "other.py").unlink()
    (copy / "scores.py").unlink()
    digests.add(kernel_digest(copy))
    assert len(digests) == 4


def test_text_that_moves_from_one_file_to_the_next_changes_the_digest(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    (tmp_path / "b.py").write_text("")
    before = kernel_digest(tmp_path)
    (tmp_path / "a.py").write_text("")
    (tmp_path / "b.py").write_text("x = 1\n")
    assert kernel_digest(tmp_path) != before


def test_versions_and_processor_change_the_digest(copy, monkeypatch):
    digests = {kernel_digest(copy)}
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    digests.add(kernel_digest(copy))
    monkeypatch.setattr(llvm, "get_host_cpu_name", lambda: "another")
    digests.add(kernel_digest(copy))
    monkeypatch.setattr(cache.platform, "python_version", lambda: "3.99")
    digests.add(kernel_digest(copy))
    assert len(digests) == 4


@pytest.fixture
def fresh(monkeypatch):
    """Let `jit_folder` forget what it found before and after."""
    monkeypatch.setattr(machine_code, "_warned", set())
    jit_folder.cache_clear()
    yield
    jit_folder.cache_clear()


def refuse():
    raise OutputError("cannot write there.")


def test_without_a_folder_functions_compile_all_the_same(fresh, monkeypatch, caplog):
    monkeypatch.setattr(cache, "cache_folder", refuse)
    with caplog.at_level(logging.WARNING, logger="tcs.kernel.machine_code"):
        twice = jit(lambda x: 2 * x)
    assert twice(21) == 42
    assert "compiles anew in every run" in caplog.text
    assert "cannot write there" in caplog.text


def test_a_file_in_the_way_of_the_folder_is_no_error(fresh, monkeypatch, tmp_path, caplog):
    # Permissions do not stop the superuser; a file where a folder should be stops everyone.
    (tmp_path / "jit").write_text("")
    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path)
    with caplog.at_level(logging.WARNING, logger="tcs.kernel.machine_code"):
        assert jit_folder() is None
    assert "compiles anew in every run" in caplog.text


def test_what_is_compiled_is_announced_for_each_type_of_the_arguments(fresh, monkeypatch, tmp_path):
    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path)
    told = []

    def twice(x):
        return 2 * x

    def call(x):
        # The code of another process is loaded, if there is any.
        with announced(lambda: told.append(type(x))):
            return jit(twice)(x)

    assert (call(1), call(2), call(0.5), call(0.25)) == (2, 4, 1.0, 0.5)
    assert told == [int, float]


def test_decorating_leaves_numbas_settings_alone():
    before = numba.config.CACHE_DIR
    jit(lambda x: x)
    assert before == numba.config.CACHE_DIR


def test_a_function_for_compiled_callers_refuses_to_be_called_from_python():
    double = inner(lambda x: 2 * x)
    quadruple = jit(lambda x: double(double(x)))
    assert quadruple(10) == 40
    with pytest.raises(TypeError, match="compiled for compiled callers only"):
        double(10)


MODULES = {
    "trial": """
from tcs.kernel.cache import inner, jit
from tcs.kernel.trial_middle import FACTOR

@inner
def part(pair):
    return FACTOR * pair.a

@jit
def value(pair):
    return part(pair)
""",
    "trial_middle": "from tcs.kernel.trial_numbers import FACTOR\n",
    "trial_numbers": "FACTOR = 2.0\n",
    "trial_types": """
from typing import NamedTuple

class Pair(NamedTuple):
    a: float
    b: float
""",
    "trial_other": "",
}
"""Modules that are added to a copy of the kernel: one with compiled functions, one that hands on a
constant, one that defines it, one with the type of an argument, which no other imports, and one
that has nothing to do with them."""

SCRIPT = """
import os, sys, time
import numba
from pathlib import Path

for edit in sys.argv[1:]:
    name, before, after = edit.split("|")
    path = Path("tcs/kernel", name + ".py")
    path.write_text(path.read_text().replace(before, after))
    # A process takes longer to start than the time of an edit is uncertain.
    time.sleep(0.1)
    if os.fork() == 0:
        from tcs.kernel.trial import value
        from tcs.kernel.trial_types import Pair

        print(value(Pair(a=3.0, b=5.0)), len(value.stats.cache_hits), flush=True)
        os._exit(0)
    os.wait()
"""


def test_an_edit_recompiles_what_depends_on_it_and_nothing_else(tmp_path):
    # Numba's own cache looks at the file of the function alone.
    package = tmp_path / "tcs"
    shutil.copytree(KERNEL, package / "kernel", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(KERNEL.parent / "files", package / "files")
    for name in ("__init__.py", "errors.py"):
        shutil.copy(KERNEL.parent / name, package)
    for name, text in MODULES.items():
        (package / "kernel" / f"{name}.py").write_text(text)
    edits = {
        "trial_other||": "6.0 0",
        "trial_other||x = 1": "6.0 1",
        "trial_numbers|2.0|4.0": "12.0 0",
        "trial_types|a: float\n    b: float|b: float\n    a: float": "12.0 0",
        "trial_numbers|4.0|2.0": "6.0 0",
    }
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *edits],
        check=True,
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={
            **os.environ,
            "PYTHONPATH": str(tmp_path),
            "PYTHONDONTWRITEBYTECODE": "1",
            "TCS_CACHE_DIR": str(tmp_path / "cache"),
        },
        timeout=120,
    )
    assert dict(zip(edits, done.stdout.splitlines(), strict=True)) == edits
