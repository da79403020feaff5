"""The metrics against closed forms, and on paths with an obvious result."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from tcs.errors import DataFileError
from tcs.teleop.line import Line
from tcs_studies.experiment.metrics import (
    DEVICE_MASS,
    completion_time,
    effort,
    resampled,
    spectral_arc_length,
    steering_angle,
    steering_translation,
    trajectory_accuracy,
)

LINE = Line((0.4, -0.2, 0.9), (-0.4, 0.4, 0.9))


def along(shares, off=(0.0, 0.0, 0.0)):
    return LINE.at(np.asarray(shares)) + np.asarray(off)


def test_on_the_line_the_error_is_that_of_sampling():
    found = trajectory_accuracy(along(np.linspace(0, 1, 2001)), LINE)
    # Samples 0.5 mm apart: the mean of those within 5 mm is at most a step off; at both ends the
    # plane has samples on one side only, with a mean offset of 2.5 mm.
    assert found.worst == pytest.approx(0.0025, abs=0.0005)
    assert found.planes_met == 30


def test_a_path_beside_the_line_has_its_distance_as_error():
    sideways = np.array([0.6, 0.8, 0.0])
    assert sideways @ LINE.direction == pytest.approx(0.0, abs=1e-12)
    path = along(np.linspace(-0.1, 1.1, 5001), 0.03 * sideways)
    # Planes are 34 mm apart and samples 0.24 mm: means are that close to the plane.
    assert trajectory_accuracy(path, LINE).worst == pytest.approx(0.03, abs=1e-5)


def test_barycentre_is_the_mean_over_all_passes():
    up, once = np.array([0.0, 0.0, 0.1]), np.linspace(-0.1, 1.1, 4001)
    there_and_back = np.concatenate([along(once, up), along(once[::-1], -up), along(once, up)])
    found = trajectory_accuracy(there_and_back, LINE)
    assert found.worst == pytest.approx(0.1 / 3.0, abs=1e-4)
    np.testing.assert_allclose(found.barycentre[:, 2], 0.9 + 0.1 / 3.0, atol=1e-6)


def test_planes_are_equally_spaced_from_start_to_end():
    shares = np.linspace(0, 1, 30)
    found = trajectory_accuracy(along(shares), LINE)
    np.testing.assert_allclose(found.barycentre, along(shares), atol=1e-12)
    assert found.worst == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("off", "met"), [(0.0049, 1), (0.0051, 0)])
def test_a_plane_contains_the_samples_within_5_mm(off, met):
    first = along([0.0])
    near = along([0.0]) + off * LINE.direction
    if met:
        assert trajectory_accuracy(near, LINE).planes_met == 1
    else:
        with pytest.raises(DataFileError, match=r"none of 1 samples is within 0.005 m"):
            trajectory_accuracy(near, LINE)
    assert trajectory_accuracy(first, LINE).worst == pytest.approx(0.0, abs=1e-12)


def test_planes_without_samples_are_left_out():
    found = trajectory_accuracy(along(np.linspace(0, 0.5, 2001), (0, 0, 0.02)), LINE)
    assert found.planes_met == 15
    assert np.isnan(found.barycentre[15:]).all()
    # Half of the last plane's samples are missing; sampling adds at most 2.5 mm along the line.
    assert found.worst == pytest.approx(math.hypot(0.02, 0.0025), abs=2e-4)


def test_moving_everything_changes_no_accuracy():
    rng = np.random.default_rng(5)
    path = along(np.linspace(0, 1, 1500)) + 0.02 * rng.standard_normal((1500, 3))
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    R = q * np.sign(np.diag(r))
    p = rng.standard_normal(3)
    moved = Line(tuple(R @ LINE.start + p), tuple(R @ LINE.end + p))
    here = trajectory_accuracy(path, LINE)
    there = trajectory_accuracy(path @ R.T + p, moved)
    # A sample right at a margin may fall to either side; at this seed none does.
    assert there.worst == pytest.approx(here.worst, abs=1e-12)


@pytest.mark.parametrize(
    ("start", "end"), [((0, 0, 0), (0, 0, 0)), ((0, 0, 0), (0, math.nan, 1)), ((0, 0), (1, 1))]
)
def test_a_line_to_nowhere_is_refused(start, end):
    with pytest.raises(DataFileError, match="both ends must be"):
        Line(start, end)


def test_time_ends_when_the_tool_first_comes_near_the_end():
    time = 10.0 + np.linspace(0, 8, 801)
    path = along(np.linspace(0, 1, 801))
    # 1 m in 8 s: 0.02 m before the end after 7.84 s, seen at the next sample.
    assert completion_time(time, path, LINE, radius=0.02) == pytest.approx(7.84, abs=0.011)
    assert completion_time(time, path[:600], LINE, radius=0.02) is None


def test_effort_of_a_swinging_hand():
    time = np.arange(0, 20.0, 0.01)
    swing, w = 0.05, 2 * np.pi * 0.5
    hand = np.zeros((len(time), 3))
    hand[:, 1] = swing * np.sin(w * time)
    # m a . v dt = m A^2 w^3 |sin cos| dt, whose mean over whole periods is 1 / pi of the factor.
    exact = DEVICE_MASS * swing**2 * w**3 * 0.01 / np.pi
    # Differences at 100 Hz are off by (w dt)^2 / 6, 2e-4 here; the ends by a sample in 2000.
    assert effort(time, hand) == pytest.approx(exact, rel=2e-3)


def test_a_steady_hand_takes_no_effort():
    time = np.arange(0, 5.0, 0.01)
    assert effort(time, np.outer(time, [0.1, 0.2, 0.0])) == pytest.approx(0.0, abs=1e-12)


def test_effort_grows_with_the_square_of_the_distance_and_with_mass():
    rng = np.random.default_rng(1)
    time = np.arange(0, 5.0, 0.01)
    hand = np.cumsum(rng.standard_normal((500, 3)), axis=0) * 1e-4
    assert effort(time, 2 * hand) == pytest.approx(4 * effort(time, hand))
    assert effort(time, hand, mass=0.5) == pytest.approx(effort(time, hand) * 0.5 / DEVICE_MASS)


def test_steering_counts_both_ways_and_no_jumps():
    there = np.linspace(0.0, 1.0, 50)
    roll = np.concatenate([there, there[::-1]])
    angles = np.zeros((100, 3))
    angles[:, 0] = roll
    # As printed, eq. (29) would give 0.
    assert steering_angle(angles) == pytest.approx(2.0)
    angles[:, 2] = np.where(np.arange(100) < 50, np.pi - 0.01, -np.pi + 0.01)
    assert steering_angle(angles) == pytest.approx(2.02)


def test_steering_translation_of_a_circle():
    angle = np.linspace(0, 2 * np.pi, 1001)
    circle = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert steering_translation(circle) == pytest.approx(0.2 * np.pi, rel=1e-5)


def test_spectral_arc_length_of_a_bell():
    width, rate, cutoff = 0.1, 200.0, 20.0
    time = np.arange(-3, 3, 1 / rate)
    # Its spectrum, divided by that at 0, is a bell, too.
    speed = np.exp(-0.5 * (time / width) ** 2)

    def slope(f):
        factor = (2 * np.pi * width) ** 2
        return factor * f * np.exp(-0.5 * factor * f * f)

    exact, _ = quad(lambda f: math.hypot(1 / cutoff, slope(f)), 0, cutoff, epsabs=1e-10)
    # Chords of a curve sampled every 6 mHz are that much shorter.
    assert spectral_arc_length(speed, rate) == pytest.approx(-exact, rel=1e-5)


def test_spectral_arc_length_distinguishes_smooth_from_jerky_at_any_speed():
    time = np.arange(0, 2, 0.01)
    smooth = np.sin(np.pi * time / 2) ** 2
    jerky = smooth * (1 + 0.8 * np.sin(2 * np.pi * 5 * time))
    assert spectral_arc_length(jerky, 100) < spectral_arc_length(smooth, 100) - 0.5
    assert spectral_arc_length(7 * jerky, 100) == pytest.approx(spectral_arc_length(jerky, 100))


def test_spectral_arc_length_refuses_what_has_no_spectrum():
    with pytest.raises(DataFileError, match="Record at 40 samples a second"):
        spectral_arc_length(np.ones(100), 30.0)
    with pytest.raises(DataFileError, match="did not move"):
        spectral_arc_length(np.zeros(100), 100.0)


def test_resampling_has_no_delay_and_keeps_the_frequencies_of_a_hand():
    time = np.arange(0, 10, 1e-3)
    slow, fast = np.sin(2 * np.pi * 2 * time), 0.5 * np.sin(2 * np.pi * 200 * time)
    wanted, values = resampled(time, np.column_stack([slow + fast, slow]))
    assert len(wanted) == 500
    np.testing.assert_allclose(np.diff(wanted), 0.02, atol=1e-12)
    middle = slice(20, -20)
    truth = np.sin(2 * np.pi * 2 * wanted)
    # Twice second order at 50 Hz leaves 1 / (1 + 4**4) = 0.4 % of 200 Hz and all but 3e-6 of 2 Hz.
    np.testing.assert_allclose(values[middle, 0], truth[middle], atol=0.004)
    np.testing.assert_allclose(values[middle, 1], truth[middle], atol=1e-4)


def test_a_slow_recording_is_only_interpolated():
    time = np.arange(0, 2, 0.01)
    values = np.random.default_rng(0).standard_normal(200)
    wanted, found = resampled(time, values)
    np.testing.assert_allclose(found, values[::2], atol=1e-9)
    np.testing.assert_allclose(wanted, time[::2], atol=1e-12)


def test_too_short_a_recording_is_refused():
    with pytest.raises(DataFileError, match="2 samples; at least 16 are needed"):
        resampled(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
