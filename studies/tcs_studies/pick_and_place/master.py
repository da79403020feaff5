"""The master: hand, workspace, scale, tremor, and the force that it renders."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.errors import TcsError
from tcs.files.quantities import MASTER_SCALE
from tcs.kernel.arrays import FloatArray
from tcs.teleop.control.latency import Latency
from tcs_studies.pick_and_place.task import START
from tcs_studies.simulated_recording import MASTER_BOX, HandMotion

PERIOD = 0.02
"""Time between two samples of the master [s]: those of the thesis after its filter."""
LATENCY = Latency(0.1)
"""Latency of commands and image, each [s]."""
_TREMOR_HZ, _TREMOR_DECAY = 9.0, 0.9
"""Frequency of physiological tremor, and fraction of its amplitude after a sample."""
_LARGEST_FORCE = 3.3
"""Greatest force of the Geomagic Touch [N]."""
_HAND_STIFFNESS = 300.0
"""Stiffness of the hand that holds the device [N/m]."""
_FORCE_CUTOFF = 10.0
"""Cutoff frequency of the first-order filter of the force [Hz]."""
_FARTHEST_TURN = np.array([1.0, 1.0, 2.0])
"""Greatest roll, pitch and yaw of the stylus from the start [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """Coupling of master and slave.

    Attributes:
        scale: Metres at the tool per metre of the hand, as of the simulated recording.
        latency: Latency of the commands and of the image. The thesis has a WiFi link and prints
            none.
        stiffness: Stiffness of the rendered contact at the hand [N/m].
    """

    scale: float = HandMotion().scale
    latency: Latency = LATENCY
    stiffness: float = 1000.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            TcsError: If a value is out of its range.
        """
        MASTER_SCALE.check((self.scale,), "coupling: its scale", TcsError)
        if not (math.isfinite(self.stiffness) and self.stiffness >= 0.0):
            raise TcsError(f"coupling: stiffness {self.stiffness:g} N/m; must be 0 or more.")


class Master:
    """Pose of the hand, scaled to the tool."""

    def __init__(self, coupling: Coupling, tremor: FloatArray) -> None:
        """Start at the start pose of the tool.

        Args:
            coupling: Coupling of master and slave.
            tremor: Tremor of the hand, translation [m] and rotation [rad], shape (n, 6), repeated
                after n samples.
        """
        self.p, self.angles = np.array(START), np.zeros(3)
        """Goal of the tool without tremor: position [m] and roll, pitch, yaw [rad]."""
        self.force = 0.0
        """Force on the hand, upwards [N]."""
        self._coupling, self._tremor, self._sample = coupling, tremor, 0
        half = 0.5 * coupling.scale * np.array(MASTER_BOX)
        middle = np.array([*HandMotion().centre, START[2]])
        self._low, self._high = middle - half, middle + half
        self._fade = math.exp(-2.0 * math.pi * _FORCE_CUTOFF * PERIOD)

    def move(self, p: FloatArray, angles: FloatArray) -> None:
        """Move the hand within the workspace of the master.

        Args:
            p: Goal of the tool [m], shape (3,).
            angles: Roll, pitch and yaw of the tool [rad], shape (3,).
        """
        self.p = np.minimum(np.maximum(p, self._low), self._high)
        self.angles = np.minimum(np.maximum(angles, -_FARTHEST_TURN), _FARTHEST_TURN)

    def sample(self) -> tuple[FloatArray, FloatArray]:
        """Return the goal of the tool with tremor: position [m] and roll, pitch, yaw [rad]."""
        shake = self._tremor[self._sample % len(self._tremor)]
        self._sample += 1
        p = self.p + self._coupling.scale * shake[:3]
        # The contact pushes the hand back, against its own stiffness.
        p[2] += self._coupling.scale * self.force / _HAND_STIFFNESS
        return p, self.angles + shake[3:]

    def feel(self, depth: float) -> None:
        """Render a contact for one sample.

        Args:
            depth: Depth of the commanded pose below the contact [m]; 0 without contact.
        """
        force = min(_LARGEST_FORCE, self._coupling.stiffness * depth / self._coupling.scale)
        self.force = self._fade * self.force + (1.0 - self._fade) * force


def drawn_tremor(
    rng: np.random.Generator, std: float, lever: float, samples: int = 2048
) -> FloatArray:
    """Return tremor of the hand: a resonance at 9 Hz driven by noise, shape (samples, 6).

    Args:
        rng: Random generator.
        std: Standard deviation of each coordinate [m].
        lever: Distance over which a translation becomes a rotation [m].
        samples: Number of samples.
    """
    from scipy.signal import lfilter

    turn = 2.0 * math.pi * _TREMOR_HZ * PERIOD
    resonance = [1.0, -2.0 * _TREMOR_DECAY * math.cos(turn), _TREMOR_DECAY**2]
    noise = lfilter([1.0], resonance, rng.standard_normal((samples, 6)), axis=0)
    noise *= std / noise.std(axis=0)
    noise[:, 3:] /= lever
    return np.asarray(noise, dtype=np.float64)
