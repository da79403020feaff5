"""What a scripted operator perceives of the tool: late, misjudged, and blind outside the image."""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.control.resolved_rate import rotation_vector
from tcs_studies.pick_and_place.phases import Seen
from tcs_studies.pick_and_place.slave import orientation
from tcs_studies.pick_and_place.traits import Traits
from tcs_studies.pick_and_place.view import HeadCamera


class Perception:
    """Perceived displacement and rotation of the tool, with errors that fade with time."""

    def __init__(self, traits: Traits, camera: HeadCamera, rng: np.random.Generator) -> None:
        """Draw the first errors.

        Args:
            traits: Traits of the operator.
            camera: The view.
            rng: Random generator of the errors.
        """
        self._traits, self._camera, self._rng = traits, camera, rng
        self._noise, self._time = rng.standard_normal(6), 0.0

    def displacement(self, now: float, off: FloatArray, seen: Seen) -> FloatArray:
        """Return the perceived displacement from the tool to its target [m], shape (3,).

        Args:
            now: Time since the start [s].
            off: The true displacement in the base [m], shape (3,).
            seen: What the image shows.
        """
        traits = self._traits
        kept = math.exp(-(now - self._time) / traits.misjudging_memory)
        fresh = self._rng.standard_normal(6)
        self._noise = kept * self._noise + math.sqrt(1.0 - kept * kept) * fresh
        self._time = now
        noise = self._noise[:3]
        if not self._camera.sees(seen.p):
            return off + traits.blind * noise
        std = traits.misjudging + traits.weber * math.sqrt(off @ off)
        return np.asarray(off + self._camera.R @ (std * noise * (traits.depth, 1.0, 1.0)))

    def rotation(self, seen: Seen, heading: float) -> FloatArray:
        """Return the perceived rotation from the tool to its orientation [rad], shape (3,).

        Args:
            seen: What the image shows.
            heading: Heading of the fingers about z in the base [rad].
        """
        turn = rotation_vector(orientation(0.0, 0.0, heading) @ seen.R.T)
        return turn + self._traits.misjudging_angle * self._noise[3:]
