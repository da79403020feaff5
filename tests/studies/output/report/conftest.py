"""A real but small study: shaving beside the wheelchair, from a few base poses."""

from __future__ import annotations

import dataclasses

import pytest

from tcs_studies.output.report.robustness.page import draw_row
from tcs_studies.output.report.robustness.paper import Paper, load_paper
from tcs_studies.robustness.study import StudyPlan, study_row
from tests.output.report.conftest import score_path

__all__ = ["score_path"]

PLAN = StudyPlan(samples=60, sets=12, set_samples=6)


@pytest.fixture(scope="session")
def plan():
    return PLAN


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
    best = dataclasses.replace(
        study.best, reached=study.best.reached | True, done=study.best.done | True
    )
    return dataclasses.replace(
        study, task="brushing", best=best, losses=dataclasses.replace(study.losses, goals=())
    )
