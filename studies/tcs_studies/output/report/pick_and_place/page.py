"""The page of the pick-and-place experiment, with the figures and tables of the ITCM thesis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

import numpy as np
from matplotlib.figure import Figure

from tcs.kernel.arrays import FloatArray
from tcs.output.draw import as_svg
from tcs.output.report.blocks import (
    Block,
    Bullets,
    Code,
    Column,
    Facts,
    Page,
    Picture,
    Section,
    Table,
    Text,
)
from tcs.output.report.machine import machine, today, versions
from tcs.output.words import p_value
from tcs_studies.output.draw.repetitions import (
    LearningPart,
    ParticipantPanel,
    RepetitionGroup,
    draw_distances,
    draw_learning,
    draw_participants,
    draw_paths,
)
from tcs_studies.output.report.experiment.tables import number
from tcs_studies.output.report.pick_and_place.tables import (
    PAIRS,
    SCRIPTED,
    failures_table,
    learning_table,
    mean_std,
    normality_table,
    segments_table,
    table_2,
)
from tcs_studies.output.words import PICK_AND_PLACE
from tcs_studies.pick_and_place.analysis import compared, learning_curve
from tcs_studies.pick_and_place.phases import Traits
from tcs_studies.pick_and_place.protocol import Part, PickAndPlace
from tcs_studies.pick_and_place.task import (
    BASE_RADIUS,
    EDGE,
    EXPERT,
    ITCM_HIGH,
    ITCM_LOW,
    PLACE,
    TABLE_DEPTH,
    TABLE_WIDTH,
    Condition,
)

THESIS_RATIOS = {"tct": 71, "csa": 78, "cst": 34}
"""Increase from ITCM-high to ITCM-low in the thesis [%] (abstract and section V)."""
PANELS = {
    "figure-9": (("tct",), "Completion time, as in the thesis's Figure 9."),
    "figure-11": (("csa", "cst"), "Steering, as in Figure 11."),
    "figure-54": (
        ("csa", "cst", "csa_rate", "cst_rate"),
        "Steering, also by time, as in Figure 54.",
    ),
    "figure-55": (("sal",), "Spectral arc length, as in Figure 55."),
    "figure-57": (("approach", "transfer", "retreat"), "Time by segment, as in Figure 57."),
    "figure-58": (("actions",), "Gripper actions of a repetition, as in Figure 58."),
}
"""Measures and caption of each picture of participants."""
HOW_TO_READ = (
    " Grey dot: a repetition; coloured dot: mean of an operator; line: one operator; large dot: "
    "mean of these means with its 95 % confidence interval. Bars: paired t tests (n.s., * p < "
    f"0.05, ** p < 0.01, *** p < 0.001). {SCRIPTED[0].upper()}{SCRIPTED[1:]}."
)


Figures = Mapping[str, tuple[Figure, str]]
"""Pictures and their captions, by the number of the thesis's figure."""


def pick_and_place_page(
    result: PickAndPlace, drawn: Figures, *, seconds: float, command: str
) -> Page:
    """Return the experiment as a page.

    Args:
        result: The experiment.
        drawn: Its pictures, from `figures`.
        seconds: Wall-clock time of the experiment [s].
        command: Command that repeats it.
    """
    plan = result.plan
    pictures = {name: _picture(name, *one) for name, one in drawn.items()}

    def shown(*names: str) -> list[Block]:
        return [pictures[name] for name in names]

    return Page(
        title="Pick and place by teleoperation from several base poses",
        lead=(
            f"{plan.operators} {SCRIPTED}, pick and place a cup with TIAGo, from each base pose "
            f"{plan.repetitions} times after {plan.practice} repetitions of training: the "
            "experiment of the ITCM thesis."
        ),
        sections=[
            Section("Findings", [Bullets(findings(result))]),
            Section("Time and steering", [table_2(result), *shown("figure-9", "figure-11")]),
            Section(
                "Segments and effort",
                [
                    segments_table(result),
                    *shown("figure-54", "figure-55", "figure-57", "figure-58"),
                ],
            ),
            Section("Paths", shown("figure-51", "figure-52")),
            Section("Learning", [learning_table(result), *shown("figure-53")]),
            Section("Failures and normality", [failures_table(result), normality_table(result)]),
            Section("Operators and view", _operators(result)),
            Section("Reproduction", _made(result, seconds, command)),
        ],
        foot=f"tcs {versions()[0][1]}, {today()}, seed {plan.seed}; {SCRIPTED}.",
    )


def findings(result: PickAndPlace) -> list[str]:
    """Return the main findings, one sentence each."""
    sentences = [
        f"The operators are {SCRIPTED}: the results show the effect of a base pose on one "
        "behaviour. Nobody reports a difficulty or a workload, so the thesis's Figures 10 and 56 "
        "are left out.",
    ]
    names = {condition.name for condition in result.plan.conditions}
    tests = compared(result)
    for measure, theirs in THESIS_RATIOS.items():
        for first, second in PAIRS:
            if not {first, second} <= names:
                continue
            one, other = (np.nanmean(result.sample(name, measure)) for name in (first, second))
            pairs = tests[measure].post_hoc if measure in tests else ()
            test = next((t for t in pairs if (t.first, t.second) == (first, second)), None)
            thesis = f"+{theirs} %" if first == ITCM_LOW.name else "no difference"
            sentences.append(
                f"{PICK_AND_PLACE[measure]}: {mean_std(result, first, measure)} from {first}, "
                f"{mean_std(result, second, measure)} from {second}, "
                f"{100.0 * (one / other - 1.0):+.0f} % (thesis: {thesis})"
                + ("." if test is None else f"; p {p_value(test.p)}, r {test.effect:.2f}.")
            )
    return sentences


def figures(result: PickAndPlace) -> Figures:
    """Return the pictures and their captions, by the number of the thesis's figure."""
    names = [condition.name for condition in result.plan.conditions]
    found: dict[str, tuple[Figure, str]] = {
        name: (draw_participants([_panel(result, m) for m in measures], names), text + HOW_TO_READ)
        for name, (measures, text) in PANELS.items()
    }
    groups = [_group(result, condition) for condition in result.plan.conditions]
    found["figure-51"] = (
        draw_paths(groups, BASE_RADIUS),
        "Paths of the gripper from above in the frame of the base, as in the thesis's Figure 51; "
        "a shade of grey for each operator, a star at each start.",
    )
    found["figure-52"] = (
        draw_distances(groups),
        "Distance between gripper and place, as in the thesis's Figure 52.",
    )
    found["figure-53"] = (
        draw_learning(_learning_parts(result)),
        "Completion time from repetition to repetition, as in the thesis's Figure 53. Black: mean "
        "of the operators; dashed: learning curve.",
    )
    return found


def _panel(result: PickAndPlace, measure: str) -> ParticipantPanel:
    names = [condition.name for condition in result.plan.conditions]
    found = compared(result).get(measure)
    tests = [
        (names.index(one.first), names.index(one.second), one.p)
        for one in (() if found is None else found.post_hoc)
        if (one.first, one.second) in PAIRS
    ]
    values = [
        [
            np.array([getattr(done, measure) for done in operator.recorded[name].successes])
            for operator in result.operators
        ]
        for name in names
    ]
    return ParticipantPanel(PICK_AND_PLACE[measure], values, tests)


def _group(result: PickAndPlace, condition: Condition) -> RepetitionGroup:
    middle, half = 0.5 * PLACE[1], 0.5 * TABLE_WIDTH
    corners = [
        condition.in_base(x, middle + y)
        for x, y in (
            (-EDGE, -half), (-EDGE, half), (TABLE_DEPTH - EDGE, half), (TABLE_DEPTH - EDGE, -half),
        )
    ]  # fmt: skip
    return RepetitionGroup(
        condition.name,
        [operator.recorded[condition.name].paths for operator in result.operators],
        np.array(corners),
        np.stack([condition.cup, condition.place]),
    )


def _learning_parts(result: PickAndPlace) -> list[LearningPart]:
    parts = [_learning("familiarisation", 3, [one.familiarisation for one in result.operators])]
    for i, condition in enumerate(result.plan.conditions):
        name = condition.name
        parts.append(
            _learning(f"{name}, training", i, [one.training[name] for one in result.operators])
        )
        parts.append(_learning(name, i, [one.recorded[name] for one in result.operators]))
    return parts


def _learning(name: str, series: int, parts: list[Part]) -> LearningPart:
    times: list[FloatArray] = [np.array([one.tct for one in part.successes]) for part in parts]
    curve = learning_curve(tuple(parts))
    return LearningPart(name, series, times, None if curve is None else (curve.a, curve.b, curve.c))


def _picture(name: str, figure: Figure, caption: str) -> Picture:
    return Picture(as_svg(figure, f"pick-and-place-{name}"), "svg", caption, caption)


def _operators(result: PickAndPlace) -> list[Block]:
    rows = []
    for field in fields(Traits):
        values = [getattr(one.traits, field.name) for one in result.operators]
        here = number(values[0])
        if len({*values}) > 1:
            here = f"{number(min(values))} to {number(max(values))}"
        default = number(getattr(Traits(), field.name))
        rows.append([field.name.replace("_", " "), default, here])
    views = [
        [
            name,
            f"{np.degrees(setting.camera.angle):.0f}",
            f"{np.degrees(setting.camera.tilt):.0f}",
        ]
        for name, setting in result.settings.items()
    ]
    return [
        Text(
            "Operators see motions in the frame of the camera and command in that of the base. "
            "They learn the angle between the two only in part; what they have not learnt "
            "misdirects the hand."
        ),
        Table(
            "View of the head camera, from the frame of the master.",
            [Column("base pose", False), Column("angle [deg]"), Column("pitch [deg]")],
            views,
        ),
        Table(
            f"Traits of the operators, in m, s and rad; {SCRIPTED}. The values are ours and not "
            "fitted to any result.",
            [Column("trait", False), Column("default"), Column("here")],
            rows,
        ),
    ]


def _made(result: PickAndPlace, seconds: float, command: str) -> list[Block]:
    plan = result.plan
    poses = "; ".join(
        f"{one.name} {one.x:g}, {one.y:g} m, {one.yaw_deg:g} deg" for one in plan.conditions
    )
    return [
        Code(command),
        Facts(
            [
                *versions(),
                *machine(),
                ("Seed", str(plan.seed)),
                ("Time", f"{seconds:.0f} s"),
                ("Task in the base", poses),
                ("Control of the slave", plan.control.value),
                ("Latency", plan.coupling.latency.summary or "none"),
                ("Scale", f"{plan.coupling.scale:g}"),
                (
                    "Thesis",
                    "Inverse Telemanipulation Capability Map: chapters III and IV, Appendices E "
                    f"and F; {EXPERT.name}, {ITCM_HIGH.name} and {ITCM_LOW.name} of Table 1",
                ),
            ]
        ),
    ]
