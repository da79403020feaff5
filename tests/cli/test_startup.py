"""Quick commands stay quick: they load none of the large libraries."""

from __future__ import annotations

from pathlib import Path

import pytest

import tcs.capability
import tcs.capability.arplace
from tcs.capability.arplace import save_arplace
from tests.capability.arplace.example import discs, model

HEAVY = ("pydrake", "numba", "scipy", "matplotlib", "pandas", "trimesh", "tcs_shapes")
# Printed at exit on stderr, where these commands print nothing else.
REPORT = (
    "import atexit; atexit.register(lambda: print("
    f"[m for m in {HEAVY} if m in sys.modules], file=sys.stderr))"
)


@pytest.mark.parametrize("as_json", [(), ("--json",)], ids=["person", "json"])
@pytest.mark.parametrize("verb", ["list", "select"])
def test_quick_commands_load_nothing_heavy(process, small_file, verb, as_json):
    words = () if verb == "list" else (small_file, "--here", 1, 0, 0)
    ran = process(verb, *words, *as_json, before=REPORT)
    assert ran.code == 0
    assert ran.out
    assert ran.err.strip() == "[]"


def test_a_heavy_library_would_be_noticed(process):
    ran = process("list", before=f"{REPORT}\nimport pandas")
    assert "'pandas'" in ran.err


def test_reading_a_robot_loads_nothing_that_only_fitting_needs(process):
    ran = process(
        "--version", before=f"{REPORT}\nimport tcs.model.robots\ntcs.model.robots.load_robot('pr2')"
    )
    assert ran.code == 0
    assert ran.err.strip() == "[]"


def test_scoring_takes_no_shapes_until_a_mesh_is_to_be_fitted(process):
    scoring = "import tcs.cli.robots, tcs.cli.score, tcs.model.scene, tcs.placement.scoring"
    ran = process("--version", before=f"{REPORT}\n{scoring}")
    assert "'pydrake'" in ran.err
    assert "tcs_shapes" not in ran.err


def test_a_query_of_arplace_needs_neither_simulator_nor_compiler(process, tmp_path):
    path = tmp_path / "made-up.arp"
    save_arplace(path, model(discs()))
    ran = process("arplace", "query", path, "--samples", 1, before=REPORT)
    assert ran.code == 0
    loaded = ran.err.strip()
    assert "pydrake" not in loaded
    assert "numba" not in loaded


@pytest.mark.parametrize("package", [tcs.capability, tcs.capability.arplace])
def test_names_loaded_on_first_use_are_there(package):
    for name in package.__all__:
        assert getattr(package, name)
    assert set(package.__all__) <= set(dir(package))
    with pytest.raises(AttributeError, match="no attribute 'merg'"):
        _ = package.merg


def test_a_command_rarely_searches_its_modules_for_garbage(process):
    report = (
        "import atexit, gc; atexit.register(lambda: print("
        "sum(s['collections'] for s in gc.get_stats()), gc.get_freeze_count() > 10_000, "
        "file=sys.stderr))"
    )
    ran = process("list", before=report)
    assert ran.code == 0
    searches, is_frozen = ran.err.split()
    # 27 of them before the command line begins; by thresholds of Python, 138.
    assert int(searches) < 60
    assert is_frozen == "True"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    ("words", "redirect", "code", "line"),
    [
        # A table, large and small outputs; a line of an error; and closed instead of full.
        *((words, "dup2(full, 1)", 1, True) for words in (["list"], ["list", "--json"])),
        (["--version"], "dup2(full, 1)", 1, True),
        (["check", "/nowhere"], "dup2(full, 2)", 1, False),
        (["list"], "close(1)", 0, False),
    ],
    ids=["table", "json", "version", "error", "closed"],
)
def test_an_output_that_takes_nothing_is_one_line(process, words, redirect, code, line):
    # As a shell does it, before Python begins.
    full = "full = os.open('/dev/full', os.O_WRONLY)"
    again = "os.execv(sys.executable, [sys.executable, '-m', 'tcs', *sys.argv[1:]])"
    ran = process(*words, before=f"import os; {full}; os.{redirect}; {again}")
    text = "tcs: the output cannot be written: No space left on device.\n"
    assert (ran.code, ran.out, ran.err) == (code, "", text if line else "")
