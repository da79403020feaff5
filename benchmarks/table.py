"""What every benchmark prints: machine, versions, and measured numbers with their spread."""

from __future__ import annotations

import os
import platform
import statistics
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("tcs", "drake", "numba", "numpy", "scipy", "joblib", "example-robot-data")


def header(*packages: str) -> None:
    """Print machine, load and versions: of our own packages, and of the others that are named."""
    row("machine", f"{platform.machine()}, {processor()}")
    row("load when it began", ", ".join(f"{load:.2f}" for load in os.getloadavg()))
    row("python", platform.python_version())
    row("versions", ", ".join(f"{name} {_version(name)}" for name in (*PACKAGES, *packages)))


def row(name: str, text: str) -> None:
    """Print one line of the table."""
    print(f"{name:<34} {text}", flush=True)


def spread(seconds: list[float], unit: str = "s", scale: float = 1.0) -> str:
    """Return median and range."""
    values = [scale * s for s in seconds]
    middle, low, high = statistics.median(values), min(values), max(values)
    return f"{middle:.3f} {unit} (median of {len(values)}, {low:.3f} .. {high:.3f})"


def processor() -> str:
    """Return the processor's name and how many cores there are."""
    names = [
        line.split(":", 1)[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    return f"{names[0]} x {len(names)}" if names else platform.processor()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "absent"
