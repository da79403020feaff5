"""Draw the pictures of docs/people.md: people in the wheelchair, from the side and from above.

python scripts/people.py --out docs/images/people.png
python scripts/people.py --postures --out docs/images/postures.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from tcs.files.writing import whole_file
from tcs.kernel.arrays import BOX, Shapes
from tcs.model.people import load_person
from tcs.model.scene import environment_shapes, load_environment, with_person
from tcs.output.draw import as_png
from tcs.output.words import person_text

PEOPLE = (
    {"sex": "female", "stature_percentile": 5, "mass_percentile": 5},
    None,
    {"sex": "male", "stature_percentile": 95, "mass_percentile": 95},
)
POSTURES = (
    {"posture": "arm_lifted_left"},
    {"posture": "head_leaning_left"},
    {"posture": "contracture"},
    {"sex": "female", "stature_percentile": 5, "posture": {"trunk_flexion_deg": 20}},
)
VIEWS = ((0, 2), (0, 1))
"""Axes of W that are drawn: from the side and from above."""
_BALL = Rotation.random(400, rng=0).apply([0.0, 0.0, 1.0])
"""Points of a unit sphere, for the caps of capsules."""
_CORNERS = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/images/people.png"))
    parser.add_argument("--postures", action="store_true", help="postures instead of sizes")
    options = parser.parse_args()
    out, people = options.out, POSTURES if options.postures else PEOPLE
    chair = load_environment("wheelchair").model_copy(update={"floor": False})
    alone = {"models": chair.models[:1], "body_frames": {}, "padding": {}, "errors": {}}
    furniture = len(environment_shapes(chair.model_copy(update=alone)).type)
    figure = Figure(figsize=(3.0 * len(people), 5.0), layout="constrained")
    rows = figure.subplots(2, len(people), sharex=True, sharey="row", height_ratios=(2, 1))
    for column, person in enumerate(people):
        environment = chair if person is None else with_person(chair, person)
        shapes = environment_shapes(environment)
        for row, view in enumerate(VIEWS):
            _draw(rows[row, column], shapes, furniture, view)
        title = "the papers' average man"
        if person is not None:
            title = person_text(load_person(person).to_json()).replace(" and", "\nand")
            title = title.partition(" (head lean")[0].partition(" (shoulder")[0]
            title = title.replace(", ", ",\n")
        rows[0, column].set_title(title, fontsize=9)
    for axes, label in ((rows[0, 0], "z [m]"), (rows[1, 0], "y [m]")):
        axes.set_ylabel(label)
    for axes in rows[1]:
        axes.set_xlabel("x [m]")
        axes.xaxis.set_major_locator(MaxNLocator(3))
    with whole_file(out, "Picture") as file:
        file.write(as_png(figure, 90))


def _draw(axes: Axes, shapes: Shapes, furniture: int, view: tuple[int, int]) -> None:
    """Draw the outlines of all shapes; those after the first `furniture` are the person's."""
    for i in range(len(shapes.type)):
        size, R, p = shapes.size[i], shapes.R[0, i], shapes.p[0, i]
        if shapes.type[i] == BOX:
            points = _CORNERS * size
        else:
            points = np.concatenate([_BALL * size[0] + [0, 0, s * size[1]] for s in (-1, 1)])
        flat = (points @ R.T + p)[:, view]
        outline = flat[ConvexHull(flat).vertices]
        colour = "0.75" if i < furniture else "tab:orange"
        axes.fill(*outline.T, color=colour, alpha=0.35, lw=0.6, ec="0.2")
    axes.set_aspect("equal")


if __name__ == "__main__":
    main()
