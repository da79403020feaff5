"""How well a run went: the experiment's three metrics, and measures of the hand's motion.

Accuracy, completion time and effort are those of the null-space paper (sections II.C.4 and A);
steering, smoothness and filtering are those of the ITCM thesis (section III.C and Appendix F).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray
from tcs.teleop.line import Line

PLANES = 30
"""Normal planes along the line (paper, eq. 15)."""
PLANE_MARGIN = 0.005
"""A sample this close to a plane, on either side, lies in it [m] (paper, Appendix A.1)."""
DEVICE_MASS = 0.203
"""Mass of an HTC Vive controller [kg]; the paper does not state the one it took."""
RESAMPLED_RATE = 50.0
"""Samples a second after filtering (thesis, Appendix F.1)."""
CUTOFF = 50.0
"""Of the filter [Hz]: double what a hand can do (thesis, Appendix F.1)."""
ARC_CUTOFF = 20.0
"""Up to which frequency the spectral arc length is taken [Hz] (Balasubramanian et al. 2012)."""
_PAD_LEVEL = 4
"""The spectrum is sampled 2**4 times as finely as the signal gives, as in the authors' code, so
that values compare. Finer sampling ends up to 0.5 % further from zero."""


@dataclass(frozen=True, eq=False)
class Accuracy:
    """How far the tool's barycentre kept from the line."""

    worst: float
    """Greatest distance between barycentre and line over the planes met: TA of eq. (15) [m]."""
    barycentre: FloatArray
    """Mean of the samples in each plane [m], shape (planes, 3); NaN where there are none."""
    planes_met: int
    """Planes with a sample in them."""


def trajectory_accuracy(
    position: FloatArray, line: Line, *, planes: int = PLANES, margin: float = PLANE_MARGIN
) -> Accuracy:
    """Return how far the barycentre of a path is from a line, at worst.

    The planes stand at even distances, the first at the start and the last at the end. All samples
    within the margin of a plane belong to it, however often the tool came by and however far off:
    so a place where the tool lingered counts by the time it did.

    Args:
        position: Of the tool [m], shape (n, 3).
        line: The line, in the same frame.
        planes: How many.
        margin: How far from a plane a sample may be [m].

    Raises:
        DataFileError: If no sample is in any plane.

    Source:
        Null-space paper, eq. (15) and Appendix A.1. It takes for granted that each plane has a
        sample; of a run that ended early, or skipped a plane at speed, those planes are left out
        here; `Accuracy.planes_met` counts the rest.

    >>> line = Line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    >>> path = np.array([[x, 0.02, 0.0] for x in np.linspace(-0.1, 1.1, 3000)])
    >>> round(trajectory_accuracy(path, line).worst, 4)
    0.02
    """
    points = np.asarray(position, dtype=np.float64)
    shares = np.linspace(0.0, 1.0, planes)
    along = line.fraction_at(points) * line.length
    # Rounding must not take a sample away that lies right at the margin.
    inside = np.abs(along[:, None] - shares * line.length) <= margin + 1e-12
    count = inside.sum(axis=0)
    if not count.any():
        raise DataFileError(
            f"none of {len(points)} samples is within {margin:g} m of a plane of the line. Give "
            "positions in the line's frame, in metres."
        )
    met = count > 0
    barycentre = np.full((planes, 3), np.nan)
    barycentre[met] = (inside.T[met] @ points) / count[met, None]
    off = np.linalg.norm(barycentre - line.at(shares), axis=1)
    return Accuracy(float(np.nanmax(off)), barycentre, int(met.sum()))


def completion_time(
    time: FloatArray, position: FloatArray, line: Line, *, radius: float
) -> float | None:
    """Return how long it took until the tool first came so close to the end [s].

    Args:
        time: Of the samples [s], shape (n,).
        position: Of the tool [m], shape (n, 3).
        line: The line.
        radius: Of the sphere at its end [m].

    Returns:
        None where the tool never came there.

    Source:
        Null-space paper, Appendix A.2.
    """
    there = np.linalg.norm(np.asarray(position) - np.asarray(line.end), axis=1) <= radius
    return float(time[int(np.argmax(there))] - time[0]) if there.any() else None


def effort(time: FloatArray, hand: FloatArray, *, mass: float = DEVICE_MASS) -> float:
    """Return the mean absolute work on the device from one sample to the next [J].

    Args:
        time: Of the samples [s], at equal steps, shape (n,), n >= 3.
        hand: Position of the device [m], shape (n, 3).
        mass: Of the device [kg].

    Raises:
        DataFileError: If there are less than three samples.

    Source:
        Null-space paper, eq. (16): W = m (dv / dt) . ds, in absolute terms, mean over the run. It
        does not say where between two samples v is taken; here v is that over a step, and ds the
        mean of the two steps that v changes between.
    """
    _at_least(len(time), 3)
    steps = np.diff(np.asarray(hand, dtype=np.float64), axis=0)
    dt = np.diff(time)[:, None]
    force = mass * np.diff(steps / dt, axis=0) / (0.5 * (dt[1:] + dt[:-1]))
    way = 0.5 * (steps[1:] + steps[:-1])
    return float(np.abs((force * way).sum(axis=1)).mean())


def steering_angle(roll_pitch_yaw: FloatArray) -> float:
    """Return how much the device was turned in all [rad].

    Args:
        roll_pitch_yaw: Of the device [rad], shape (n, 3); jumps by full turns do not count.

    Source:
        ITCM thesis, eqs. (28) and (29), with absolute differences: as printed the signed ones are
        summed, which leaves the difference between last and first.

    >>> steering_angle(np.array([[0.0, 0, 0], [0.5, 0, 0], [0.0, 0, 0.2]]))
    1.2
    """
    angles = np.unwrap(np.asarray(roll_pitch_yaw, dtype=np.float64), axis=0)
    return float(np.abs(np.diff(angles, axis=0)).sum())


def steering_translation(hand: FloatArray) -> float:
    """Return how far the device was moved in all [m]: ITCM thesis, eq. (30).

    >>> steering_translation(np.array([[0.0, 0, 0], [3.0, 4.0, 0], [0.0, 0, 0]]))
    10.0
    """
    steps = np.diff(np.asarray(hand, dtype=np.float64), axis=0)
    return float(np.linalg.norm(steps, axis=1).sum())


def spectral_arc_length(speed: FloatArray, rate: float, *, cutoff: float = ARC_CUTOFF) -> float:
    """Return how smooth a speed profile is: the nearer to zero, the smoother.

    Args:
        speed: Absolute speed at equal steps, shape (n,), not all zero.
        rate: Samples a second.
        cutoff: Highest frequency that counts [Hz]; at most half the rate.

    Raises:
        DataFileError: If the speed is zero throughout, or the cutoff beyond half the rate.

    Source:
        ITCM thesis, Appendix F.3, after Balasubramanian, Melendez-Calderon, Burdet, IEEE Trans.
        Biomed. Eng. 59 (2012): the length of the curve of Fourier magnitude, divided by that at 0,
        over frequency, divided by the cutoff, with a minus.
    """
    values = np.asarray(speed, dtype=np.float64)
    _at_least(len(values), 2)
    if cutoff > 0.5 * rate:
        raise DataFileError(
            f"spectral arc length up to {cutoff:g} Hz of {rate:g} samples a second. Record at "
            f"{2.0 * cutoff:g} a second or more, or lower the cutoff."
        )
    if not np.any(values):
        raise DataFileError("spectral arc length of a hand that never moved. Record one that did.")
    points = 2 ** (int(np.ceil(np.log2(len(values)))) + _PAD_LEVEL)
    magnitude = np.abs(np.fft.rfft(values, points))
    frequency = np.fft.rfftfreq(points, 1.0 / rate)
    # The curve ends right at the cutoff, which need not be a frequency of the transform.
    kept = np.append(frequency[frequency < cutoff], cutoff)
    curve = np.interp(kept, frequency, magnitude) / magnitude[0]
    return -float(np.hypot(np.diff(kept) / cutoff, np.diff(curve)).sum())


def resampled(
    time: FloatArray, values: FloatArray, *, rate: float = RESAMPLED_RATE, cutoff: float = CUTOFF
) -> tuple[FloatArray, FloatArray]:
    """Return a recording without what no hand can do, at fewer samples a second.

    Args:
        time: Of the samples [s], at equal steps, shape (n,).
        values: What was recorded, shape (n, ...).
        rate: Samples a second that are wanted.
        cutoff: Of the filter [Hz]; a recording of at most twice as many samples a second holds
            nothing beyond, and is not filtered.

    Returns:
        Times and values, linear between the filtered samples.

    Raises:
        DataFileError: If the recording is too short to be filtered.

    Source:
        ITCM thesis, Appendix F.1: a second-order Butterworth filter forward and backward, so that
        nothing is delayed, then linear interpolation.
    """
    from scipy.interpolate import make_interp_spline
    from scipy.signal import butter, sosfiltfilt

    _at_least(len(time), 16)
    recorded = (len(time) - 1) / float(time[-1] - time[0])
    smooth = np.asarray(values, dtype=np.float64)
    if recorded > 2.0 * cutoff * (1.0 + 1e-9):
        smooth = sosfiltfilt(butter(2, cutoff, fs=recorded, output="sos"), smooth, axis=0)
    count = int(np.floor((time[-1] - time[0]) * rate + 1e-9)) + 1
    wanted = time[0] + np.arange(count) / rate
    # The last time may be past the recording's by rounding alone.
    line = make_interp_spline(time, smooth, k=1, axis=0)
    return wanted, np.asarray(line(np.minimum(wanted, time[-1])))


def _at_least(count: int, least: int) -> None:
    if count < least:
        raise DataFileError(f"a recording of {count} samples; it takes {least} at least.")
