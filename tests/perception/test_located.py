"""Poses on the floor, and the files of tables and scans."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tcs.errors import DataFileError, EnvironmentFileError, PerceptionError
from tcs.perception import (
    TIAGO,
    Located,
    PlanarPose,
    load_located,
    load_table,
    read_scans,
    write_scans,
)
from tests.perception.example import HIGH, legs_of, scanned, square_table

COVARIANCE = np.array([[4e-4, 1e-4, 1e-4], [1e-4, 2e-4, -5e-5], [1e-4, -5e-5, 1e-3]]) * 1e-2


def sampled(map_pose):
    """Return the covariance of a pose that is made from a table with an error."""
    rng = np.random.default_rng(0)
    errors = rng.multivariate_normal(np.zeros(3), COVARIANCE, 20_000)
    nominal = PlanarPose(1.0, 0.4, 0.7)
    poses = [map_pose(PlanarPose(1.0 + a, 0.4 + b, 0.7 + c)) for a, b, c in errors]
    rows = np.array([[p.x, p.y, p.yaw] for p in poses])
    return map_pose(nominal), np.cov(rows.T)


def test_covariances_are_those_of_samples():
    found = Located("thesis", PlanarPose(1.0, 0.4, 0.7), COVARIANCE)
    task, step = PlanarPose(0.3, -2.0, -1.1), PlanarPose(0.1, 0.3, 0.2)
    base, covariance = found.base_in(task)
    expected, samples = sampled(lambda pose: task @ pose.inverse())
    assert base == expected
    # 20,000 samples give variances to 1 %; first order leaves out the curvature.
    np.testing.assert_allclose(covariance, samples, rtol=0.05, atol=3e-8)
    _, samples = sampled(lambda pose: pose @ step)
    np.testing.assert_allclose(found.shifted(step).covariance, samples, rtol=0.05, atol=3e-8)
    _, samples = sampled(lambda pose: PlanarPose(1.0, 0.4, 0.7).inverse() @ pose)
    np.testing.assert_allclose(found.in_task_frame(), samples, rtol=0.05, atol=3e-8)


def test_a_located_table_is_read_as_it_was_written(tmp_path):
    found = Located("thesis", PlanarPose(1.0, 0.4, 0.7), COVARIANCE)
    found.save(tmp_path / "a.json")
    read = load_located(tmp_path / "a.json")
    assert read.table == "thesis"
    assert read.pose.yaw == pytest.approx(0.7, abs=1e-9)
    np.testing.assert_array_equal(read.covariance, COVARIANCE)


@pytest.mark.parametrize(
    "changed",
    [
        {"covariance": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]},
        {"covariance": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]},
        {"covariance": [[1e6, 0, 0], [0, 1, 0], [0, 0, 1]]},
        {"covariance": [[1e308, 0, 0], [0, 1e308, 0], [0, 0, 1]]},
        {"covariance": [1, 2, 3]},
        {"pose": {"x": 1}},
    ],
)
def test_a_damaged_file_is_refused(changed, tmp_path):
    content = {
        "table": "t", "pose": {"x": 0, "y": 0, "yaw_deg": 0}, "covariance": np.eye(3).tolist(),
        **changed,
    }  # fmt: skip
    (tmp_path / "a.json").write_text(json.dumps(content))
    with pytest.raises((DataFileError, PerceptionError)):
        load_located(tmp_path / "a.json")


def test_scans_are_read_as_they_were_written(tmp_path):
    scans = scanned(*legs_of(load_table("thesis"), HIGH))
    write_scans(tmp_path / "scans.csv", scans)
    read = read_scans(tmp_path / "scans.csv", TIAGO)
    # Written to a tenth of a millimetre.
    np.testing.assert_allclose(read.ranges, scans.ranges, atol=6e-5)


@pytest.mark.parametrize(
    ("text", "message"), [("", "empty"), ("1,2\n", "683 beams"), ("1,a\n", "must be numbers")]
)
def test_scans_of_another_form_are_refused(text, message, tmp_path):
    (tmp_path / "scans.csv").write_text(text)
    with pytest.raises(PerceptionError, match=message):
        read_scans(tmp_path / "scans.csv", TIAGO)


def test_a_table_stands_on_its_legs():
    top, *legs = load_table("thesis").boxes(PlanarPose(0.0, 0.0, 0.0))
    assert top["xyz"][2] + top["box"][2] / 2 == pytest.approx(0.37)
    for leg in legs:
        assert leg["xyz"][2] == pytest.approx(leg["box"][2] / 2)
        assert leg["box"][2] + top["box"][2] == pytest.approx(0.37)


def test_an_impossible_table_is_refused(tmp_path):
    content = square_table().model_dump()
    for changed in ({"thickness": 1.0}, {"legs": [content["legs"][0]] * 2}, {"legs": []}):
        path = tmp_path / "table.yaml"
        path.write_text(json.dumps({**content, **changed}))
        with pytest.raises(EnvironmentFileError, match="table file"):
            load_table(path)
