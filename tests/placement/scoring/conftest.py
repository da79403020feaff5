"""A real but small job: the paper's scene on a grid of some hundred configurations."""

from __future__ import annotations

import pytest

from tcs.placement.scoring import load_job, score
from tests.environments import BESIDE, write_environment


@pytest.fixture(scope="session")
def small_environment(tmp_path_factory):
    """Path of an environment file of the user's own."""
    return write_environment(tmp_path_factory.mktemp("environments"), "small-wheelchair", BESIDE)


@pytest.fixture(scope="session")
def small_file(small_environment):
    """Shaving, scored in the small environment."""
    return score("shaving", small_environment, paper=True)


@pytest.fixture(scope="session")
def small_job(small_environment):
    """The job behind `small_file`."""
    return load_job("shaving", small_environment, "pr2", paper=True)
