"""A real but small job: the paper's scene on a grid of some hundred configurations."""

from __future__ import annotations

import pytest

from tcs.placement.scoring import load_job, score
from tests.rooms import BESIDE, write_room


@pytest.fixture(scope="session")
def small_room(tmp_path_factory):
    """Path of an environment file of the user's own."""
    return write_room(tmp_path_factory.mktemp("rooms"), "small-room", BESIDE)


@pytest.fixture(scope="session")
def small_file(small_room):
    """Shaving, scored in the small room."""
    return score("shaving", small_room)


@pytest.fixture(scope="session")
def small_job(small_room):
    """The job behind `small_file`."""
    return load_job("shaving", small_room, "pr2")
