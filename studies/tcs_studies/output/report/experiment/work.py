"""Work on the device over time and by phase: Figures 10 and 11 of the null-space paper."""

from __future__ import annotations

from tcs.output.draw import as_svg
from tcs.output.report.blocks import Block, Column, Picture, Table, Text
from tcs_studies.experiment.phases import PAST, Phase
from tcs_studies.experiment.within_subject import SCRIPTED, Experiment, median_operator
from tcs_studies.output.draw.work import WorkCurve, draw_work_by_phase, draw_work_over_time
from tcs_studies.output.report.experiment.tables import number, title_of
from tcs_studies.output.words import SCALE


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
