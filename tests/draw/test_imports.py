import subprocess
import sys


def test_drawing_touches_no_global_state_and_no_scene():
    code = (
        "import sys, tcs.draw;"
        "print([m for m in ('matplotlib.pyplot', 'pydrake', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
