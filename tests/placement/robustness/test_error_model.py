"""The error model: moments, named streams and refused input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tcs.errors import DataFileError, EnvironmentFileError, TcsError, UnknownNameError
from tcs.model.random_streams import named_generator
from tcs.model.scene import ErrorDistribution
from tcs.placement.robustness import ErrorModel

NORMAL = ErrorDistribution(distribution="normal", std=0.05)
TILT = ErrorDistribution(distribution="normal", std_deg=5.0)
EVEN = ErrorDistribution(distribution="uniform", half_width=0.02)
MODEL = ErrorModel({"person_x": NORMAL, "head_tilt": TILT, "wheelchair_y": EVEN}, "made up")
MANY = 20_000


@pytest.fixture
def many():
    return MODEL.draw(MANY, 0)


def test_the_errors_of_the_environments_are_table_ii(chair_trials, bed_trials):
    widths = {
        name: (error.distribution, error.standard_deviation)
        for name, error in chair_trials.errors.errors.items()
    }
    turn, tilt = math.radians(2.5), math.radians(5.0)
    expected = {"wheelchair_x": 0.0125, "wheelchair_y": 0.0125, "wheelchair_yaw": turn}
    expected |= {"person_x": 0.05, "person_y": 0.05, "person_yaw": tilt, "head_tilt": tilt}
    assert widths == {name: ("normal", sd) for name, sd in expected.items()}
    assert {n: e.standard_deviation for n, e in bed_trials.errors.errors.items()} == {
        "person_x": 0.05,
        "person_y": 0.05,
    }


@pytest.mark.parametrize("name", MODEL.errors)
def test_moments(many, name):
    drawn, sd = many[name], MODEL.errors[name].standard_deviation
    # Four standard errors of each moment, exceeded once in 10,000 by a correct sampler.
    assert abs(drawn.mean()) < 4 * sd / math.sqrt(MANY)
    assert abs(drawn.std() / sd - 1) < 4 / math.sqrt(2 * MANY)
    assert abs(stats.skew(drawn)) < 4 * math.sqrt(6 / MANY)


def test_distributions(many):
    tilt = stats.kstest(many["head_tilt"] / math.radians(5.0), "norm")
    even = stats.kstest(many["wheelchair_y"], stats.uniform(-0.02, 0.04).cdf)
    # p below 0.001 occurs once in a thousand for a correct sampler; the seed is fixed.
    assert min(tilt.pvalue, even.pvalue) > 1e-3
    assert np.abs(many["wheelchair_y"]).max() <= 0.02


def test_joints_and_neighbours_in_a_stream_are_independent(many):
    names = list(many)
    least = 4 / math.sqrt(MANY)  # four standard errors of zero correlation
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            assert abs(np.corrcoef(many[first], many[second])[0, 1]) < least
        for other in (MODEL.draw(MANY, 1), MODEL.draw(MANY, 0, stream="another")):
            assert abs(np.corrcoef(many[first], other[first])[0, 1]) < least
        assert abs(np.corrcoef(many[first][1:], many[first][:-1])[0, 1]) < least


def test_same_seed_same_numbers(many):
    again = MODEL.draw(MANY, 0)
    assert all(np.array_equal(many[name], again[name]) for name in many)


def test_fewer_samples_are_the_first_of_more(many):
    few = MODEL.draw(100, 0)
    assert all(np.array_equal(few[name], many[name][:100]) for name in few)


def test_adding_a_joint_does_not_change_the_others(many):
    more = ErrorModel({"person_y": NORMAL, **MODEL.errors}, "made up").draw(MANY, 0)
    assert all(np.array_equal(more[name], many[name]) for name in many)


def test_names_with_a_common_prefix_have_separate_streams():
    names = ["", "a", "aa", "aaaaaaaa", "aaaa", "b", "/a", "a/", "person_x", "person_xx"]
    first = {float(named_generator(0, name).standard_normal()) for name in names}
    assert len(first) == len(names)


def test_names_with_equal_checksums_have_separate_streams():
    # Two words with the same CRC-32.
    one, other = (named_generator(0, name).standard_normal() for name in ("plumless", "buckeroo"))
    assert one != other


def test_a_file_replaces_the_errors_of_the_environment(chair_trials, tmp_path):
    path = tmp_path / "errors.yaml"
    path.write_text(
        "source: measured\n"
        "errors:\n"
        "  person_x: {distribution: uniform, half_width: 0.03}\n"
        "  head_tilt: {distribution: normal, std_deg: 10}\n"
    )
    model = ErrorModel.of(chair_trials.scene, path)
    assert model.source == "measured"
    assert model.errors["person_x"].standard_deviation == pytest.approx(0.03 / math.sqrt(3))
    assert model.errors["head_tilt"].standard_deviation == pytest.approx(math.radians(10))
    assert model.to_json()["person_x"] == {"distribution": "uniform", "half_width": 0.03}


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        (
            "errors: {persn_x: {distribution: normal, std: 0.1}}",
            UnknownNameError,
            "Did you mean 'person_x'",
        ),
        ("errors: {person_x: {distribution: normal, std: -0.1}}", DataFileError, "std.*is -0.1"),
        ("errors: {person_x: {distribution: normal, std_deg: 5}}", EnvironmentFileError, "'std'"),
        ("errors: {head_tilt: {distribution: uniform, half_width: 1}}", DataFileError, "width_deg"),
        ("errors: {person_x: {distribution: cauchy, std: 1}}", DataFileError, "'cauchy'"),
        ("errors: {person_x: {distribution: normal}}", DataFileError, "give either 'std'"),
        ("errors: {person_x: {distribution: uniform, std: 1}}", DataFileError, "'half_width'"),
        ("errors: {person_x: {distribution: normal, std: .inf}}", DataFileError, "finite"),
        ("errros: {}", UnknownNameError, "Did you mean 'errors'"),
        ("- 1", DataFileError, "must contain keys and values"),
    ],
    ids=lambda value: value if isinstance(value, str) and ":" in value else "",
)
def test_bad_files_are_refused_in_one_line(chair_trials, tmp_path, text, error, message):
    path = tmp_path / "errors.yaml"
    path.write_text(text)
    with pytest.raises(error, match=message) as caught:
        ErrorModel.of(chair_trials.scene, path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_joint_that_follows_another_is_refused(bed_trials):
    with pytest.raises(EnvironmentFileError, match="follows 'head_rest'"):
        ErrorModel.of(bed_trials.scene, {"neck_body": TILT})


@pytest.mark.parametrize(("samples", "seed"), [(0, 0), (-1, 0), (10**9, 0), (1, -1), (1, 2**64)])
def test_numbers_out_of_range_are_refused(samples, seed):
    with pytest.raises(TcsError, match="must be"):
        MODEL.draw(samples, seed)


def test_an_environment_without_errors_is_refused(chair_trials):
    with pytest.raises(TcsError, match="error file"):
        ErrorModel.of(chair_trials.scene, {}).draw(10, 0)
