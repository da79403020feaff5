"""The paper's figures."""

from __future__ import annotations

from tcs.placement.scoring import task_environment_pairs
from tcs_studies.output.report.robustness.paper import load_paper


def test_every_row_that_ships_is_in_table_1_once():
    rows = load_paper().rows()
    assert len(rows) == len(set(rows)) == 13
    assert set(rows) == set(task_environment_pairs())


def test_table_3_has_five_tasks_with_one_and_two_configurations():
    paper = load_paper()
    assert len(paper.compared_rows()) == 5
    for task, environment in paper.compared_rows():
        for members in (1, 2):
            row = paper.compared(task, environment, members)
            missing = (task, members) == ("feeding", 2)
            assert (row.without is None) == (row.with_ is None) == missing


def test_tables_agree_where_they_print_the_same():
    paper = load_paper()
    for task, environment in paper.compared_rows():
        best = paper.published(task, environment)
        cells = [paper.compared(task, environment, members).with_ for members in (2, 1)]
        assert next(cell for cell in cells if cell) == (best.mean, best.std)


def test_figures_missing_in_the_paper_are_none():
    assert load_paper().published("shaving", "kitchen") is None
    assert load_paper().compared("scratching_chest", "bed", 1) is None
