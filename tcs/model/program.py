"""What computes: a hash by which results of another program are told from those of this one."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

from tcs.kernel.cache import kernel_digest


@cache
def program_digest() -> str:
    """Return a hash of everything but data that decides results, as 16 hex digits.

    That are all sources of the package, the packages that compute, and the processor.
    """
    package = Path(__file__).parents[1]
    versions = [f"{name} {version(name)}" for name in ("drake", "numpy", "scipy")]
    parts = " ".join((kernel_digest(package), *versions))
    return hashlib.sha256(parts.encode()).hexdigest()[:16]
