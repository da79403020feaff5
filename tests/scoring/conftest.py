"""A real but small job: the paper's scene on a grid of some hundred configurations."""

from __future__ import annotations

import pytest

from tcs.scoring import load_job, score

SMALL_ROOM = """
based_on: wheelchair
name: small-room
title: The wheelchair, seen from a few places
grid:
  base_x: {unit: m, start: 0.5, step: 0.1, count: 8}
  base_y: {unit: m, start: -0.95, step: 1.7, count: 2}
  base_yaw: {unit: deg, start: 90, step: 45, count: 4}
  torso: {unit: m, start: 0.15, step: 0.15, count: 2}
"""


@pytest.fixture(scope="session")
def small_room(tmp_path_factory):
    """Path of an environment file of the user's own."""
    path = tmp_path_factory.mktemp("rooms") / "small-room.yaml"
    path.write_text(SMALL_ROOM)
    return path


@pytest.fixture(scope="session")
def small_file(small_room):
    """Shaving, scored in the small room."""
    return score("shaving", small_room)


@pytest.fixture(scope="session")
def small_job(small_room):
    """The job behind `small_file`."""
    return load_job("shaving", small_room, "pr2")
