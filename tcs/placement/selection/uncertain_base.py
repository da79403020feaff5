"""How far a selection depends on the error of the current base pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.model.random_streams import check_draws, named_generator
from tcs.placement.selection.choice import Choice


def same_set(
    choose: Callable[[InitialConfiguration], Choice],
    here: InitialConfiguration,
    covariance: NDArray[np.float64],
    *,
    draws: int = 100,
    seed: int = 0,
) -> float:
    """Return the fraction of random current base poses from which the same set is selected.

    Args:
        choose: Returns the choice from a state.
        here: The estimated state.
        covariance: Covariance of x, y and yaw of the base in the environment frame [m, rad], shape
            (3, 3).
        draws: Number of base poses, drawn from a normal distribution.
        seed: Seed of the random numbers.

    Raises:
        SelectionError: If no set can be selected from `here`.
        TcsError: If the number of draws or the seed is out of range.
    """
    check_draws(draws, seed)
    selected = choose(here).indices
    values, axes = np.linalg.eigh(covariance)
    normal = named_generator(seed, "located base").standard_normal((draws, 3))
    same = 0
    for x, y, yaw in normal @ (axes * np.sqrt(np.maximum(values, 0.0))).T:
        moved = replace(
            here,
            base_x=here.base_x + float(x),
            base_y=here.base_y + float(y),
            base_yaw=here.base_yaw + float(yaw),
        )
        try:
            same += choose(moved).indices == selected
        except SelectionError:
            # From there, no set can be selected.
            continue
    return same / draws
