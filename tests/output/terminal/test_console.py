"""Printing of results."""

import json
import math

from tcs.output.terminal import print_result


def test_numbers_that_json_cannot_hold_are_null(capsys):
    result = {"t": math.inf, "rows": [{"p": math.nan}, (-math.inf, 1.5)], "name": "inf", "n": 3}
    print_result(result, print, as_json=True)
    printed = json.loads(capsys.readouterr().out, parse_constant=lambda name: f"not JSON: {name}")
    assert printed == {"t": None, "rows": [{"p": None}, [None, 1.5]], "name": "inf", "n": 3}
