"""Fit the collision primitives of a robot, or find the pairs of bodies that need no check.

    python scripts/fit_primitives.py pr2            rewrites the primitives file of its YAML file,
                                                    each body as scripts/fits.yaml says, if it does
    python scripts/fit_primitives.py pr2 --pairs    rewrites disabled_groups, the last YAML entry,
                                                    and keeps groups made by hand
    python scripts/fit_primitives.py tiago base_link=6 ...     fits these bodies again, with up to
                                                    so many shapes, and keeps those of the others;
                                                    with 60+120, adds up to 120 where the first 60
                                                    leave the surface bare
    python scripts/fit_primitives.py tiago --parts  fits the parts of bodies that scripts/fits.yaml
                                                    names again, and keeps all other shapes
    python scripts/fit_primitives.py ur5 --tighten wrist_1_link=20 ...     reduces each shape of
                                                    these bodies to what it alone contains, and
                                                    splits up to so many that protrude most; without
                                                    bodies, those that scripts/fits.yaml names
    python scripts/fit_primitives.py pr2 --split l_elbow_flex_link=6 ...     fits the shapes of
                                                    these bodies to what random boxes can come near,
                                                    in the end up to so many
    python scripts/fit_primitives.py ur5 --distances
                                                    measures the distances of surfaces of pairs of
                                                    bodies with at most three joints between them,
                                                    and writes them beside the primitives; of pairs
                                                    such as forearm_link/wrist_2_link only these,
                                                    and keeps the tables of the others

The results are deterministic. Each command takes a few minutes; pairs depend on the primitives.
The last lines say how many postures the shapes block although the surfaces are free of
self-collision, and of random boxes.
"""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tcs.errors import TcsError
from tcs.files.paths import data_folder
from tcs.model.robots import (
    Primitive,
    RobotFile,
    load_robot,
    read_primitives,
    write_primitives,
)
from tcs.model.robots.distances import read_tables, write_tables
from tcs_shapes.blocked import blocked_at_boxes, blocked_by_shapes
from tcs_shapes.bodies import fit_robot, refit, refit_parts, target_of
from tcs_shapes.bounding import enclose_axis
from tcs_shapes.covering import Part, Target
from tcs_shapes.disabled_pairs import renewed_groups
from tcs_shapes.measured_distances import measured_tables
from tcs_shapes.splitting import split_where_struck
from tcs_shapes.tightening import Spots, tightened

FITS = Path(__file__).parent / "fits.yaml"
"""Bodies of the shipped robots that are not fitted as usual."""
OPTIONS = ("--pairs", "--parts", "--tighten", "--split", "--distances")
_NUMBERS = re.compile(r"([1-9]\d*)(?:\+([1-9]\d*))?")
"""Number of shapes of a body, and of patches."""


def main() -> int:
    """Rewrite primitives or pairs of the robot given on the command line."""
    names = [a for a in sys.argv[1:] if a not in OPTIONS and "=" not in a]
    pairs: list[list[str]] = []
    if "--distances" in sys.argv:
        pairs = [a.split("/") for a in names if a.count("/") == 1 and not a.endswith(".yaml")]
        names = [a for a in names if a.split("/") not in pairs]
    more = [a.split("=") for a in sys.argv[1:] if "=" in a]
    are_numbers = all(len(m) == 2 and _NUMBERS.fullmatch(m[1]) for m in more)
    if {"--tighten", "--split"} & set(sys.argv):
        are_numbers = all(len(m) == 2 and m[1].isdecimal() for m in more)
    if len(names) != 1 or not are_numbers:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        robot = load_robot(names[0])
        if "--pairs" in sys.argv:
            path = Path(names[0])
            if path.suffix != ".yaml":
                path = data_folder() / "models" / "robots" / f"{robot.name}.yaml"
            rewrite_pairs(robot, path)
        elif "--distances" in sys.argv:
            write_distances(robot, pairs)
        elif "--parts" in sys.argv:
            shapes = refit_parts(robot, read_primitives(Path(robot.primitives)), parts_of(robot))
            write_primitives(Path(robot.primitives), shapes)
            print_blocked(robot)
        elif "--tighten" in sys.argv:
            splits = {body: int(text) for body, text in more} or splits_of(robot)
            shapes = read_primitives(Path(robot.primitives))
            shapes = tightened(robot, shapes, splits, spots_of(robot), rounds_of(robot))
            write_primitives(Path(robot.primitives), shapes)
            print_blocked(robot)
        elif "--split" in sys.argv:
            most = {body: int(text) for body, text in more}
            shapes = split_where_struck(robot, read_primitives(Path(robot.primitives)), most)
            write_primitives(Path(robot.primitives), shapes)
            print_blocked(robot)
        elif more:
            shapes = refit(robot, {body: numbers(robot, body, text) for body, text in more})
            write_primitives(Path(robot.primitives), shapes)
            print_blocked(robot)
        else:
            rewrite_primitives(robot)
            print_blocked(robot)
    except TcsError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def rewrite_primitives(robot: RobotFile) -> None:
    """Fit and write the primitives, and print the table for docs/robots.md."""
    fits = fit_robot(
        robot, lambda done, total: print(f"{done}/{total}", file=sys.stderr), chosen_fits(robot)
    )
    fitted = [p for f in fits for p in f.fit.primitives]
    shapes = refit_parts(robot, fitted, parts_of(robot))
    tight = tightened(robot, shapes, splits_of(robot), spots_of(robot), rounds_of(robot))
    write_primitives(Path(robot.primitives), tight)
    print("| body | shapes | hull [l] | union [l] | excess |")
    print("|---|---|---|---|---|")
    for found in fits:
        fit = found.fit
        print(
            f"| {found.body} | {len(fit.primitives)} | {fit.hull * 1e3:.3f} "
            f"| {fit.union * 1e3:.3f} | {fit.excess:.2f} |"
        )


def write_distances(robot: RobotFile, pairs: list[list[str]]) -> None:
    """Measure the tables of distances, of all pairs or some, and write them beside the primitives.

    With some, the tables of the others stay, after those that are new.
    """
    primitives = Path(robot.primitives)
    path = primitives.with_name(f"{primitives.stem.removesuffix('_primitives')}_distances.npz")

    def say(pair: tuple[str, str], share: float) -> None:
        print(f"{pair[0]} / {pair[1]}: shapes block {share:.2%} of postures", file=sys.stderr)

    only = [frozenset(pair) for pair in pairs]
    tables = measured_tables(robot, only=only or None, on_pair=say)
    if only and path.exists():
        tables += tuple(t for t in read_tables(path) if frozenset(t.pair) not in only)
    write_tables(path, tables, measured_from(robot))
    print(f"{path.name}, {path.stat().st_size / 1e3:.0f} kB")
    print_blocked(robot.model_copy(update={"distances": str(path)}))


def measured_from(robot: RobotFile) -> str:
    """Return the URDF of a robot and the packages of it and its meshes, with their versions."""
    text = robot.urdf + robot.urdf_path().read_text(encoding="utf-8", errors="replace")
    found = []
    for package in sorted(set(re.findall(r"package://([^/\"]+)", text))):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(package)
    return f"{Path(robot.urdf).name}; {', '.join(found)}; fit_primitives.py --distances"


def chosen_fits(robot: RobotFile) -> dict[str, Target | None]:
    """Return how FITS says that bodies of a robot are fitted; None for those that it keeps."""
    chosen: dict[str, Target | None] = {}
    for body, fit in _fits(robot).items():
        if fit == "kept":
            chosen[body] = None
        elif isinstance(fit, int | str):
            chosen[body] = numbers(robot, body, str(fit))
        elif "shapes" in fit:
            usual = numbers(robot, body, str(fit["shapes"]))
            chosen[body] = replace(usual, protrusion=fit.get("protrusion", usual.protrusion))
    return chosen


def parts_of(robot: RobotFile) -> dict[str, list[Part]]:
    """Return the parts of bodies of a robot that FITS names."""
    return {
        body: [Part(**part) for part in fit["parts"]]
        for body, fit in _fits(robot).items()
        if isinstance(fit, dict) and "parts" in fit
    }


def splits_of(robot: RobotFile) -> dict[str, int]:
    """Return how many shapes of bodies of a robot FITS says to split."""
    return {
        body: fit["splits"]
        for body, fit in _fits(robot).items()
        if isinstance(fit, dict) and "splits" in fit
    }


def spots_of(robot: RobotFile) -> dict[str, Spots]:
    """Return where FITS says that shapes of bodies of a robot have to be the closest."""
    return {
        body: [(float(x), float(y), float(z), float(r)) for x, y, z, r in fit["spots"]]
        for body, fit in _fits(robot).items()
        if isinstance(fit, dict) and "spots" in fit
    }


def rounds_of(robot: RobotFile) -> dict[str, list[Primitive]]:
    """Return the capsules that FITS adds along round bodies before they are tightened."""
    return {
        body: [enclose_axis(body, np.array(c[:3]), np.array(c[3:6]), c[6]) for c in fit["capsules"]]
        for body, fit in _fits(robot).items()
        if isinstance(fit, dict) and "capsules" in fit
    }


def _fits(robot: RobotFile) -> dict[str, Any]:
    return yaml.safe_load(FITS.read_text(encoding="utf-8")).get(robot.name) or {}


def numbers(robot: RobotFile, body: str, text: str) -> Target:
    """Return how closely "60" or "60+120" shapes fit a body."""
    found = _NUMBERS.fullmatch(text)
    if found is None:
        raise TcsError(f"'{text}' is no number of shapes of body '{body}', such as 60 or 60+120.")
    return target_of(robot, body, *(int(number) for number in found.groups() if number))


def rewrite_pairs(robot: RobotFile, path: Path) -> None:
    """Find the pairs, write them into the YAML file, and print what the shapes block."""
    renewed = renewed_groups(robot)
    groups = [
        {
            "reason": group.reason,
            "limits": group.limits,
            **({"ranges": {n: list(r) for n, r in group.ranges.items()}} if group.ranges else {}),
            "pairs": [list(pair) for pair in group.pairs],
        }
        for group in renewed
    ]
    kept, _, _ = path.read_text(encoding="utf-8").partition("\ndisabled_groups:")
    entry = yaml.safe_dump(
        {"disabled_groups": groups}, sort_keys=False, width=95, default_flow_style=None
    )
    path.write_text(f"{kept.rstrip()}\n\n{entry}", encoding="utf-8")
    print_blocked(robot.model_copy(update={"disabled_groups": renewed}))


def print_blocked(robot: RobotFile) -> None:
    """Print what the shapes block although the surfaces are free."""
    print(blocked_by_shapes(robot).text())
    print(blocked_at_boxes(robot).text())


if __name__ == "__main__":
    sys.exit(main())
