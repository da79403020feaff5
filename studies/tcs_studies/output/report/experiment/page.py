"""The page of the experiment with the teleoperated arm: the paper's Tables II and III."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from tcs.output.report.blocks import (
    Block,
    Bullets,
    Code,
    Collapsible,
    Column,
    Facts,
    Page,
    Section,
    Table,
    Text,
)
from tcs.output.report.machine import machine, today, versions
from tcs.output.words import p_value
from tcs_studies.experiment.comparison import Comparison
from tcs_studies.experiment.maps import ControllerMaps
from tcs_studies.experiment.trial import END_EFFECTOR, NOVEL
from tcs_studies.experiment.within_subject import (
    SCRIPTED,
    Experiment,
    ExperimentPlan,
    median_ratio,
)
from tcs_studies.operators import OperatorTraits
from tcs_studies.output.report.experiment.pictures import box_pictures, paths_picture, work_blocks
from tcs_studies.output.report.experiment.tables import (
    PAPER,
    group_table,
    learning_table,
    maps_blocks,
    median_of,
    motion_tables,
    number,
    signed_rank_table,
    title_of,
    trials_table,
)
from tcs_studies.output.words import NAMES

_STEERING = (
    "Steering is the motion of the hand that moves the tool. This hand pauses while the other one "
    "moves the joint group, and pauses increase the spectral arc length. Operators rotate the hand "
    "only in recovery motions, which the novel controller does not need."
)


def experiment_page(
    experiment: Experiment, maps: ControllerMaps | None = None, *, seconds: float, command: str
) -> Page:
    """Return the experiment as a page.

    Args:
        experiment: The experiment.
        maps: Its capability maps; None if they were not made.
        seconds: Wall-clock time of the experiment [s].
        command: Command that repeats the experiment.
    """
    plan, arm, comparison = experiment.plan, experiment.arm, experiment.comparison()
    return Page(
        title="Following a line that requires null-space motion",
        lead=(
            f"{plan.operators} {SCRIPTED}, move {arm.robot.title} along a straight line on which "
            f"joint {experiment.course.blocking + 1} meets its limit after three quarters of the "
            f"length, in {plan.trials} trials with each controller after {plan.training} training "
            f"trials.{_latency(plan)}"
        ),
        sections=[
            Section("Findings", [Bullets(findings(experiment))]),
            Section("Accuracy, time, effort", _compared(comparison)),
            Section("Paths of the tool", _paths(experiment)),
            Section("Work over time", work_blocks(experiment)),
            Section("Motion of the hand", [*motion_tables(comparison), Text(_STEERING)]),
            Section("Trials", [trials_table(comparison), learning_table(comparison)]),
            *([] if maps is None else [Section("Capability maps", maps_blocks(experiment, maps))]),
            Section("Operators", _operators(experiment)),
            Section("Reproduction", _made(experiment, seconds, command)),
        ],
        foot=f"tcs {versions()[0][1]}, {today()}, seed {plan.seed}; {SCRIPTED}.",
    )


def findings(experiment: Experiment) -> list[str]:
    """Return the main findings, one sentence each."""
    tests = experiment.tested()
    sentences = [
        f"The operators are {SCRIPTED}: the results show the effect of the controllers on one "
        "behaviour, not their acceptance by people."
    ]
    for name, test in tests.items():
        ratio = median_ratio(experiment, name)
        theirs = PAPER[name][1] / PAPER[name][0]
        there, here = (median_of(experiment, one, name) for one in (END_EFFECTOR.name, NOVEL.name))
        sentences.append(
            f"{NAMES[name]}: median {there} with end-effector control, {here} with the novel "
            f"controller, ratio {ratio:.2f} (paper: {theirs:.2f}); signed rank p "
            f"{p_value(test.p)}, r {test.effect:+.2f}."
        )
    for name in experiment.drives:
        finished = float(experiment.sample(name, "finished").mean())
        if finished < 1.0:
            sentences.append(
                f"With {title_of(experiment, name)} {100 * finished:.0f} % of the trials reached "
                f"the end within {experiment.plan.time_limit:g} s; the others count with that "
                "time, and with the planes that they crossed."
            )
    return sentences


def _compared(comparison: Comparison) -> list[Block]:
    return [group_table(comparison), signed_rank_table(comparison), *box_pictures(comparison)]


def _paths(experiment: Experiment) -> list[Block]:
    paths = {
        name: [path for drive in drives for path in drive.paths]
        for name, drives in experiment.drives.items()
    }
    return [paths_picture(experiment.comparison(), paths, experiment.course.line)]


def _operators(experiment: Experiment) -> list[Block]:
    rows = []
    for field in fields(OperatorTraits):
        values = [getattr(one, field.name) for one in experiment.traits]
        rows.append(
            [
                field.name.replace("_", " "),
                number(getattr(OperatorTraits(), field.name)),
                number(values[0])
                if len({*values}) == 1
                else f"{number(min(values))} to {number(max(values))}",
            ]
        )
    return [
        Text(
            "Each operator behaves in the same way with all controllers: it pursues the line with "
            "a delay and a tremor, pauses when the arm stops, tries a recovery motion, and if that "
            "does not help, another and larger one. The recovery motions depend on the controller: "
            "motions of the hand in a random direction with a random rotation, or joint group 1 in "
            "either direction. A successful recovery is remembered and tried first the next time."
        ),
        Table(
            f"Parameters of the operators, in m, s and rad; {SCRIPTED}. The values are ours and "
            "not fitted to any result.",
            [Column("parameter", False), Column("default"), Column("here")],
            rows,
        ),
    ]


def _made(experiment: Experiment, seconds: float, command: str) -> list[Block]:
    course, plan = experiment.course, experiment.plan
    turns = np.degrees(course.turns)
    settings = [
        f"{condition.title}: mode {condition.mode.value}, at limits {condition.settings.limits}"
        for condition in plan.conditions
    ]
    return [
        Code(command),
        Facts(
            [
                *versions(),
                *machine(),
                ("Seed", str(plan.seed)),
                ("Time", f"{seconds:.0f} s"),
                (
                    "Line",
                    f"{_place(course.line.start)} to {_place(course.line.end)}, in the base frame",
                ),
                ("Length", f"{course.line.length:.3f} m"),
                ("Start posture", ", ".join(f"{q:.4f}" for q in course.joints) + " rad"),
                (
                    "Rotations of joint 1 that allow the motion",
                    f"{turns[0]:.0f} to {turns[-1]:.0f} deg, found without noise in steps of 10",
                ),
                ("Controllers", "; ".join(settings)),
                ("Paper", "N. S. Hoeba, VR mediated teleoperation, Delft: Tables II and III"),
            ]
        ),
        Collapsible(
            "Differences from the paper",
            [
                Bullets(
                    [
                        "There are no people, so there are no questionnaires and no preferences.",
                        "The line is found by a search; the paper gives no coordinates.",
                        "There is a third controller, which uses the redundancy automatically.",
                        "Contacts are not checked during trials, as in the paper; the motion that "
                        "the search found does not touch the robot's own body.",
                    ]
                )
            ],
        ),
    ]


def _latency(plan: ExperimentPlan) -> str:
    """Return the latency as a sentence, empty if there is none."""
    summary = plan.latency.summary
    return f" Latency between operator and arm: {summary}." if summary else ""


def _place(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in point) + ") m"
