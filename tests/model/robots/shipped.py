"""The shipped robots as parameters of tests that take seconds for each."""

from tcs.model.robots import robot_names
from tests.chosen import some_of

QUICK = "tiago", "iiwa7"
"""Robots of every test run, one of either class of arms; the others take part in the slow one."""


def all_robots():
    """Return the name of every shipped robot as a parameter."""
    return some_of(robot_names(), *QUICK)
