"""Traits of a scripted operator of the pick-and-place task."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Traits:
    """Behaviour of one operator, the same from every base pose.

    The values were set before the first run of the experiment, from the sources given or to what is
    usual for careful work, and never fitted to results. `drawn` varies them over operators.
    Distances and speeds are those of the tool, unless they are said to be of the hand.

    Attributes:
        speed: Mean speed of a submovement [m/s].
        turn_speed: Mean angular speed of a submovement [rad/s].
        submovement: Longest time of one submovement [s]: visual corrections come at about 1 Hz
            (Woodworth 1899; Meyer et al. 1988).
        reaction: Time from an event to the reaction of the hand [s]; simple reactions take 0.2 to
            0.3 s.
        touch_reaction: The same for a force that is felt [s]; touch is faster than vision.
        thinking: Time to decide what is next, and to press a button [s].
        mental_rotation: Additional time to plan a submovement, per angle between the frames of hand
            and camera [s/rad]: 400 deg/s (Georgopoulos and Massey 1987).
        learning: Fraction of the uncompensated angle that is learnt in a submovement: some twenty
            movements are needed to adapt to rotated feedback (Krakauer et al. 2000).
        adaptation: Greatest fraction of the angle that is compensated: adaptation to rotated
            feedback stays incomplete (Vaswani et al. 2015).
        extent_noise: Standard deviation of the extent of a submovement, as a fraction:
            signal-dependent noise (Harris and Wolpert 1998).
        direction_noise: Standard deviation of the direction of a submovement [rad].
        misjudging: Standard deviation of the perceived position of the tool relative to its target,
            across the view [m], where both coincide.
        weber: Increase of that deviation per distance between the two [m/m].
        depth: Ratio of the deviation along the view to that across it: one image, depth from
            shadows and heights only.
        blind: The deviation where the tool is not in the image [m].
        misjudging_angle: Standard deviation of the perceived orientation [rad].
        misjudging_memory: Time constant of the misjudgement [s].
        tremor: Standard deviation of the position of the hand [m]: 38 µm with a held instrument
            (Riviere, Rader and Khosla 1997).
        tremor_lever: Distance over which tremor becomes rotation [m]: half a stylus.
        forearm: Length over which a translation of the hand becomes an involuntary rotation [m]:
            the hand pivots about the elbow.
        patience: Number of submovements without progress after which another way is tried.
        first_try: Distance of the first recovery motion [m].
        first_turn: Rotation of joint group 1 in a recovery [rad], with null-space control.
        pointing: Time to take the device of the joint groups [s].
        regrip: Time to take the first device again [s].
    """

    speed: float = 0.08
    turn_speed: float = 0.5
    submovement: float = 1.0
    reaction: float = 0.25
    touch_reaction: float = 0.15
    thinking: float = 0.4
    mental_rotation: float = 1.0 / math.radians(400.0)
    learning: float = 0.05
    adaptation: float = 0.85
    extent_noise: float = 0.08
    direction_noise: float = 0.1
    misjudging: float = 0.002
    weber: float = 0.03
    depth: float = 3.0
    blind: float = 0.05
    misjudging_angle: float = 0.05
    misjudging_memory: float = 2.0
    tremor: float = 38e-6
    tremor_lever: float = 0.05
    forearm: float = 0.3
    patience: int = 3
    first_try: float = 0.05
    first_turn: float = 0.35
    pointing: float = 1.5
    regrip: float = 0.5

    @classmethod
    def drawn(cls, rng: np.random.Generator, usual: Traits | None = None) -> Traits:
        """Return random traits, log-normal with a standard deviation of 0.2 of the logarithm.

        Args:
            rng: Random generator.
            usual: Medians of the traits; None for the defaults.
        """
        usual = usual or cls()
        spread = np.exp(0.2 * rng.standard_normal(len(VARIED)))
        changes: dict[str, Any] = {
            name: float(getattr(usual, name) * factor)
            for name, factor in zip(VARIED, spread, strict=True)
        }
        return replace(usual, **changes)


VARIED = (
    "speed", "turn_speed", "reaction", "thinking", "mental_rotation", "learning", "extent_noise",
    "direction_noise", "misjudging", "weber", "depth", "misjudging_angle", "tremor",
)  # fmt: skip
"""Traits that vary over operators."""
