"""The robot of the pick-and-place experiment, loaded once."""

from __future__ import annotations

import pytest

from tcs_studies.pick_and_place.protocol import load_pick_and_place_robot


@pytest.fixture(scope="session")
def tiago():
    return load_pick_and_place_robot()
