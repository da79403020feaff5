"""Numba answers as before, in a process of which the first half has not been made quicker."""

import subprocess
import sys

SCRIPT = """
import itertools
import operator

import numpy as np
from numba import types
from numba.core import event
from numba.core.compiler import Flags, run_frontend
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig

from tcs.kernel.quick_numba import quicken_numba

def flags(**values):
    made = Flags()
    for name, value in values.items():
        setattr(made, name, value)
    return made

default = Flags().nrt
on = {"nrt": not default}
some = [flags(), flags(nrt=default), flags(**on), flags(**on), flags(release_gil=True)]

def flag_table():
    return [[a == b for b in some] for a in some], [hash(a) for a in some], flags() == 1

context = cpu_target.typing_context
context.refresh()
UNARY = operator.neg, operator.truth, np.sqrt, np.empty, abs, len
BINARY = (operator.add, operator.floordiv, operator.lt, operator.eq, operator.and_,
          operator.iadd, operator.getitem)
ARGUMENTS = (types.int64, types.float64, types.boolean, types.IntegerLiteral(3), types.none,
             types.float64[:, ::1], types.UniTuple(types.int64, 2))

def signature(function, args):
    try:
        return str(context.resolve_value_type(function).get_call_type(context, args, {}))
    except Exception as error:
        # Of arguments that make no sense, some rules of numba raise errors of their own.
        return type(error).__name__

def call_table():
    return [
        signature(function, args)
        for number, functions in ((1, UNARY), (2, BINARY))
        for function in functions
        for args in itertools.product(ARGUMENTS, repeat=number)
    ]

def example(a, b, n):
    total, pair = 0.0, (a[0], [b, n])
    for i in range(n):
        if a[i] > b:
            total += max(a[i], b) * pair[0]
        a[i] = total
    return total, pair

def variable_table():
    return [
        [variable.name for variable in instruction.list_vars()]
        for block in run_frontend(example).blocks.values()
        for instruction in block.body
    ]

def durations():
    told = []
    with event.install_timer("kind", told.append):
        with event.trigger_event("kind"):
            with event.install_timer("kind", told.append):
                pass
    with event.install_timer("other", told.append), event.trigger_event("other"):
        pass
    return len(told)

tables = flag_table, call_table, variable_table, durations
before, slow = [table() for table in tables], TargetConfig.__eq__
quicken_numba()
assert TargetConfig.__eq__ is not slow
for _ in range(2):
    assert [table() for table in tables] == before
assert before[0][0][0] == [True, True, False, False, False]
assert "TypingError" in before[1] and len(set(before[1])) > 20
assert any(len(names) > 2 for names in before[2])
"""


def test_flags_signatures_variables_and_timers_are_as_before():
    subprocess.run([sys.executable, "-c", SCRIPT], check=True)
