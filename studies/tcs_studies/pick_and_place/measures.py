"""Measures of a repetition, as in the ITCM thesis, III.C.4 and Appendix F.3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs_studies.experiment.metrics import (
    resampled,
    spectral_arc_length,
    steering_angle,
    steering_translation,
)
from tcs_studies.pick_and_place.repetition import Repetition


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """Measures of a successful repetition.

    Attributes:
        tct: Completion time: from the coupling until the gripper is 0.30 m from the place [s].
        csa: Cumulative steering angle [rad].
        cst: Cumulative steering translation, of the hand [m].
        sal: Spectral arc length of the speed of the hand.
        csa_rate: Steering angle per time [rad/s].
        cst_rate: Steering translation per time [m/s].
        approach: Time until the gripper is first closed [s].
        transfer: Time from then until it is first opened [s].
        retreat: Time from then to the end [s].
        actions: Number of times that the gripper was opened or closed.
        corrections: Number of times that the cup stood partly outside the circle.
    """

    tct: float
    csa: float
    cst: float
    sal: float
    csa_rate: float
    cst_rate: float
    approach: float
    transfer: float
    retreat: float
    actions: float
    corrections: float


MEASURES = tuple(Measures.__dataclass_fields__)


def measure(done: Repetition) -> Measures:
    """Return the measures of a successful repetition.

    Args:
        done: The repetition; the gripper closed and opened at least once.

    Source:
        ITCM thesis, III.C.4, Appendices F.1, F.3 and F.4. The master is sampled at 50 Hz, the rate
        to which the thesis resamples; so the filter has nothing left to remove.
    """
    _, hand = resampled(done.time, np.hstack([done.hand, np.unwrap(done.angles, axis=0)]))
    rate = (len(hand) - 1) / float(done.time[-1] - done.time[0])
    speed = rate * np.linalg.norm(np.diff(hand[:, :3], axis=0), axis=1)
    tct = float(done.time[-1])
    closed, opened = done.actions[:2]
    csa, cst = steering_angle(hand[:, 3:]), steering_translation(hand[:, :3])
    return Measures(
        tct=tct,
        csa=csa,
        cst=cst,
        sal=spectral_arc_length(speed, rate),
        csa_rate=csa / tct,
        cst_rate=cst / tct,
        approach=closed,
        transfer=opened - closed,
        retreat=tct - opened,
        actions=float(len(done.actions)),
        corrections=float(done.corrections),
    )
