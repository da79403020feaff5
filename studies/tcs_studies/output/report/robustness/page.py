"""Robustness report: results of tcs compared with Tables I and III of the TCS paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from joblib import Parallel, delayed

from tcs.output.draw import as_png, as_svg
from tcs.output.report.blocks import (
    Block,
    Code,
    Collapsible,
    Facts,
    Page,
    Picture,
    Section,
    Text,
)
from tcs.output.report.machine import machine, today, versions
from tcs.output.report.score.pictures import map_figure, scene_figure
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.words import percent
from tcs.placement.store import load_scores
from tcs_studies.output.draw.boxes import BoxGroup, BoxPlot, Cloud, draw_boxes, draw_clouds
from tcs_studies.output.report.robustness.paper import Paper
from tcs_studies.output.report.robustness.tables import (
    configurations,
    contrasts_table,
    findings,
    gain_table,
    is_short,
    losses_table,
    prediction_table,
    table_1,
    table_3,
)
from tcs_studies.output.words import lost_goal, mean_and_std
from tcs_studies.robustness.study import RowStudy, StudyPlan

SERIES = ("best set, by P_R + P_M", "best single configuration", "most robust set, by success")
METHODS = ("with TC-manipulability", "", "without")


def robustness_page(
    rows: Sequence[RowStudy],
    pictures: Sequence[RowPictures],
    paper: Paper,
    plan: StudyPlan,
    *,
    seconds: float,
    command: str,
) -> Page:
    """Return the report as a page.

    Args:
        rows: Results of each row, in the order of the page.
        pictures: Pictures of each row.
        paper: The paper's figures.
        plan: Sample sizes of the study.
        seconds: Wall-clock time of the study [s].
        command: Command that makes the report.
    """
    compared = [row for row in rows if row.methods is not None]
    sections = [
        Section("Findings", findings(rows, paper)),
        Section("Table I: success under error", _table_1(rows, paper)),
    ]
    if compared:
        sections.append(
            Section(
                "Table III: TC-manipulability, one and two configurations",
                _table_3(compared, paper),
            )
        )
    if any(row.gains for row in rows):
        sections.append(Section("Gain of selecting by success", _gains(rows)))
    sections += [
        Section("How well P_M predicts success", _prediction(rows)),
        Section("Lost goals", _losses(rows, paper)),
        Section("Selected configurations", _chosen(rows, pictures)),
        Section("Reproduction", _made(rows, paper, plan, seconds, command)),
    ]
    robots = ", ".join(sorted({row.titles[2] for row in rows}))
    return Page(
        title="Robustness to errors of the environment",
        lead=(
            f"{len(rows)} tasks from the TCS paper with {robots}. In each of {plan.samples:,} "
            "samples the person and the wheelchair are displaced from their assumed poses (Table "
            "II of the paper). The robot takes the selected configurations, and the goals that "
            "its arm still reaches are counted."
        ),
        sections=sections,
        foot=f"tcs {versions()[0][1]}, {today()}, seed {plan.seed}, {plan.samples:,} samples.",
    )


def _table_1(rows: Sequence[RowStudy], paper: Paper) -> list[Block]:
    groups = []
    for row in rows:
        published = paper.published(row.task, row.environment)
        theirs = (published.mean, published.std) if published else None
        boxes = [
            BoxPlot(1, 100.0 * row.single.fractions),
            BoxPlot(0, 100.0 * row.best.fractions, theirs),
        ]
        if row.gain is not None:
            boxes.append(BoxPlot(2, 100.0 * row.gain.robust.fractions))
        groups.append(BoxGroup(row.name, boxes))
    figure = draw_boxes(groups, SERIES, label="goals reached [%]", reference="paper, Table I")
    return [
        table_1(rows, paper),
        Picture(
            as_svg(figure, "table-1"),
            "svg",
            "Box plots of the percentage of goals reached, for each row of Table I the best "
            "single configuration, the best set, and the most robust set.",
            "Box: first to third quartile; line: median; whiskers: 5th and 95th percentile; dot: "
            "mean; rings: samples beyond the whiskers. Diamond with a line: the paper's mean plus "
            "and minus one standard deviation, up to 100 %.",
        ),
    ]


def _table_3(rows: Sequence[RowStudy], paper: Paper) -> list[Block]:
    groups = []
    for row in rows:
        for members in (1, 2):
            published = paper.compared(row.task, row.environment, members)
            cells = row.methods.paired if row.methods else {}
            boxes = [
                BoxPlot(series, 100.0 * cells[members, is_with].fractions, theirs)
                for series, is_with, theirs in (
                    (2, False, published.without if published else None),
                    (0, True, published.with_ if published else None),
                )
                if (members, is_with) in cells
            ]
            if boxes:
                groups.append(BoxGroup(f"{row.name}\n{configurations(members)}", boxes))
    figure = draw_boxes(groups, METHODS, label="goals reached [%]", reference="paper, Table III")
    return [
        table_3(rows, paper),
        Picture(
            as_svg(figure, "table-3"),
            "svg",
            "Box plots of the percentage of goals reached with one and with two configurations, "
            "with and without TC-manipulability.",
            "Symbols as above. Both methods are evaluated on the same samples.",
        ),
        Collapsible("All comparisons", [contrasts_table(rows)]),
    ]


def _gains(rows: Sequence[RowStudy]) -> list[Block]:
    return [
        Text(
            "P_R and P_M are computed without errors of the environment. Success under error can "
            "be estimated for each set instead (tcs robustify). The most robust set is the one "
            "with the greatest lower confidence bound (95 %) on its success."
        ),
        gain_table(rows),
    ]


def _prediction(rows: Sequence[RowStudy]) -> list[Block]:
    clouds = [
        Cloud(
            f"{row.task.replace('_', ' ')}\n{row.environment}",
            [
                (one.manipulability, 100.0 * one.success)
                for one in row.predictions
                if one.equal_reach
            ],
            (row.best.manipulability, 100.0 * row.best.summary.mean),
        )
        for row in rows
    ]
    figure = draw_clouds(
        clouds,
        ("sets of one", "sets of two"),
        x_label="P_M without error",
        y_label="mean of goals reached [%]",
    )
    return [
        prediction_table(rows),
        Picture(
            as_svg(figure, "prediction"),
            "svg",
            "Scatter plots of sets for each row: success under error over P_M without error.",
            "Dots: random sets with P_R of at least 0.98 of the greatest. Diamond: the best set, "
            "on all samples. Each panel has its own axes.",
        ),
    ]


def _losses(rows: Sequence[RowStudy], paper: Paper) -> list[Block]:
    blocks: list[Block] = [
        Text(
            "The goals that the best set does not reach in every sample: the percentage of "
            "samples in which they are reached, the stop from which they are reached most often, "
            "and the reasons why the arm fails there in the other samples. The ceiling is an "
            "upper bound on the mean of every set that leaves the environment (such as the bed) "
            "in the same states: at the other goals the gripper touches the environment, for "
            "every base pose. The last column names the joint error that is largest on average in "
            "the failed samples, in standard deviations."
        )
    ]
    lossless = [row.name for row in rows if not row.losses.goals]
    for row in sorted(rows, key=lambda row: row.best.summary.mean):
        if not row.losses.goals:
            continue
        if is_short(row, paper):
            blocks += [Text(f"Below the paper: {_reading(row)}"), losses_table(row)]
        else:
            blocks.append(Collapsible(row.name, [losses_table(row)]))
    if lossless:
        blocks.append(Text(f"Every goal is reached in every sample: {'; '.join(lossless)}."))
    return blocks


def _reading(row: RowStudy) -> str:
    """Return the main cause of a mean below the paper's."""
    weights = row.best.weights
    lost = sum((1.0 - loss.success) * weights[loss.goal] for loss in row.losses.goals)
    worst = row.losses.goals[0]
    fraction = (1.0 - worst.success) * weights[worst.goal] / lost
    text = (
        f"{row.name}. Goal {worst.goal + 1} accounts for {percent(fraction, 0)} % of the losses. "
    )
    text += lost_goal(worst)
    if row.gain is not None and row.gain.paired.mean > 0.0:
        robust = row.gain.robust
        text += (
            f" The most robust set reaches {mean_and_std(robust)} % with a P_M that is lower by "
            f"{row.best.manipulability - robust.manipulability:.3f}."
        )
    return text


def _chosen(rows: Sequence[RowStudy], pictures: Sequence[RowPictures]) -> list[Block]:
    blocks: list[Block] = []
    for row, drawn in zip(rows, pictures, strict=True):
        words = "; ".join(
            f"stop {i + 1}: " + ", ".join(f"{name} {value:g}" for name, value in member.items())
            for i, member in enumerate(row.best.members)
        )
        blocks += [
            Picture(
                drawn.scene,
                "png",
                f"The robot at each base pose of the best set for {row.name}.",
                f"{row.titles[0]} – {row.titles[1]}. P_R {row.best.reachability:.2f}, P_M "
                f"{row.best.manipulability:.3f}; under error {mean_and_std(row.best)} %. {words}.",
            ),
            Collapsible(
                f"{row.name}: map",
                [Picture(drawn.map, "png", f"Map of {row.name} with the best set.", row.name)],
            ),
        ]
    return blocks


def _made(
    rows: Sequence[RowStudy], paper: Paper, plan: StudyPlan, seconds: float, command: str
) -> list[Block]:
    cpu = sum(row.cpu_seconds for row in rows)
    slowest = max(rows, key=lambda row: row.best.seconds)
    scores = [
        (
            row.name,
            f"scored by tcs {row.made_by['version']} on {row.made_by['created']}, measure "
            f"{row.made_by['measure']}, scene {row.made_by['scene'][:12]}, SHA-256 of the file "
            f"{row.made_by['sha256'][:16]}; errors on {', '.join(row.best.errors.errors)}",
        )
        for row in rows
    ]
    return [
        Code(command),
        Facts(
            [
                *versions(),
                *machine(),
                ("Seed", str(plan.seed)),
                ("Samples", f"{plan.samples:,} of each method, the same for all methods"),
                (
                    "Sets for the correlations",
                    f"{plan.sets} of each class, {plan.set_samples} samples",
                ),
                ("Time", f"{seconds:.0f} s, {cpu:.0f} s of processor time"),
                (
                    "Slowest row",
                    f"{slowest.name}, {slowest.best.samples:,} samples of the best set in "
                    f"{slowest.best.seconds:.1f} s",
                ),
                ("Paper", paper.source),
            ]
        ),
        Text(
            "As in the paper, the initial configurations are not adapted to the errors; a goal "
            "counts as reached if any member of the set has a collision-free solution; collisions "
            "of the base are not checked again; on the bed the person is at the nominal position "
            "(shift 0)."
        ),
        Collapsible("Score files", [Facts(scores)]),
    ]


@dataclass(frozen=True, slots=True)
class RowPictures:
    """Two pictures of the best set of a row."""

    map: bytes
    """From above, PNG."""
    scene: bytes
    """The robot at each base pose, PNG."""


def draw_row(path: Path) -> RowPictures:
    """Return the pictures of the best set of a score file.

    Args:
        path: Path of the score file.

    Raises:
        StoreError: If the file cannot be used, or was made from other models.
    """
    file = load_scores(path)
    shown = ShownSet.best_of(file)
    return RowPictures(as_png(map_figure(file, shown)), as_png(scene_figure(file, shown)))


def draw_rows(paths: Sequence[Path], *, jobs: int = 2) -> tuple[RowPictures, ...]:
    """Return the pictures of several score files, in their order.

    Args:
        paths: Paths of the score files.
        jobs: Number of processes; the result does not depend on it.

    Raises:
        StoreError: As `draw_row`.
    """
    return tuple(Parallel(n_jobs=min(jobs, len(paths)))(delayed(draw_row)(path) for path in paths))
