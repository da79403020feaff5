"""Printing of results."""

import json
import math

from tcs.output.terminal import print_result
from tcs.output.terminal.console import progress_bar


def test_numbers_that_json_cannot_hold_are_null(capsys):
    result = {"t": math.inf, "rows": [{"p": math.nan}, (-math.inf, 1.5)], "name": "inf", "n": 3}
    print_result(result, print, as_json=True)
    printed = json.loads(capsys.readouterr().out, parse_constant=lambda name: f"not JSON: {name}")
    assert printed == {"t": None, "rows": [{"p": None}, [None, 1.5]], "name": "inf", "n": 3}


def test_lines_of_progress_say_how_long_it_takes_still(capsys, monkeypatch):
    now = iter((100.0, 105.0, 120.0))
    monkeypatch.setattr("tcs.output.terminal.console.time.monotonic", lambda: next(now))
    with progress_bar("parts", lines=True) as advance:
        advance(1, 8)
        advance(2, 8)
    # 20 s for two of eight.
    assert capsys.readouterr().err == "tcs: 2 of 8 parts, about 60 s left\n"
