"""Measure how closely the shapes of people of other sizes enclose the skin of the papers' man.

Usage: python benchmarks/person_shapes.py [--bodies 50] [--seed 0]

The points are those of `tests/data/person_surface.csv` that are within the padding of their own
link on the papers' man, stretched with the link. Others are in sockets between the meshes, or near
to another link's shapes.
"""

from __future__ import annotations

import csv

import numpy as np
from table import CHECKOUT, header, parser, record, row, save

from tcs.model.people import Person, Scale, draw_bodies, link_scales, scales_of_people
from tcs.model.scene import load_environment
from tcs.model.scene.person.resized import (
    covers_of,
    padding_of,
    part_of,
    person_shapes,
    scales_by_link,
)

PEOPLE = {
    "woman, 5th percentiles": Person(sex="female", stature_percentile=5, mass_percentile=5),
    "woman, medians": Person(sex="female"),
    "man, 95th percentiles": Person(sex="male", stature_percentile=95, mass_percentile=95),
    "woman, short and heavy (20th, 97th)": Person(
        sex="female", stature_percentile=20, mass_percentile=97
    ),
    "man, tall and slim (95th, 5th)": Person(sex="male", stature_percentile=95, mass_percentile=5),
    "girl of 6 years": Person(sex="female", age=6),
}
"""Percentiles are of stature and mass."""
COLUMNS = (
    "skin beyond shapes, greatest [mm]",
    "the same, at the trunk and thighs",
    "padded shapes beyond skin, mean [mm]",
)
_LARGE = ("upper_body", "mid_body", "lower_body", "quad")


class Skin:
    """Points on the skin of the papers' man by link, and the shapes there."""

    def __init__(self) -> None:
        """Read both, and choose the points."""
        self._environment = load_environment("wheelchair")
        self._shapes = person_shapes(self._environment)
        points: dict[str, list[list[float]]] = {link: [] for link in self._shapes}
        path = CHECKOUT / "tests" / "data" / "person_surface.csv"
        with path.open(newline="", encoding="utf-8") as file:
            for line in csv.DictReader(file):
                points[f"person::{line['link']}"].append([float(line[key]) for key in "xyz"])
        whole = {link: np.array(found) for link, found in points.items() if found}
        near = {
            link: self._distances(link, found, (1.0, 1.0, 1.0)) for link, found in whole.items()
        }
        self._points = {
            link: found[near[link] <= self._environment.padding[link]]
            for link, found in whole.items()
        }
        kept, count = (sum(map(len, found.values())) for found in (self._points, whole))
        row("points of the skin", f"{kept:,} of {count:,}")

    def _distances(self, link: str, points: np.ndarray, scale: Scale) -> np.ndarray:
        """Return how far points stand out of the shapes of a stretched link [m]."""
        covers = covers_of(self._environment, link, self._shapes[link], scale)
        shapes = [shape for cover in covers for shape in cover]
        found = [min(s.nearest(np.array(scale) * x)[0] for s in shapes) for x in points]
        return np.array(found)

    def beyond(self, scales: dict[str, Scale]) -> tuple[float, float, float]:
        """Return the numbers of COLUMNS for a person [mm]."""
        by_link = scales_by_link("person", scales) if scales else {}
        inward, large, excess = [], [], []
        for link, points in self._points.items():
            found = self._distances(link, points, by_link.get(link, (1.0, 1.0, 1.0)))
            inward.append(found.max())
            if part_of(link.partition("::")[2]) in _LARGE:
                large.append(found.max())
            excess.append(padding_of(self._environment, link, by_link) - found)
        mean = float(np.concatenate(excess).mean())
        return 1e3 * max(inward), 1e3 * max(large), 1e3 * mean


def main() -> None:
    """Measure each person, print and record the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--bodies", type=int, default=50)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    skin = Skin()
    people: dict[str, dict[str, Scale]] = {"papers' man": {}}
    people |= {name: link_scales(person.body()) for name, person in PEOPLE.items()}
    rows = [[name, *(f"{value:.1f}" for value in skin.beyond(s))] for name, s in people.items()]
    drawn = scales_of_people(draw_bodies(options.bodies, seed=options.seed))
    of_drawn = np.array([skin.beyond(scales) for scales in drawn])
    worst = [*of_drawn[:, :2].max(axis=0), of_drawn[:, 2].mean()]
    rows.append([f"{options.bodies} drawn people", *(f"{value:.1f}" for value in worst)])
    for name, *cells in rows:
        row(name, "  ".join(cells))
    record("closeness", ["person", *COLUMNS], rows)
    save(options)


if __name__ == "__main__":
    main()
