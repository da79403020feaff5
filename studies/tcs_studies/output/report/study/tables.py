"""Tables of a study about people and their answers, which scripted operators do not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tcs.output.draw import as_svg
from tcs.output.report.blocks import Cell, Column, Picture, Table
from tcs.output.words import percent
from tcs_studies.experiment.trial import END_EFFECTOR, NOVEL
from tcs_studies.output.draw.boxes import COLOURS
from tcs_studies.output.report.experiment.tables import NONE, number
from tcs_studies.study.forms import COMMENTS, Answer, difficulty_form
from tcs_studies.study.participants import ParticipantFile
from tcs_studies.study.results import StudyResults
from tcs_studies.study.steps import BACKGROUND, DIFFICULTY, steps_of


def participants_table(results: StudyResults) -> Table:
    """Return all participants: order, answers about themselves, and whether they are included."""
    rows: list[list[Cell | str]] = []
    for one in results.participants:
        about = results.form_answers(one, BACKGROUND)
        cells = [str(about.get(key, NONE)) for key in ("age", "gender", "experience")]
        order = " – ".join(results.study.titles[name] for name in one.order)
        rows.append([one.participant, order, *cells, _status(results, one)])
    titles = ("participant", "order", "age", "gender", "experience", "status")
    return Table(
        "Participants. Means are over those that are included.",
        [Column(title, title == "age") for title in titles],
        rows,
    )


def _status(results: StudyResults, participant: ParticipantFile) -> Cell:
    if not participant.is_active:
        return Cell("dropped", "bad")
    open_steps = len(participant.open_steps(results.study))
    if open_steps:
        total = len(steps_of(results.study, participant.order))
        return Cell(f"{total - open_steps} of {total} steps", "quiet")
    return Cell("included", "good")


def preference_table(results: StudyResults) -> Table:
    """Return the null-space paper's Table IV: how many prefer each condition."""
    counts = results.preferred()
    total = sum(counts.values())
    cells = [
        f"{percent(counts[name] / total, 0)} ({counts[name]}/{total})" if total else NONE
        for name in results.study.conditions
    ]
    paper = ""
    if {END_EFFECTOR.name, NOVEL.name} == {*results.study.conditions}:
        paper = " (there 19 % end-effector control, 81 % novel controller)"
    return Table(
        f"Preferred condition, as in the paper's Table IV{paper}; {results.comparison.operators}.",
        [Column("measure", False), *(Column(title) for title in results.study.titles.values())],
        [["preferred condition [%]", *cells]],
    )


def difficulty_table(results: StudyResults) -> Table:
    """Return the thesis's Figure 10 as a table: agreement to the statement on the difficulty."""
    options = difficulty_form("").questions[0]
    labels = [label for _, label in getattr(options, "options", ())]
    rows = []
    for condition, title in results.study.titles.items():
        values = results.comparison.sample(condition, DIFFICULTY)
        counts = [str(int((values == step).sum())) for step in range(1, len(labels) + 1)]
        mean = number(values.mean()) if len(values) else NONE
        rows.append([title, str(len(values)), *counts, mean])
    return Table(
        "Agreement to “It was difficult to execute the task”, number of participants, as in the "
        f"thesis's Figure 10; mean from 1 to 5; {results.comparison.operators}.",
        [Column("condition", False), Column("N"), *(Column(label) for label in labels),
         Column("mean")],
        rows,
    )  # fmt: skip


def scores_table(results: StudyResults, measure: str, caption: str) -> Table:
    """Return a measure of each participant in each condition.

    Args:
        results: The results.
        measure: Name of the measure.
        caption: Caption without the note on the participants.
    """
    by_condition = results.comparison.values[measure]
    rows = [
        [one.participant, *(_value(by_condition[name][i]) for name in results.study.conditions)]
        for i, one in enumerate(results.included)
    ]
    return Table(
        f"{caption}; {results.comparison.operators}.",
        [Column("participant", False), *(Column(t) for t in results.study.titles.values())],
        rows,
    )


def _value(value: float) -> str:
    # NaN is the value of who has none.
    return NONE if value != value else number(value)


def comments_table(results: StudyResults) -> Table:
    """Return the comments of the included participants."""
    rows = []
    for one in results.included:
        for step in steps_of(results.study, one.order):
            text: Answer = results.form_answers(one, step.key).get(COMMENTS, "")
            if text:
                condition = NONE if step.condition is None else results.study.titles[step.condition]
                rows.append(
                    [one.participant, condition, str(step.form), " ".join(str(text).split())]
                )
    titles = ("participant", "condition", "questionnaire", "comment")
    return Table("Comments of participants.", [Column(title, False) for title in titles], rows)


def acceptance_pictures(results: StudyResults) -> Sequence[Picture]:
    """Return the null-space paper's Figure 8f; nothing if nobody filled in the questionnaire."""
    comparison, found = results.comparison, []
    if "usefulness" not in comparison.values:
        return []
    for name, title in comparison.titles.items():
        useful, satisfying = (
            comparison.sample(name, one) for one in ("usefulness", "satisfaction")
        )
        if len(useful):
            found.append(AcceptanceScores(title, useful, satisfying))
    if not found:
        return []
    return [
        Picture(
            as_svg(draw_acceptance(found), "study-acceptance"),
            "svg",
            "Satisfaction over usefulness of each condition.",
            "Acceptance after van der Laan, as in the paper's Figure 8f: a small mark for each "
            f"participant, a large one for the mean; {comparison.operators}.",
        )
    ]


_INK = "#222222"
_MARKERS = ("o", "s", "^", "D")
"""Shapes of the means: distinct without colour."""


@dataclass(frozen=True, eq=False)
class AcceptanceScores:
    """Scores of one condition."""

    title: str
    usefulness: NDArray[np.float64]
    """Shape (n,), in [-2, 2]."""
    satisfaction: NDArray[np.float64]
    """Shape (n,), in [-2, 2]."""


def draw_acceptance(conditions: Sequence[AcceptanceScores]) -> Figure:
    """Return satisfaction over usefulness: a small mark per participant, and the means.

    Args:
        conditions: The conditions, each with at least one participant.
    """
    figure = Figure(figsize=(6.2, 5.6), layout="constrained")
    axes = figure.subplots()
    for i, one in enumerate(conditions):
        colour, marker = COLOURS[i % len(COLOURS)], _MARKERS[i % len(_MARKERS)]
        axes.scatter(
            one.usefulness, one.satisfaction, s=22, marker=marker, color=colour, alpha=0.45, lw=0
        )
        axes.scatter(
            [one.usefulness.mean()], [one.satisfaction.mean()], s=130, marker=marker,
            color=colour, edgecolor=_INK, lw=1.0, zorder=3, label=f"{one.title}: mean",
        )  # fmt: skip
    for line in (axes.axhline, axes.axvline):
        line(0.0, color="#767f89", lw=0.8, zorder=0)
    axes.set_xlim(-2.1, 2.1)
    axes.set_ylim(-2.1, 2.1)
    axes.set_aspect("equal")
    axes.set_xlabel("usefulness")
    axes.set_ylabel("satisfaction")
    axes.grid(color="#e6e9ed", lw=0.8)
    axes.set_axisbelow(True)
    figure.legend(loc="outside upper left", ncols=2, frameon=False, fontsize=9)
    return figure
