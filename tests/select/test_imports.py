import subprocess
import sys


def test_choosing_needs_neither_simulator_nor_compiler():
    code = (
        "import sys, tcs.select, tcs.store, tcs.tables;"
        "print([m for m in ('pydrake', 'numba', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
