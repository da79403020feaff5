"""Real but small rows: a few places beside the wheelchair and the bed."""

from __future__ import annotations

import pytest

from tcs.robustness import Trials
from tcs.scoring import score

SMALL_CHAIR = """
based_on: wheelchair
name: small-chair
title: The wheelchair, seen from a few places
grid:
  base_x: {unit: m, start: 0.5, step: 0.1, count: 8}
  base_y: {unit: m, start: -0.95, step: 1.7, count: 2}
  base_yaw: {unit: deg, start: 90, step: 45, count: 4}
  torso: {unit: m, start: 0.15, step: 0.15, count: 2}
"""

SMALL_BED = """
based_on: bed
name: small-bed
title: The bed, seen from a few places
grid:
  bed_height: {unit: m, start: 0, step: 0.2, count: 2}
  head_rest: {unit: deg, start: 35, step: 35, count: 2}
  base_x: {unit: m, start: 0.4, step: 0.3, count: 4}
  base_y: {unit: m, start: -1, step: 1.8, count: 2}
  base_yaw: {unit: deg, start: 0, step: 90, count: 4}
  torso: {unit: m, start: 0.15, step: 0.15, count: 2}
observed:
  person_y: {unit: m, start: 0, step: 0.05, count: 2}
"""


@pytest.fixture(scope="session")
def rooms(tmp_path_factory):
    """Paths of two environment files of the user's own, by name."""
    folder = tmp_path_factory.mktemp("rooms")
    paths = {}
    for name, text in (("chair", SMALL_CHAIR), ("bed", SMALL_BED)):
        paths[name] = folder / f"small-{name}.yaml"
        paths[name].write_text(text)
    return paths


@pytest.fixture(scope="session")
def chair_file(rooms):
    """Shaving in the wheelchair, from a few places."""
    return score("shaving", rooms["chair"])


@pytest.fixture(scope="session")
def bed_file(rooms):
    """Bathing on the bed, from a few places, for two shifts of the person."""
    return score("bathing", rooms["bed"])


@pytest.fixture(scope="session")
def chair_trials(chair_file):
    return Trials.of(chair_file)


@pytest.fixture(scope="session")
def bed_trials(bed_file):
    return Trials.of(bed_file)


@pytest.fixture(scope="session", params=["chair", "bed"])
def trials(request):
    """Both, one after the other."""
    return request.getfixturevalue(f"{request.param}_trials")
