"""Metrics of a run: those of the experiment, and measures of the hand's motion.

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
"""Number of normal planes along the line (paper, eq. 15)."""
PLANE_MARGIN = 0.005
"""Greatest distance of a sample from the plane it belongs to [m] (paper, Appendix A.1)."""
DEVICE_MASS = 0.203
"""Mass of an HTC Vive controller [kg]; the paper does not state the mass it uses."""
RESAMPLED_RATE = 50.0
"""Sampling rate after filtering [1/s] (thesis, Appendix F.1)."""
CUTOFF = 50.0
"""Cutoff frequency of the filter [Hz]: twice that of hand motion (thesis, Appendix F.1)."""
ARC_CUTOFF = 20.0
"""Highest frequency of the spectral arc length [Hz] (Balasubramanian et al. 2012)."""
_PAD_LEVEL = 4
"""The signal is padded with zeros so that the spectrum has 2**4 times as many samples, as in the
authors' code, for comparable values. Finer sampling gives values up to 0.5 % further from zero."""


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Distance between the barycentre of the tool's path and the line."""

    worst: float
    """Greatest distance over the planes with samples: TA of eq. (15) [m]."""
    barycentre: FloatArray
    """Mean of the samples in each plane [m], shape (planes, 3); NaN where there are none."""
    planes_met: int
    """Number of planes with samples."""


def trajectory_accuracy(
    position: FloatArray, line: Line, *, planes: int = PLANES, margin: float = PLANE_MARGIN
) -> Accuracy:
    """Return the greatest distance between the barycentre of a path and a line.

    The planes are equally spaced, the first at the start and the last at the end. All samples
    within the margin of a plane belong to it, whenever the tool passed and however far from the
    line, so that a sample counts by the time that the tool spent there.

    Args:
        position: Positions of the tool [m], shape (n, 3).
        line: The line, in the same frame.
        planes: Number of planes.
        margin: Greatest distance of a sample from its plane [m].

    Raises:
        DataFileError: If no sample is in any plane.

    Source:
        Null-space paper, eq. (15) and Appendix A.1. It assumes a sample in each plane. Planes
        without one, because the run ended early or the tool was too fast, are left out here;
        `Accuracy.planes_met` is the number of the others.

    >>> line = Line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    >>> path = np.array([[x, 0.02, 0.0] for x in np.linspace(-0.1, 1.1, 3000)])
    >>> round(trajectory_accuracy(path, line).worst, 4)
    0.02
    """
    points = np.asarray(position, dtype=np.float64)
    fractions = np.linspace(0.0, 1.0, planes)
    along = line.fraction_at(points) * line.length
    # Rounding must not exclude a sample at the margin.
    inside = np.abs(along[:, None] - fractions * line.length) <= margin + 1e-12
    count = inside.sum(axis=0)
    if not count.any():
        raise DataFileError(
            f"none of {len(points)} samples is within {margin:g} m of a plane of the line. Give "
            "positions in the line's frame, in metres."
        )
    met = count > 0
    barycentre = np.full((planes, 3), np.nan)
    barycentre[met] = (inside.T[met] @ points) / count[met, None]
    off = np.linalg.norm(barycentre - line.at(fractions), axis=1)
    return Accuracy(float(np.nanmax(off)), barycentre, int(met.sum()))


def completion_time(
    time: FloatArray, position: FloatArray, line: Line, *, radius: float
) -> float | None:
    """Return the time until the tool first enters the sphere at the end of the line [s].

    Args:
        time: Times of the samples [s], shape (n,).
        position: Positions of the tool [m], shape (n, 3).
        line: The line.
        radius: Radius of the sphere [m].

    Returns:
        Time since the first sample, None if the tool does not enter the sphere.

    Source:
        Null-space paper, Appendix A.2.
    """
    there = np.linalg.norm(np.asarray(position) - np.asarray(line.end), axis=1) <= radius
    return float(time[int(np.argmax(there))] - time[0]) if there.any() else None


def effort(time: FloatArray, hand: FloatArray, *, mass: float = DEVICE_MASS) -> float:
    """Return the mean absolute work on the device from one sample to the next [J].

    Args:
        time: Times of the samples [s], equally spaced, shape (n,), n >= 3.
        hand: Positions of the device [m], shape (n, 3).
        mass: Mass of the device [kg].

    Raises:
        DataFileError: If there are fewer than three samples.

    Source:
        Null-space paper, eq. (16): the mean of `work_steps`.
    """
    return float(work_steps(time, hand, mass=mass).mean())


def work_steps(time: FloatArray, hand: FloatArray, *, mass: float = DEVICE_MASS) -> FloatArray:
    """Return the absolute work on the device from one sample to the next [J], shape (n - 2,).

    Step i belongs to sample i + 1: the velocity changes there.

    Args:
        time: Times of the samples [s], equally spaced, shape (n,), n >= 3.
        hand: Positions of the device [m], shape (n, 3).
        mass: Mass of the device [kg].

    Raises:
        DataFileError: If there are fewer than three samples.

    Source:
        Null-space paper, eq. (16): W = m (dv / dt) . ds, absolute value. The paper does not specify
        the time of v between two samples; here v is the mean over a step, and ds the mean of the
        two steps between which v changes.
    """
    _at_least(len(time), 3)
    steps = np.diff(np.asarray(hand, dtype=np.float64), axis=0)
    dt = np.diff(time)[:, None]
    force = mass * np.diff(steps / dt, axis=0) / (0.5 * (dt[1:] + dt[:-1]))
    displacement = 0.5 * (steps[1:] + steps[:-1])
    return np.asarray(np.abs((force * displacement).sum(axis=1)))


def steering_angle(roll_pitch_yaw: FloatArray) -> float:
    """Return the total rotation of the device [rad].

    Args:
        roll_pitch_yaw: Orientations of the device [rad], shape (n, 3); jumps by full turns are
            ignored.

    Source:
        ITCM thesis, eqs. (28) and (29), with absolute differences: the printed sum of signed
        differences reduces to the difference between the last and the first angles.

    >>> steering_angle(np.array([[0.0, 0, 0], [0.5, 0, 0], [0.0, 0, 0.2]]))
    1.2
    """
    angles = np.unwrap(np.asarray(roll_pitch_yaw, dtype=np.float64), axis=0)
    return float(np.abs(np.diff(angles, axis=0)).sum())


def steering_translation(hand: FloatArray) -> float:
    """Return the total translation of the device [m]: ITCM thesis, eq. (30).

    Args:
        hand: Positions of the device [m], shape (n, 3).

    >>> steering_translation(np.array([[0.0, 0, 0], [3.0, 4.0, 0], [0.0, 0, 0]]))
    10.0
    """
    steps = np.diff(np.asarray(hand, dtype=np.float64), axis=0)
    return float(np.linalg.norm(steps, axis=1).sum())


def spectral_arc_length(speed: FloatArray, rate: float, *, cutoff: float = ARC_CUTOFF) -> float:
    """Return the spectral arc length of a speed profile: closer to zero for smoother motion.

    Args:
        speed: Absolute speeds, equally spaced in time, shape (n,), not all zero.
        rate: Sampling rate [1/s].
        cutoff: Highest frequency considered [Hz]; at most half the rate.

    Raises:
        DataFileError: If all speeds are zero, or the cutoff is above half the rate.

    Source:
        ITCM thesis, Appendix F.3, after Balasubramanian, Melendez-Calderon, Burdet, IEEE Trans.
        Biomed. Eng. 59 (2012): the negative length of the curve of Fourier magnitude, normalised by
        its value at frequency 0, over frequency, normalised by the cutoff.
    """
    values = np.asarray(speed, dtype=np.float64)
    _at_least(len(values), 2)
    if cutoff > 0.5 * rate:
        raise DataFileError(
            f"spectral arc length up to {cutoff:g} Hz at {rate:g} samples a second. Record at "
            f"{2.0 * cutoff:g} samples a second or more, or lower the cutoff."
        )
    if not np.any(values):
        raise DataFileError(
            "spectral arc length: the hand did not move. Give a recording with motion."
        )
    points = 2 ** (int(np.ceil(np.log2(len(values)))) + _PAD_LEVEL)
    magnitude = np.abs(np.fft.rfft(values, points))
    frequency = np.fft.rfftfreq(points, 1.0 / rate)
    # The curve ends at the cutoff, which may lie between frequencies of the transform.
    kept = np.append(frequency[frequency < cutoff], cutoff)
    curve = np.interp(kept, frequency, magnitude) / magnitude[0]
    return -float(np.hypot(np.diff(kept) / cutoff, np.diff(curve)).sum())


def resampled(
    time: FloatArray, values: FloatArray, *, rate: float = RESAMPLED_RATE, cutoff: float = CUTOFF
) -> tuple[FloatArray, FloatArray]:
    """Return a recording after a low-pass filter, resampled at another rate.

    Args:
        time: Times of the samples [s], equally spaced, shape (n,).
        values: Recorded values, shape (n, ...).
        rate: Sampling rate of the result [1/s].
        cutoff: Cutoff frequency of the filter [Hz]; a recording of at most twice that rate contains
            no higher frequencies, and is not filtered.

    Returns:
        Times [s] and values, interpolated linearly between the filtered samples.

    Raises:
        DataFileError: If there are fewer than 16 samples.

    Source:
        ITCM thesis, Appendix F.1: a second-order Butterworth filter, applied forward and backward
        for zero delay, then linear interpolation.
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
    # The last time may exceed that of the recording by rounding.
    line = make_interp_spline(time, smooth, k=1, axis=0)
    return wanted, np.asarray(line(np.minimum(wanted, time[-1])))


def _at_least(count: int, least: int) -> None:
    if count < least:
        raise DataFileError(f"a recording of {count} samples; at least {least} are needed.")
