"""Pictures of the experiment: boxes, the tool's path, and the work over time with its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.output.draw import as_svg
from tcs.output.report.blocks import Block, Column, Picture, Table, Text
from tcs.teleop.line import Line
from tcs_studies.experiment.comparison import Comparison
from tcs_studies.experiment.course import BLOCKED_AFTER
from tcs_studies.experiment.phases import PAST, Phase
from tcs_studies.experiment.within_subject import SCRIPTED, Experiment, median_operator
from tcs_studies.output.draw.boxes import BoxGroup, BoxPlot, draw_boxes
from tcs_studies.output.draw.tool_paths import (
    PathGroup,
    WorkCurve,
    draw_tool_paths,
    draw_work_by_phase,
    draw_work_over_time,
)
from tcs_studies.output.report.experiment.tables import number, title_of
from tcs_studies.output.words import NAMES, SCALE


def box_pictures(comparison: Comparison) -> list[Picture]:
    """Return the paper's Figure 8: a box plot of each measure with a hypothesis."""
    pictures = []
    for name in comparison.hypotheses:
        samples = [SCALE.get(name, 1.0) * comparison.sample(c, name) for c in comparison.titles]
        boxes = [BoxPlot(i, sample) for i, sample in enumerate(samples) if len(sample)]
        if not boxes:
            continue
        titles = list(comparison.titles.values())
        figure = draw_boxes([BoxGroup("", boxes)], titles, label=NAMES[name])
        pictures.append(
            Picture(
                as_svg(figure, f"teleop-{name}"),
                "svg",
                f"Box plots of {NAMES[name]} with each controller.",
                f"{NAMES[name]}: one value for each operator ({comparison.operators}). Box: first "
                "to third quartile; line: median; whiskers: 5th and 95th percentile; dot: mean.",
            )
        )
    return pictures


def paths_picture(
    comparison: Comparison, paths: Mapping[str, Sequence[FloatArray]], line: Line
) -> Picture:
    """Return the paper's Figure 9: the path of the tool in each evaluated trial.

    Args:
        comparison: Titles of the conditions, and who the operators were.
        paths: Paths of the tool by condition [m], shapes (k, 3); conditions without one are left
            out.
        line: The line.
    """
    groups = [
        PathGroup(comparison.titles[name], list(of_one)) for name, of_one in paths.items() if of_one
    ]
    figure = draw_tool_paths(
        groups, np.asarray(line.start), np.asarray(line.end), blocked=BLOCKED_AFTER
    )
    operators = comparison.operators
    return Picture(
        as_svg(figure, "teleop-paths"),
        "svg",
        "Paths of the tool with each controller, from above and from the side.",
        "Every evaluated trial, from above (top) and from the side (bottom). Dashed: the line, "
        "from the disc to the square; cross: the point at which, without noise, the joint meets "
        f"its limit. {operators[0].upper()}{operators[1:]}.",
    )


def work_blocks(experiment: Experiment) -> list[Block]:
    """Return steps of work over time, and the work in each phase, with the phases defined."""
    curves = []
    for condition, drives in experiment.drives.items():
        operator = median_operator(experiment, condition, "work")
        shown = drives[operator].work[0]
        name = f"{title_of(experiment, condition)}, operator {operator + 1}"
        curves.append(WorkCurve(name, shown.time, shown.work, shown.solution))
    titles = [title_of(experiment, name) for name in experiment.drives]
    bars = {
        phase.value: [
            float(experiment.sample(c, f"{phase}_work").mean()) for c in experiment.drives
        ]
        for phase in Phase
    }
    return [
        Text(
            "A trial has three phases: START until the arm first stops, at the joint limit; "
            "SOLUTION until the tool is beyond all points at which the arm stopped, by "
            f"{100 * PAST:g} % of the line; FINISH on the rest of the line. The paper names these "
            "phases and does not say where they end."
        ),
        phase_table(experiment),
        Picture(
            as_svg(draw_work_over_time(curves), "teleop-work"),
            "svg",
            "Work on the device from sample to sample over time, a row for each controller.",
            "Work on the device from sample to sample, as in the paper's Figure 10, in the first "
            "evaluated trial of the operator with the median total work; the SOLUTION part is "
            f"grey. {SCRIPTED[0].upper()}{SCRIPTED[1:]}.",
        ),
        Picture(
            as_svg(draw_work_by_phase(titles, bars), "teleop-phases"),
            "svg",
            "Total work on the device with each controller, divided into three phases.",
            "Total work on the device, means over the evaluated trials, as in the paper's Figure "
            f"11 ({SCRIPTED}).",
        ),
    ]


def phase_table(experiment: Experiment) -> Table:
    """Return time and work in each phase, means over the operators."""
    rows = []
    for condition in experiment.drives:
        total = float(experiment.sample(condition, "work").mean())
        for phase in Phase:
            seconds = float(experiment.sample(condition, f"{phase}_time").mean())
            work = float(experiment.sample(condition, f"{phase}_work").mean())
            rows.append(
                [
                    title_of(experiment, condition),
                    phase.upper(),
                    number(seconds),
                    number(SCALE["work"] * work),
                    number(100.0 * work / total if total else 0.0),
                    number(SCALE["work"] * work / seconds) if seconds else "–",
                ]
            )
    titles = ("time [s]", "work [mJ]", "of the total [%]", "work per second [mJ/s]")
    return Table(
        f"Phases of the trials, means over the evaluated trials of all operators; {SCRIPTED}.",
        [Column("controller", False), Column("phase", False), *(Column(one) for one in titles)],
        rows,
    )
