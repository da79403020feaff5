"""Findings in words: what is reported, what is left out, and how numbers are rounded."""

from __future__ import annotations

import pytest

from tcs.output.words import p_value, percent, signed
from tcs.placement.tables import Reason
from tcs_studies.output.words import goes_with, lost_goal, stopped_by
from tcs_studies.robustness.losses import Loss


def loss(reasons, pair=None, pair_fraction=0.0, standardized_error=-1.26):
    return Loss(
        goal=3, body_frame="forearm_left", success=0.625, member=0, reasons=reasons, pair=pair,
        pair_fraction=pair_fraction, joint="person_y", standardized_error=standardized_error,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("p", "text"),
    [(0.0, "< 0.0001"), (9.9e-5, "< 0.0001"), (1e-4, "0.0001"), (0.00312, "0.0031"), (0.5, "0.5")],
)
def test_a_p_is_a_number_down_to_a_ten_thousandth(p, text):
    assert p_value(p) == text


def test_reasons_are_reported_from_one_in_twenty_on():
    text = stopped_by(
        loss({Reason.ARM_BLOCKED: 0.91, Reason.TOO_FAR: 0.05, Reason.JOINT_LIMITS: 0.04})
    )
    assert text == "every arm posture would touch something (91 %), too far for the arm (5 %)"


@pytest.mark.parametrize(("share", "is_stated"), [(0.19, False), (0.2, True), (1.0, True)])
def test_a_pair_is_reported_if_it_collides_in_one_of_five_samples(share, is_stated):
    pair = ("l_forearm_link", "bed::pillow")
    text = stopped_by(loss({Reason.ARM_BLOCKED: 1.0}, pair, share))
    assert text.endswith("; most often l forearm and pillow") == is_stated


def test_a_lost_goal_is_a_sentence():
    assert lost_goal(loss({Reason.TOO_FAR: 1.0})) == (
        "Goal 4 (forearm left) is reached in 62.5 % of the samples; in the others: too far for the "
        "arm (100 %)."
    )


@pytest.mark.parametrize(("tilt", "text"), [(-1.26, "person y -1.3"), (0.84, "person y +0.8")])
def test_an_error_is_reported_with_its_side(tilt, text):
    assert goes_with(loss({Reason.TOO_FAR: 1.0}, standardized_error=tilt)) == text


def test_percentages_and_points():
    assert (percent(0.98407), percent(0.5, 0)) == ("98.4", "50")
    assert (signed(2.349), signed(-0.04), signed(-0.06)) == ("+2.3", "0.0", "-0.1")
