"""Small rows of real scenes: a few base poses beside the wheelchair and the bed."""

from __future__ import annotations

import pytest

from tcs.placement.robustness import Trials
from tcs.placement.scoring import score
from tests.environments import BESIDE, write_environment
from tests.exact import exact_task

BED = {
    "bed_height": (0, 0.2, 2),
    "head_rest": (35, 35, 2),
    "base_x": (0.4, 0.3, 4),
    "base_y": (-1, 1.8, 2),
    "base_yaw": (0, 90, 4),
    "torso": (0.15, 0.15, 2),
}
OBSERVED = {"person_y": (0, 0.05, 2)}


@pytest.fixture(scope="session")
def environments(tmp_path_factory):
    """Paths of two environment files of the user's own, by name."""
    folder = tmp_path_factory.mktemp("environments")
    return {
        "chair": write_environment(folder, "small-chair", BESIDE),
        "bed": write_environment(folder, "small-bed", BED, based_on="bed", observed=OBSERVED),
    }


@pytest.fixture(scope="session")
def chair_file(environments, tmp_path_factory):
    """Shaving in the wheelchair, from a few base poses; all contacts of the body count."""
    task = exact_task("shaving", tmp_path_factory.mktemp("chair"))
    return score(task, environments["chair"], approach=False)


@pytest.fixture(scope="session")
def bed_file(environments, tmp_path_factory):
    """Bathing on the bed, from a few base poses, for two shifts of the person."""
    task = exact_task("bathing", tmp_path_factory.mktemp("bed"))
    return score(task, environments["bed"], approach=False)


@pytest.fixture(scope="session")
def chair_trials(chair_file):
    return Trials.of(chair_file)


@pytest.fixture(scope="session")
def bed_trials(bed_file):
    return Trials.of(bed_file)


@pytest.fixture(scope="session", params=["chair", "bed"])
def trials(request):
    """Both rows, one after the other."""
    return request.getfixturevalue(f"{request.param}_trials")
