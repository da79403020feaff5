from tests.fresh import fresh


def test_drawing_touches_no_global_state_and_no_scene():
    code = (
        "import sys, tcs.output.draw;"
        "print([m for m in ('matplotlib.pyplot', 'pydrake', 'numba') if m in sys.modules])"
    )
    assert fresh(code) == "[]"
