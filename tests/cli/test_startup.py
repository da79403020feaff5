"""Quick commands stay quick: they load none of the large libraries."""

from __future__ import annotations

import pytest

HEAVY = ("pydrake", "numba", "scipy", "matplotlib", "pandas", "trimesh")
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
