"""A score file of a few base poses beside the wheelchair, with estimates of success."""

from __future__ import annotations

import pytest

from tcs.placement.robustness import robustify
from tcs.placement.scoring import score
from tcs.placement.store import save_scores
from tests.environments import BESIDE, write_environment


@pytest.fixture(scope="session")
def score_path(tmp_path_factory):
    """A score file."""
    folder = tmp_path_factory.mktemp("study")
    environment = write_environment(folder, "small-wheelchair", BESIDE)
    path = folder / "shaving-small-wheelchair-pr2.tcs"
    file = score("shaving", environment, paper=True)
    save_scores(path, robustify(file, sets=12, samples=32))
    return path
