"""Make the pictures and the text of docs/gallery.md: Figures 1 and 6 of the TCS paper.

    python scripts/gallery.py --scores out/scores

Score files are read from the folder --scores; missing rows are scored first.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

import tcs
from tcs.files.writing import make_folder, whole_file
from tcs.output import terminal
from tcs.output.draw import as_png
from tcs.output.report.score.pictures import map_figure, member_figure, scene_figure
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.report.score.states import states_figure
from tcs.output.words import member_text
from tcs.placement.scoring import default_path, task_environment_pairs
from tcs.placement.store import ScoreFile
from tcs_studies.robustness.study import check_row

ROBOT = "pr2"
HERE = tcs.InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=math.pi, torso=0.0)
"""Current state of the robot in the map of the README."""
_DPI = 76
"""Of pictures in space: as wide as a page of text."""
_MAP_DPI = 110
LETTERS = {
    ("shaving", "wheelchair"): "a",
    ("feeding", "wheelchair"): "b",
    ("brushing", "wheelchair"): "c",
    ("shaving", "bed"): "d, e",
    ("shaving", "bed-no-wall"): "f",
    ("bathing", "bed"): "g, h",
    ("scratching_upper_arm_left", "bed"): "i",
    ("scratching_upper_arm_right", "bed"): "j",
    ("scratching_forearm_left", "bed"): "k",
    ("scratching_forearm_right", "bed"): "l",
    ("scratching_thigh_left", "bed"): "m",
    ("scratching_thigh_right", "bed"): "n",
    ("scratching_chest", "bed"): "o",
}
"""Panels of Figure 6, as its caption has them."""
INTRODUCTION = """\
# Gallery

Every picture on this page is drawn by tcs from score files, without a display.
`python scripts/gallery.py` scores missing rows and makes the page and its pictures. The robot is
drawn as its collision primitives, which enclose its links. Yellow arrows are the goals and end at
the position of the tool; the red arrow is the goal at which the arm is drawn. `tcs view FILE` shows
the same scenes interactively, and `tcs report FILE --out page.html` describes the results in full.

The person, the furniture, the goals and the grids are those of the TCS paper (Kapusta, Park and
Kemp, IROS 2015), see [the scene](scene.md). Inverse kinematics and collision checks are those of
tcs, with primitives instead of meshes, so base poses differ from the paper's. The pictures show the
set with the greatest P_R + P_M, regardless of travel. The paper shows a second base pose only for
shaving and bathing on the bed: by its printed rule a pair is kept if its P_M is greater than that
of the best single, but its code requires a hundredth more (`tcs score --rules code2015`).
"""


@dataclass(frozen=True)
class GalleryPicture:
    """A picture of the gallery with its text."""

    name: str
    figure: Figure
    dpi: float
    heading: str
    text: str
    alternative: str
    """Alternative text for readers who cannot see the picture."""


def main() -> int:
    """Make the gallery; return the exit code."""
    options = parse()
    return terminal.exit_code_of(lambda: run(options))


def parse() -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scores", type=Path, default=Path("out/scores"), help="score files")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of gallery.md")
    parser.add_argument("--jobs", type=int, default=2, help="number of threads for scoring")
    return parser.parse_args()


def run(options: argparse.Namespace) -> int:
    """Score missing rows, draw the pictures, write the page."""
    images = options.out / "images"
    make_folder(images)
    make_folder(options.scores)
    files = {row: score_file(row, options) for row in task_environment_pairs()}
    text = INTRODUCTION
    drawn = [from_behind(files), *(scene_of(row, files[row]) for row in LETTERS), *maps(files)]
    sizes = []
    for one in drawn:
        content = as_png(one.figure, one.dpi, colours=None if one.dpi == _MAP_DPI else 256)
        write(images / f"{one.name}.png", content)
        sizes.append(len(content))
        text_lines = in_lines(one.text)
        picture = f"![{one.alternative}](images/{one.name}.png)"
        text += f"\n## {one.heading}\n\n{picture}\n\n{text_lines}\n"
    write(options.out / "gallery.md", text.encode())
    print(f"wrote {options.out / 'gallery.md'} and {len(drawn)} pictures, {sum(sizes):,} bytes")
    return 0


def in_lines(text: str) -> str:
    """Return a paragraph in lines of at most 100 characters, with commands unbroken.

    >>> in_lines("x" * 90 + " `tcs list --json`").splitlines()[1]
    '`tcs list --json`'
    """
    kept = re.sub("`[^`]*`", lambda code: code[0].replace(" ", "\0"), text)
    return textwrap.fill(kept, 100, break_on_hyphens=False).replace("\0", " ")


def score_file(row: tuple[str, str], options: argparse.Namespace) -> ScoreFile:
    """Return the score file of a row; a missing row is scored first."""
    path = options.scores / default_path(*row, ROBOT)
    if not path.exists():
        with terminal.progress_bar(f"configurations, {path.stem}") as on_progress:
            scored = tcs.score(
                *row,
                ROBOT,
                paper=True,
                jobs=options.jobs,
                on_progress=on_progress,
                on_compile=terminal.note_compiling,
            )
        tcs.save(path, scored)
    file = tcs.load(path)
    check_row(path, file, *row, ROBOT)
    return file


def from_behind(files: dict[tuple[str, str], ScoreFile]) -> GalleryPicture:
    """Return the paper's Figure 1: shaving in a bed without a wall, from one place."""
    free, walled = files["shaving", "bed-no-wall"], files["shaving", "bed"]
    shown = ShownSet.best_of(free, single=True)
    alone = free.nominal.sets.scores_of(shown.indices)
    behind = walled.nominal.sets.scores_of(walled.nominal.sets.best_single)
    at = shown.members[0]
    where = "behind the head end of the bed" if at.base_x < 0.0 else "beside the bed"
    rest = "flat" if abs(dict(at.environment)["head_rest"]) < 1e-9 else "raised"
    where_exactly = member_text(at.to_json())
    text = (
        'The paper: "when trying to shave a user in a configurable bed, the robot can reach '
        'shaving poses well from behind the bed with the head rest lying flat". Here, without a '
        f"wall, the best single base pose is {where}, with the head rest {rest} ({where_exactly}); "
        f"from it {alone[0]:.0%} of the goals are reached, P_M {alone[1]:.3f}. With the wall that "
        f"base pose is blocked, and the best single reaches {behind[0]:.0%}, P_M {behind[1]:.3f}."
    )
    return GalleryPicture(
        "gallery-figure-1",
        member_figure(free, shown, 0),
        _DPI,
        "Figure 1: shaving from behind the bed",
        text,
        f"The robot {where}, its arm at the face of a person who lies in bed.",
    )


def scene_of(row: tuple[str, str], file: ScoreFile) -> GalleryPicture:
    """Return a row of Figure 6: the robot at each base pose of the best set."""
    shown = ShownSet.best_of(file)
    sets = file.nominal.sets
    reachability, manipulability = sets.scores_of(tuple(sorted(shown.indices)))
    title = row[0].replace("_", " ").capitalize()
    stops = "; ".join(
        f"stop {i}: {member_text(at.to_json())}" for i, at in enumerate(shown.members, start=1)
    )
    single = sets.scores_of(sets.best_single)
    beside = (
        f" The best single base pose reaches {single[0]:.0%}, P_M {single[1]:.3f}."
        if len(shown.members) > 1
        else ""
    )
    text = (
        f"{reachability:.0%} of the goals, P_M {manipulability:.3f} "
        f"({file.metadata['measure']}); {stops}.{beside}"
    )
    return GalleryPicture(
        f"gallery-{row[0]}-{row[1]}",
        scene_figure(file, shown),
        _DPI,
        f"Figure 6 ({LETTERS[row]}): {title}, {row[1]}",
        text,
        f"The robot at each base pose of the best set for {title.lower()}, its arm at a goal.",
    )


def maps(files: dict[tuple[str, str], ScoreFile]) -> list[GalleryPicture]:
    """Return the maps: the one of the README, and one for each state of the bed."""
    chair, bed = files["shaving", "wheelchair"], files["bathing", "bed"]
    chosen = ShownSet.of(chair, HERE)
    command = "tcs map shaving-wheelchair-pr2.tcs --out map.png --here 1.4 -1.2 180"
    return [
        GalleryPicture(
            "map",
            map_figure(chair, chosen),
            _MAP_DPI,
            "From above",
            f"Shaving in the wheelchair, drawn by `{command}`. Bases are to scale, their arrows "
            "are the headings. The colour of a base position is the greatest score of a single "
            "configuration there; pairs reach more. The colours are distinguishable under colour "
            "vision deficiencies; tests simulate protanopia, deuteranopia and tritanopia.",
            "A wheelchair and the person in it from above, with base positions coloured by score.",
        ),
        GalleryPicture(
            "states",
            states_figure(bed, ShownSet.best_of(bed)),
            _MAP_DPI,
            "For each state of the bed",
            "Bathing, drawn by `tcs map bathing-bed-pr2.tcs --states --out states.png`: bed height "
            "by head rest, in one colour scale. Both stops use the same state and are marked in "
            "its panel."
            if _share_a_state(bed)
            else "Bathing, drawn by `tcs map bathing-bed-pr2.tcs --states --out states.png`: bed "
            "height by head rest, in one colour scale. Each stop is marked in its panel.",
            "Twelve maps of the floor around a bed, one for each bed height and head rest.",
        ),
    ]


def _share_a_state(file: ScoreFile) -> bool:
    return len({at.environment for at in ShownSet.best_of(file).members}) == 1


def write(path: Path, content: bytes) -> None:
    """Write a file, wholly or not at all."""
    with whole_file(path, "Gallery") as stream:
        stream.write(content)


if __name__ == "__main__":
    sys.exit(main())
