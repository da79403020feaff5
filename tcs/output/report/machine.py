"""Facts about the program, its libraries and the machine, for reports."""

from __future__ import annotations

import os
import platform
import time
from importlib.metadata import version

LIBRARIES = ("drake", "numba", "numpy", "scipy", "matplotlib", "example-robot-data")


def versions() -> list[tuple[str, str]]:
    """Return the versions of the program and of the libraries its results depend on."""
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return [
        ("tcs", version("tcs")),
        ("Python", python),
        ("Libraries", ", ".join(f"{name} {version(name)}" for name in LIBRARIES)),
    ]


def machine() -> list[tuple[str, str]]:
    """Return operating system, processor and load of the machine."""
    facts = [
        ("Machine", f"{platform.system()} {platform.machine()}, {_processor()}"),
        ("Processors", str(os.cpu_count())),
    ]
    if hasattr(os, "getloadavg"):
        facts.append(("Load", ", ".join(f"{load:.1f}" for load in os.getloadavg())))
    return facts


def today() -> str:
    """Return the current date and time (UTC).

    >>> len(today())
    20
    """
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())


def _processor() -> str:
    """Return the name of the processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or "unknown processor"
