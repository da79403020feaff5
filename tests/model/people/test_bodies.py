"""Body measures: distributions, correlations, what is filled in, and what is refused."""

import numpy as np
import pytest
from scipy.stats import norm, rankdata

from tcs.errors import DataFileError, TcsError, UnknownNameError
from tcs.model.people import SEXES, body, draw_bodies, load_survey

MEDIAN = 1e-12
"""Rounding of a percentile that passes through the normal distribution."""


@pytest.mark.parametrize("sex", SEXES)
def test_drawn_bodies_have_the_distribution_of_the_survey(sex):
    survey, drawn = load_survey(sex), draw_bodies(20_000, sex=sex, seed=1)
    for percentile in (5, 50, 95):
        column = int(np.argmin(abs(survey.scores - norm.ppf(percentile / 100))))
        found = np.percentile(drawn.values, percentile, axis=0)
        np.testing.assert_allclose(found, survey.quantiles[:, column], rtol=0.015)
    ranks = np.apply_along_axis(rankdata, 0, drawn.values)
    found = np.corrcoef(norm.ppf((ranks - 0.5) / len(drawn)).T)
    assert abs(found - survey.correlation).max() < 0.03


def test_what_is_not_known_is_the_mean_of_people_like_that():
    # Among drawn people with about these two measures, the normal scores of the others.
    survey, drawn = load_survey("male"), draw_bodies(40_000, sex="male", seed=2)
    given = {"stature": 90.0, "waist depth": 20.0}
    found = body("male", percentiles=given)
    near = np.ones(len(drawn), bool)
    for name, percentile in given.items():
        column = drawn.values[:, survey.index(name)]
        low, high = np.percentile(column, (percentile - 2.5, percentile + 2.5))
        near &= (column >= low) & (column <= high)
    assert near.sum() > 50
    # The median of so few scatters by about a seventh of a standard deviation.
    medians = np.median(drawn.values[near], axis=0)
    spread = np.percentile(drawn.values, 84, axis=0) - np.percentile(drawn.values, 50, axis=0)
    off = (medians - np.array(list(found.measures.values()))) / spread
    assert np.sqrt(np.mean(off**2)) < 0.2
    assert abs(off).max() < 0.7


def test_with_nothing_known_every_measure_is_the_median():
    found = body("female")
    np.testing.assert_allclose(list(found.percentiles.values()), 50.0, rtol=MEDIAN)
    assert (found.stature, found.mass) == (1.626, 66.8)


def test_what_is_known_is_kept():
    found = body("male", percentiles={"mass": 95}, measures={"shoulder-elbow length": 0.4})
    assert found.mass == pytest.approx(110.695, rel=1e-12)
    assert found.measures["shoulderelbowlength"] == 0.4
    again = body("male", measures=found.measures)
    assert again.measures == found.measures


def test_depth_of_the_abdomen_hardly_follows_stature():
    # Correlation 0.14 in the survey: uniform scaling would give the 99th percentile.
    found = body("male", percentiles={"stature": 99})
    assert 55 < found.percentiles["abdominalextensiondepthsitting"] < 70
    assert found.percentiles["kneeheightsitting"] > 95


def test_bodies_are_the_same_for_the_same_seed_and_prefix():
    few, many = draw_bodies(10, seed=3), draw_bodies(50, seed=3)
    # Products of matrices of different sizes round differently.
    np.testing.assert_allclose(many.values[:10], few.values, rtol=1e-12)
    assert (many.is_male[:4] == [False, True, False, True]).all()
    assert (draw_bodies(10, seed=4).values != few.values).any()
    assert few[1].sex == "male"
    np.testing.assert_allclose(list(few[1].measures.values()), few.values[1])


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"percentiles": {"staure": 50}}, UnknownNameError, "Did you mean 'stature'"),
        ({"percentiles": {"stature": 100}}, DataFileError, "must be 0.1 to 99.9"),
        ({"percentiles": {"stature": float("nan")}}, DataFileError, "must be 0.1 to 99.9"),
        ({"measures": {"stature": 17.0}}, DataFileError, "must be 1.47 to 2.06 m"),
        ({"measures": {"mass": float("inf")}}, DataFileError, "kg for an adult"),
        (
            {"measures": {"mass": 80}, "percentiles": {"weightkg": 50}},
            DataFileError,
            "given twice",
        ),
    ],
)
def test_what_cannot_be_used_is_refused(given, error, message):
    with pytest.raises(error, match=message):
        body("male", **given)


def test_unknown_sexes_and_odd_numbers_are_refused():
    for call in (lambda: body("both"), lambda: draw_bodies(3, sex="both")):
        with pytest.raises(UnknownNameError, match="sex"):
            call()
    with pytest.raises(TcsError, match="samples"):
        draw_bodies(0)
