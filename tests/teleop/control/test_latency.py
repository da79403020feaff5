"""Latency: what arrives late, and by how much."""

from __future__ import annotations

import math

import pytest

from tcs.errors import TcsError
from tcs.teleop.control.latency import DelayLine, Latency


@pytest.mark.parametrize(("latency", "count"), [(0.0, 0), (0.004, 0), (0.03, 3), (0.1, 10)])
def test_values_come_out_a_fixed_number_of_periods_later(latency, count):
    line = DelayLine(latency, 0.01, -1)
    out = [line.send(i) for i in range(20)]
    assert out == [-1] * count + list(range(20 - count))


def test_a_reset_drops_the_values_on_their_way():
    line = DelayLine(0.03, 0.01, "rest")
    for value in "abcd":
        line.send(value)
    line.reset("rest")
    assert [line.send(value) for value in "efghi"] == ["rest", "rest", "rest", "e", "f"]


@pytest.mark.parametrize(
    ("path", "command", "picture"),
    [("command", 0.2, 0.0), ("picture", 0.0, 0.2), ("both", 0.2, 0.2)],
)
def test_a_latency_states_where_it_acts(path, command, picture):
    latency = Latency(0.2, path)
    assert (latency.command, latency.picture) == (command, picture)
    assert latency.to_json() == {"command_latency": command, "picture_latency": picture}
    assert ("0.2 s for commands" in latency.summary) == bool(command)
    assert ("0.2 s for pictures" in latency.summary) == bool(picture)


def test_no_latency_leaves_no_trace():
    assert Latency().summary == ""
    assert Latency().to_json() == {}


@pytest.mark.parametrize("seconds", [-0.1, 11.0, math.nan, math.inf])
def test_latencies_out_of_range_are_refused(seconds):
    with pytest.raises(TcsError, match="a latency must be 0 to 10 s"):
        Latency(seconds)
