"""Numba's flags are equal and hash as before."""

import subprocess
import sys

SCRIPT = """
from numba.core.compiler import Flags
from numba.core.targetconfig import TargetConfig

def flags(**values):
    made = Flags()
    for name, value in values.items():
        setattr(made, name, value)
    return made

default = Flags().nrt
on = {"nrt": not default}
some = [flags(), flags(nrt=default), flags(**on), flags(**on), flags(release_gil=True)]

def table():
    return [[a == b for b in some] for a in some], [hash(a) for a in some], flags() == 1

before, slow = table(), TargetConfig.__eq__
from tcs.kernel.quick_flags import quicken_flags
assert quicken_flags()
assert TargetConfig.__eq__ is not slow
assert table() == before
assert before[0][0] == [True, True, False, False, False]
"""


def test_flags_are_equal_and_hash_as_before():
    subprocess.run([sys.executable, "-c", SCRIPT], check=True)
