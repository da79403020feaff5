"""The shipped robots as parameters of tests that take seconds for each."""

import pytest

from tcs.model.robots import robot_names

QUICK = {"pr2", "pr2_right", "tiago", "iiwa7", "panda", "baxter"}
"""Robots of every test run; the others take part in the slow one."""


def all_robots():
    """Return the name of every shipped robot as a parameter."""
    return [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in robot_names()
    ]
