"""The arm of the experiments and its line."""

from __future__ import annotations

import pytest

from tcs_studies.experiment.course import find_course
from tests.teleop.conftest import iiwa, ready

__all__ = ["iiwa", "ready"]


@pytest.fixture(scope="session")
def course(iiwa):
    """The line of the experiment with the iiwa; finding it takes seconds."""
    return find_course(iiwa)
