"""A real but small study: shaving beside the wheelchair, from a few places."""

from __future__ import annotations

import dataclasses

import pytest

from tcs.output.report import Paper, draw_row, load_paper
from tcs.placement.robustness import StudyPlan, robustify, study_row
from tcs.placement.scoring import score
from tcs.placement.store import save_scores
from tests.environments import BESIDE, write_environment

PLAN = StudyPlan(samples=60, sets=12, set_samples=6)


@pytest.fixture(scope="session")
def plan():
    return PLAN


@pytest.fixture(scope="session")
def score_path(tmp_path_factory):
    """A score file."""
    folder = tmp_path_factory.mktemp("study")
    environment = write_environment(folder, "small-wheelchair", BESIDE)
    path = folder / "shaving-small-wheelchair-pr2.tcs"
    file = score("shaving", environment, approach=False)
    save_scores(path, robustify(file, sets=12, samples=32))
    return path


@pytest.fixture(scope="session")
def paper():
    """The paper, with the small environment in place of its wheelchair."""
    plain = load_paper().model_dump(by_alias=True)
    for table in ("table_1", "table_3"):
        for row in plain[table]:
            if row["environment"] == "wheelchair":
                row["environment"] = "small-wheelchair"
    return Paper.model_validate(plain)


@pytest.fixture(scope="session")
def study(score_path, paper):
    """The study of that file, with the comparison of Table III."""
    compared = tuple(paper.compared_rows())
    return study_row(score_path, dataclasses.replace(PLAN, compared=compared))


@pytest.fixture(scope="session")
def pictures(score_path):
    """The pictures of that file."""
    return draw_row(score_path)


@pytest.fixture(scope="session")
def lossless(study):
    """The same row with every goal reached in every sample."""
    best = dataclasses.replace(study.best, reached=study.best.reached | True)
    return dataclasses.replace(
        study, task="brushing", best=best, losses=dataclasses.replace(study.losses, goals=())
    )
