"""Named random streams, and the ranges of samples and seeds."""

from __future__ import annotations

import zlib

import numpy as np

from tcs.errors import TcsError

MAX_SAMPLES = 1_000_000
"""Greatest number of samples: sufficient for a hundredth of a percentage point."""
MAX_SEED = 2**63 - 1
"""Greatest seed."""


def named_generator(seed: int, name: str) -> np.random.Generator:
    """Return the random stream of a name (PCG64), independent of the streams of other names.

    Args:
        seed: Seed, 0 or greater.
        name: Any text.
    """
    key = name.encode()
    # The checksum makes names of different lengths differ in every 32-bit word of the key.
    words = (zlib.crc32(key), len(key), *key)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=words)))


def check_draws(samples: int, seed: int) -> None:
    """Refuse a number of samples or a seed that is out of range.

    Raises:
        TcsError: If either is out of range.
    """
    if samples % 1 or not 1 <= samples <= MAX_SAMPLES:
        raise TcsError(f"samples is {samples}; must be a whole number, 1 to {MAX_SAMPLES:,}.")
    if seed % 1 or not 0 <= seed <= MAX_SEED:
        raise TcsError(f"seed is {seed}; must be a whole number from 0 to {MAX_SEED}.")
