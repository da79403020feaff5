"""Tables in scans: found where they are, with an error that the covariance predicts, or refused."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import PerceptionError, UnknownNameError
from tcs.perception import TIAGO, LaserScanner, PlanarPose, Scans, locate
from tests.perception.example import (
    DEGREE,
    HIGH,
    THESIS,
    exact,
    legs_of,
    scanned,
    square_table,
)

POSES = {
    "ITCM-high": HIGH,
    "turned": PlanarPose(1.1, -0.4, 0.5),
    "from the side": PlanarPose(0.55, -0.35, -np.pi / 2),
    "far": PlanarPose(2.2, 0.5, -0.4),
}


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
def test_without_errors_the_table_is_found_to_the_spacing_of_the_beams(pose):
    error = locate(exact(*legs_of(THESIS, pose)), THESIS).error(pose)
    # A silhouette is between two beams: 6 mm at 1 m, less with several legs.
    assert error["position"] < 0.006 * max(1.0, pose.x)
    assert abs(error["yaw_deg"]) < 0.5


def test_errors_are_as_the_covariance_predicts():
    squares = []
    for run in range(12):
        pose = PlanarPose(0.8 + 0.02 * run, 0.2 - 0.03 * run, 0.04 * run)
        found = locate(scanned(*legs_of(THESIS, pose), run=run), THESIS)
        squares.append(found.error(pose)["mahalanobis"] ** 2)
    # Chi-square of three degrees of freedom has mean 3; that of 12 has a deviation of 0.71. The
    # lower bound allows for silhouettes, whose deviation is that of beams with a width.
    assert 0.3 < np.mean(squares) < 3.0 + 4 * 0.71


def test_more_scans_do_not_average_the_offset():
    boxes = legs_of(THESIS, POSES["far"])
    few, many = (locate(scanned(*boxes, scans=n), THESIS).std for n in (2, 50))
    assert many[0] < few[0]
    one_beam = TIAGO.deviation(np.array([2.2]))[0] / np.sqrt(50 * 20)
    assert many[0] > one_beam


def test_moving_the_scanner_moves_the_table():
    table = PlanarPose(1.5, 0.3, 0.2)
    here = PlanarPose(0.2, -0.1, 0.15)
    first = locate(exact(*legs_of(THESIS, table)), THESIS).pose
    second = here @ locate(exact(*legs_of(THESIS, here.inverse() @ table)), THESIS).pose
    assert np.hypot(first.x - second.x, first.y - second.y) < 0.008
    assert abs(first.yaw - second.yaw) < 0.5 * DEGREE


@pytest.mark.parametrize("hidden", [0, 1])
def test_a_hidden_leg_is_reported_and_the_others_suffice(hidden):
    boxes = legs_of(THESIS, HIGH)
    x, y, *_ = boxes[hidden]
    # A post just before the leg hides it from the scanner.
    s = np.array([TIAGO.x, 0.0])
    before = s + (np.array([x, y]) - s) * 0.75
    width = 0.28 if hidden == 0 else 0.09
    found = locate(exact(*boxes, (*before, np.arctan2(*(before - s)[::-1]), 0.02, width)), THESIS)
    assert found.legs[hidden][1] == 0
    assert found.error(HIGH)["position"] < 0.01


def test_legs_of_chairs_are_no_table():
    chair = [(0.9 + x, -0.2 + y, 0.3, 0.04, 0.04) for x in (0.0, 0.38) for y in (0.0, 0.4)]
    with pytest.raises(PerceptionError, match="No two of them are at the distance"):
        locate(scanned(*chair), THESIS)
    found = locate(scanned(*chair, *legs_of(THESIS, PlanarPose(1.6, 0.1, 0.0))), THESIS)
    assert found.error(PlanarPose(1.6, 0.1, 0.0))["position"] < 0.02


def test_two_blobs_take_a_chair_for_the_table_or_refuse():
    near = [(0.6, 0.1, 0.0, 0.04, 0.04), (0.6, -0.1, 0.0, 0.04, 0.04)]
    scans = scanned(*near, *legs_of(THESIS, PlanarPose(1.6, 0.1, 0.0)))
    with pytest.raises(PerceptionError, match=r"two nearest blobs are 0\.\d\d m apart"):
        locate(scans, THESIS, method="two-blobs")


def test_an_empty_scene_a_single_leg_and_a_leg_that_is_missing():
    with pytest.raises(PerceptionError, match="0 blobs"):
        locate(scanned(), THESIS)
    boxes = legs_of(THESIS, HIGH)
    with pytest.raises(PerceptionError, match="A single leg leaves the heading open"):
        locate(scanned(boxes[1]), THESIS)
    # Nothing hides the other three, so that this is another thing.
    with pytest.raises(PerceptionError, match="is not found"):
        locate(scanned(boxes[0]), THESIS)
    with pytest.raises(PerceptionError, match="nothing against it"):
        locate(scanned(boxes[1], boxes[3]), THESIS)


def test_a_square_table_is_found_in_four_poses_and_the_expected_one_is_chosen():
    table, pose = square_table(), PlanarPose(0.9, 0.1, 0.15)
    scans = exact(*legs_of(table, pose))
    found = locate(scans, table)
    assert found.error(pose)["position"] < 0.01
    assert len(found.alternatives) == 3
    middle = pose @ PlanarPose(0.35, 0.0, 0.0)
    for other in found.alternatives:
        at = other @ PlanarPose(0.35, 0.0, 0.0)
        assert np.hypot(at.x - middle.x, at.y - middle.y) < 0.01
    left = pose @ PlanarPose(0.35, 0.35, -np.pi / 2)
    assert locate(scans, table, expected=left).error(left)["position"] < 0.01


def test_two_blobs_have_the_bias_of_the_near_side():
    pose = PlanarPose(0.65, 0.1, 0.3)
    errors = [
        locate(scanned(*legs_of(THESIS, pose), run=run), THESIS, method=method).error(pose)
        for method in ("legs", "two-blobs")
        for run in range(3)
    ]
    errors = [error["position"] for error in errors]
    assert np.mean(errors[:3]) < 0.5 * np.mean(errors[3:]) < 0.03


def test_two_blobs_need_a_wider_leg():
    with pytest.raises(PerceptionError, match="equally wide"):
        locate(scanned(), square_table(), method="two-blobs")
    with pytest.raises(PerceptionError, match="no scan has two blobs"):
        locate(scanned(), THESIS, method="two-blobs")
    with pytest.raises(UnknownNameError, match="method"):
        locate(scanned(), THESIS, method="camera")


def test_a_beam_that_wavers_is_left_out():
    ranges = np.full((10, TIAGO.beams), 2.0)
    ranges[::2, 5] = 1.0
    ranges[:6, 7] = np.inf
    mean = Scans(TIAGO, ranges).mean()
    assert np.isnan(mean[5])
    assert np.isinf(mean[7])
    assert mean[6] == 2.0


@pytest.mark.parametrize(
    "values", [{"beams": 1}, {"noise": 0.0}, {"first": 1.0, "last": 0.0}, {"offset": 0.0}]
)
def test_an_impossible_scanner_is_refused(values):
    with pytest.raises(PerceptionError):
        LaserScanner(**values)
    with pytest.raises(PerceptionError, match="shape"):
        Scans(TIAGO, np.zeros((2, 3)))
