"""The sources of machine code are all that it may be made of, and no others."""

from __future__ import annotations

import ast
import math
import os
import sys
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core import types

import tcs
from tcs.kernel.sources import COMPILER, SOURCES, Sources, homes
from tcs.kernel.sweep import score
from tcs.kernel.views import UnownedView

PACKAGE = Path(tcs.__path__[0])
MODULES = sorted(
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    for path in (PACKAGE / "kernel").rglob("*.py")
    if path.stem != "__init__"
)


def imported(module):
    """Return what Python's own parser says that a module of the package imports."""
    text = PACKAGE.parent.joinpath(*module.split(".")).with_suffix(".py").read_text()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom):
            yield node.module
            inside = PACKAGE.parent.joinpath(*node.module.split("."))
            names = [alias.name for alias in node.names]
            yield from (f"{node.module}.{n}" for n in names if (inside / f"{n}.py").exists())
            yield from (
                f"{node.module}.{n}" for n in names if (inside / n / "__init__.py").exists()
            )
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_all_that_the_kernel_imports_is_among_its_sources():
    known = {*sys.stdlib_module_names, "numpy", "numba", "llvmlite", "scipy"}
    for module in set(MODULES).difference(COMPILER):
        found = {*SOURCES.closure([module]), *COMPILER}
        for name in imported(module):
            # Of other packages, versions tell; of scipy, nothing is compiled.
            assert name in found or name.split(".")[0] in known, (module, name)


def test_scoring_is_made_of_neither_approaches_nor_motions():
    assert score.__module__ == "tcs.kernel.sweep"
    found = SOURCES.closure(["tcs.kernel.sweep"])
    assert {"tcs.kernel.kinematics", "tcs.kernel.freedom.forms", "tcs.kernel.scores"} < found
    others = "tcs.kernel.approach", "tcs.kernel.motion", "tcs.kernel.sets", "tcs.placement"
    assert not [name for name in found if name.startswith(others)]


@pytest.fixture
def package(tmp_path):
    """Function that writes a package and returns its sources."""
    folder = tmp_path / "pack"

    def write(since=math.inf, **modules):
        texts = {"__init__": "", "inside/__init__": "", "inside/deep": "", "b": "", "c": ""}
        for name, text in {**texts, **modules}.items():
            path = folder / f"{name}.py"
            path.parent.mkdir(exist_ok=True, parents=True)
            path.write_text(text)
        return Sources(folder, since)

    return write


@pytest.mark.parametrize(
    "text",
    [
        "from pack.b import x",
        "from pack.b import x as y, z",
        "from pack import b",
        "from pack import b as other",
        "from pack import (\n    c,  # (not b)\n    b,\n)",
        "from pack import c, \\\n    b",
        "from \\\n    pack.b import x",
        "from .b import x",
        "from . import b",
        "from.b import(x)",
        "x = 1; from pack.b import y",
        "try: from pack.b import y\nexcept ImportError: pass",
        "if TYPE_CHECKING:\n    from pack.b import X",
        "def f():\n    from pack.b import x\n    return x",
        '"""Text from a place (import it from (\n"""\nfrom pack.b import x  # and (\n',
        "import pack.b",
        "import os, pack.b as b",
        "x = 1; import pack",
        "from pack import *",
        "import importlib\nb = importlib.import_module(name)",
        "b = __import__(name)",
        "exec(text)",
    ],
)
def test_imports_are_found_however_they_are_written(package, text):
    assert "pack.b" in package(a=text).closure(["pack.a"])


@pytest.mark.parametrize(
    "text", ["from pack.c import b", "from other.pack.b import x", "from pack.bb import x", "b = 1"]
)
def test_what_is_not_imported_is_not_among_the_sources(package, text):
    assert "pack.b" not in package(a=text, bb="").closure(["pack.a"])


def test_a_package_by_name_is_all_that_it_contains(package):
    sources = package(a="from pack import inside\n", c="from pack.inside import something\n")
    assert sources.closure(["pack.a"]) == {"pack", "pack.a", "pack.inside", "pack.inside.deep"}
    assert sources.closure(["pack.c"]) == {"pack.c", "pack.inside"}


def test_an_edit_changes_the_digest_of_those_that_import_the_text(package):
    texts = {"a": "from pack.b import x", "b": "from pack.inside.deep import x"}
    asked = [["pack.a"], ["pack.b"], ["pack.c", "pack.b"], ["pack.inside.deep"], ["pack.c"]]
    sources = package(**texts)
    before = [sources.digest(modules) for modules in asked]
    assert before == [package(**texts).digest(modules) for modules in asked]
    sources = package(**texts, **{"inside/deep": "x = 1"})
    changed = [sources.digest(modules) != old for modules, old in zip(asked, before, strict=True)]
    assert changed == [True, True, True, True, False]


def test_text_that_moves_to_another_module_changes_the_digest(package):
    texts = {"a": "from pack.b import x\nfrom pack.c import y"}
    before = package(**texts, b="x = 1").digest(["pack.a"])
    assert before != package(**texts, b="", c="x = 1").digest(["pack.a"])


def test_what_was_edited_or_moved_since_the_package_was_imported_has_no_digest(package):
    # The process may have imported the text of before.
    sources = package(since=0.0, a="from pack.b import x")
    assert sources.digest(["pack.a"]) is None
    sources = package(a="from pack.b import x")
    now = os.stat(sources._path("pack.b")).st_ctime
    os.utime(sources._path("pack.b"), (now + 3600, now + 3600))
    # The clock of another machine tells nothing.
    assert Sources(sources._folder, now - 1.0).digest(["pack.b"]) is not None
    assert Sources(sources._folder, now - 1.0).digest(["pack.a"]) is None


def test_without_a_source_there_is_no_digest(package):
    sources = package(a="")
    assert sources.digest(["pack.a", "sys"]) is None
    assert sources.digest(["pack.a", "of_no_module"]) is None
    assert sources.digest(["pack.a"]) is not None


class Point(NamedTuple):
    """A named tuple that this module defines."""

    x: float


def test_types_tell_the_modules_that_define_them():
    point, view = numba.typeof(Point(1.0)), UnownedView(numba.typeof(Point(1.0)))
    assert homes((types.float64, numba.typeof(np.zeros(3)))) == frozenset()
    assert homes((point,)) == homes(types.Optional(types.Tuple((types.int64, point)))) == {__name__}
    assert homes((view,)) == {__name__, "tcs.kernel.views"}
    function = numba.njit(lambda x: x)
    assert homes((numba.typeof(function),)) == {__name__}
