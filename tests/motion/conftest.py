"""Two goals of shaving at one base pose: one that can be done, one that only scoring reaches."""

from __future__ import annotations

import pytest
import yaml
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tests.exact import exact_content

CONFIGURATION = ("base_x = 0.6 m", "base_y = -0.9 m", "base_yaw = 45 deg", "torso = 0.3 m")


@pytest.fixture(scope="session")
def two_goals(tmp_path_factory):
    """Path of a score file with goals 5 and 6 of shaving at one configuration."""
    folder = tmp_path_factory.mktemp("motion")
    task = exact_content("shaving")
    task["goals"] = [task["goals"][5], task["goals"][6]]
    path = folder / "shaving.yaml"
    path.write_text(yaml.safe_dump(task))
    scored = folder / "two_goals.tcs"
    tcs.save(
        scored, tcs.score(path, "wheelchair", "pr2", jobs=1, only=CONFIGURATION, approach=False)
    )
    return scored


@pytest.fixture(scope="session")
def planned(two_goals):
    """The plan of `two_goals`."""
    return tcs.plan(tcs.load(two_goals), [0], seed=3)


@pytest.fixture
def tcs_plan():
    """Function that runs `tcs plan` with the given arguments and returns the result of click."""
    return lambda *words: CliRunner().invoke(app, ["plan", *map(str, words)])
