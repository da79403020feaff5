"""Write the table of docs/installing.md: oldest and newest versions of each dependency."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CHECKOUT = Path(__file__).resolve().parents[1]
PAGE = CHECKOUT / "docs" / "installing.md"
LOCK = CHECKOUT / "requirements.lock"
PYTHONS = ("3.11", "3.12", "3.13")
"""Versions of Python with which the tests run."""
TOOLS = {"app", "benchmarks", "dev", "docs"}
"""Extras for work on tcs itself, and one that names another."""
BLOCK = re.compile(r"(?<=<!-- versions -->\n\n).*?(?=\n<!-- end of versions -->)", re.DOTALL)


def main() -> None:
    """Write the table into the page."""
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(BLOCK.sub(lambda _: table(), page), encoding="utf-8")


def table() -> str:
    """Return a row for each package that tcs or an extra of it requires."""
    locked = {python: versions_with(python) for python in PYTHONS}
    lines = [
        "| package | for | at least | " + " | ".join(f"Python {p}" for p in PYTHONS) + " |",
        "|---" * (3 + len(PYTHONS)) + "|",
    ]
    for name, (least, purposes) in sorted(dependencies().items()):
        newest = " | ".join(locked[python][name] for python in PYTHONS)
        lines.append(f"| {name} | {', '.join(purposes)} | {least} | {newest} |")
    return "".join(f"{line}\n" for line in lines)


def dependencies() -> dict[str, tuple[str, list[str]]]:
    """Return the oldest version of each package, and what it is for: tcs, or extras."""
    found: dict[str, tuple[str, list[str]]] = {}
    for purpose, line in requirements():
        wanted = Requirement(line)
        least = str(wanted.specifier).removeprefix(">=")
        _, purposes = found.setdefault(canonicalize_name(wanted.name), (least, []))
        purposes.append(purpose)
    return found


def requirements() -> Iterator[tuple[str, str]]:
    """Yield each requirement after what it is for."""
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for line in project["dependencies"]:
        yield "all", line
    for extra, lines in sorted(project["optional-dependencies"].items()):
        if extra not in TOOLS:
            for line in lines:
                yield f"`{extra}`", line


def versions_with(python: str) -> dict[str, str]:
    """Return the version of each package in the lock file with a version of Python on Linux."""
    place = {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "sys_platform": "linux",
    }
    lines = LOCK.read_text(encoding="utf-8").splitlines()
    locked = [Requirement(line) for line in lines if not line.startswith("#")]
    return {
        canonicalize_name(one.name): str(one.specifier).removeprefix("==")
        for one in locked
        if one.marker is None or one.marker.evaluate(place)
    }


if __name__ == "__main__":
    main()
