"""A smooth Gauss-Markov process, which models tremor of a hand and misjudgement of a position."""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import FloatArray


class GaussMarkovProcess:
    """A stationary second-order Gauss-Markov process of three independent coordinates.

    Each coordinate is a critically damped second-order system driven by white noise, in the steady
    state from the first sample on: its variance depends neither on time nor on the sampling period.
    """

    def __init__(
        self, rng: np.random.Generator, *, std: float, memory: float, period: float
    ) -> None:
        """Draw the initial state from the steady state.

        Args:
            rng: Generator of the noise.
            std: Standard deviation of each coordinate.
            memory: Time constant of the correlation [s].
            period: Sampling period [s].
        """
        a = 1.0 / memory
        fade = math.exp(-a * period)
        self._rng = rng
        # The exact solution over one period of x'' = -2 a x' - a^2 x + noise.
        self._transition = fade * np.array(
            [[1.0 + a * period, period], [-a * a * period, 1.0 - a * period]]
        )
        steady = std * std * np.diag([1.0, a * a])
        noise = steady - self._transition @ steady @ self._transition.T
        # Rounding may leave an eigenvalue slightly below zero where periods are short.
        values, vectors = np.linalg.eigh(noise)
        self._spread = vectors * np.sqrt(np.maximum(values, 0.0))
        self._state = std * np.array([[1.0], [a]]) * rng.standard_normal((2, 3))

    @property
    def value(self) -> FloatArray:
        """Current value, shape (3,)."""
        return np.array(self._state[0])

    @property
    def rate(self) -> FloatArray:
        """Current rate of change [1/s], shape (3,)."""
        return np.array(self._state[1])

    def advance(self) -> None:
        """Advance by one period."""
        drive = self._spread @ self._rng.standard_normal((2, 3))
        self._state = self._transition @ self._state + drive
