"""Random numbers of the planner: SplitMix64 (Steele, Lea, Flood 2014), one state per query."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.cache import inner

RandomState = NDArray[np.uint64]
"""State of a generator, shape (1,)."""
_STEP, _FIRST, _SECOND = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
_S11, _S27, _S30, _S31 = (np.uint64(shift) for shift in (11, 27, 30, 31))


def random_state(seed: int) -> RandomState:
    """Return the state that a seed starts from."""
    return np.array([seed % 2**64], dtype=np.uint64)


@inner
def uniform(state: RandomState) -> float:
    """Return a random number in [0, 1) and advance the state."""
    state[0] += np.uint64(_STEP)
    z = state[0]
    z = (z ^ (z >> _S30)) * np.uint64(_FIRST)
    z = (z ^ (z >> _S27)) * np.uint64(_SECOND)
    z ^= z >> _S31
    return np.float64(z >> _S11) * (1.0 / 9007199254740992.0)
