"""Pictures of the experiment with the teleoperated arm, of people and of scripted operators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.output.draw import as_svg
from tcs.output.report.blocks import Picture
from tcs.teleop.line import Line
from tcs_studies.experiment.comparison import Comparison
from tcs_studies.experiment.course import BLOCKED_AFTER
from tcs_studies.output.draw.boxes import BoxGroup, BoxPlot, draw_boxes
from tcs_studies.output.draw.tool_paths import PathGroup, draw_tool_paths
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
