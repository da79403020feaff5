"""The page of a study with people: Tables II to IV, Figures 8 and 9 of the null-space paper."""

from __future__ import annotations

from tcs.output.report.blocks import Block, Bullets, Code, Facts, Page, Section, Text
from tcs.output.report.machine import today, versions
from tcs.output.words import p_value, percent
from tcs_studies.experiment.comparison import LEAST
from tcs_studies.output.report.experiment.pictures import box_pictures, paths_picture
from tcs_studies.output.report.experiment.tables import (
    compared_pairs,
    group_table,
    learning_table,
    motion_tables,
    number,
    signed_rank_table,
    trials_table,
)
from tcs_studies.output.report.study.tables import (
    acceptance_pictures,
    comments_table,
    difficulty_table,
    participants_table,
    preference_table,
    scores_table,
)
from tcs_studies.output.words import NAMES, SCALE
from tcs_studies.study.results import StudyResults


def study_page(results: StudyResults, *, command: str) -> Page:
    """Return the results of a study as a page.

    Args:
        results: The results.
        command: Command that makes the page.
    """
    study, comparison = results.study, results.comparison
    plan = study.plan
    return Page(
        title=plan.title,
        lead=(
            f"{comparison.operators[0].upper()}{comparison.operators[1:]}, of {plan.participants} "
            f"planned, moved the tool of {plan.robot} along a straight line: {plan.trials} trials "
            f"with each condition after {plan.training} training trials, then questionnaires."
        ),
        sections=[
            Section("Findings", [Bullets(findings(results))]),
            Section("Participants", _people(results)),
            Section("Accuracy, time, effort, acceptance", _compared(results)),
            Section("Preference", [preference_table(results)]),
            *_workload(results),
            Section("Motion of the hand", list(motion_tables(comparison))),
            Section("Paths of the tool", _paths(results)),
            Section("Trials", [trials_table(comparison), learning_table(comparison)]),
            Section("Comments", [comments_table(results)]),
            Section("Reproduction", _made(results, command)),
        ],
        foot=f"tcs {versions()[0][1]}, {today()}; {comparison.operators}.",
    )


def findings(results: StudyResults) -> list[str]:
    """Return the tests of the null-space paper and the preferences, one sentence each."""
    comparison = results.comparison
    sentences = []
    if len(results.included) < LEAST:
        sentences.append(f"Tests need {LEAST} participants; a dash stands for what is undefined.")
    for name in comparison.hypotheses:
        for first, second in compared_pairs(comparison):
            test = comparison.compared(name, first, second)
            if test is None:
                continue
            scale = SCALE.get(name, 1.0)
            both = [
                f"{number(scale * described.median)} with {comparison.titles[condition]}"
                for condition in (first, second)
                if (described := comparison.described(condition, name)) is not None
            ]
            sentences.append(
                f"{NAMES[name]}: median {', '.join(both)}; signed rank p {p_value(test.p)}, r "
                f"{test.effect:+.2f}, N {test.count}."
            )
    for condition, title in comparison.titles.items():
        finished = comparison.sample(condition, "finished")
        if len(finished) and finished.mean() < 1.0:
            sentences.append(
                f"With {title} {percent(finished.mean(), 0)} % of the trials reached the end "
                f"within {results.study.plan.time_limit:g} s; the others count with that time, and "
                "with the planes that they crossed."
            )
    counts = results.preferred()
    total = sum(counts.values())
    for name, title in comparison.titles.items():
        if total:
            sentences.append(f"{counts[name]} of {total} participants prefer {title}.")
    return sentences


def _people(results: StudyResults) -> list[Block]:
    ages = results.ages()
    blocks: list[Block] = [participants_table(results)]
    if len(ages):
        std = f", standard deviation {ages.std(ddof=1):.2f}" if len(ages) > 1 else ""
        blocks.append(
            Text(
                f"Age of {len(ages)} included participants: {ages.min():.0f} to {ages.max():.0f} "
                f"years, mean {ages.mean():.2f}{std}."
            )
        )
    if results.notes:
        blocks.append(Bullets(results.notes))
    return blocks


def _compared(results: StudyResults) -> list[Block]:
    comparison = results.comparison
    return [
        group_table(comparison),
        signed_rank_table(comparison),
        *box_pictures(comparison),
        *acceptance_pictures(results),
    ]


def _workload(results: StudyResults) -> list[Section]:
    """Return the sections of the thesis's questionnaires that were taken."""
    sections, values = [], results.comparison.values
    if "workload" in values:
        table = scores_table(
            results, "workload", "Weighted workload [0 to 100], as in the thesis's Figure 56"
        )
        sections.append(Section("Workload", [table]))
    if "difficulty" in values:
        table = scores_table(results, "difficulty", "Agreement of each participant, 1 to 5")
        sections.append(Section("Difficulty", [difficulty_table(results), table]))
    return sections


def _paths(results: StudyResults) -> list[Block]:
    study = results.study
    paths = {
        name: [
            trial.path
            for trial in results.trials
            if trial.step.condition == name and not trial.step.training
        ]
        for name in study.conditions
    }
    if not any(paths.values()):
        return [Text("No evaluated trial has a run.")]
    return [paths_picture(results.comparison, paths, study.line)]


def _made(results: StudyResults, command: str) -> list[Block]:
    plan, line = results.study.plan, results.study.line
    conditions = [
        f"{one.title}: {'given as run files' if one.limits is None else f'at limits {one.limits}'}"
        for one in plan.conditions
    ]
    ends = [", ".join(f"{value:.3f}" for value in point) for point in (line.start, line.end)]
    return [
        Code(command),
        Facts(
            [
                *versions(),
                ("Robot", f"{plan.robot}, torso at {plan.torso_height:g} m"),
                ("Line", f"({ends[0]}) to ({ends[1]}) m, in the base frame"),
                ("Length", f"{line.length:.3f} m"),
                ("Time limit", f"{plan.time_limit:g} s"),
                ("Conditions", "; ".join(conditions)),
                ("Pairs of NASA-TLX", plan.tlx_weights),
                ("Papers", "N. S. Hoeba, VR mediated teleoperation, Delft; ITCM thesis, Delft"),
            ]
        ),
    ]
