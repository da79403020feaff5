"""Statistics against the paper's own table, against sums written out, and against scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tcs.errors import DataFileError
from tcs_studies.experiment.comparison import ANOVA_MEASURES
from tcs_studies.experiment.statistics import (
    effect_size,
    group_statistics,
    kolmogorov_smirnov,
    repeated_measures,
    shapiro_francia,
    signed_rank_test,
)


def with_rank_sum(total: int, count: int) -> np.ndarray:
    """Return differences 1 .. count, signed such that the positive ones add up to a sum."""
    signs = -np.ones(count)
    for rank in range(count, 0, -1):
        if rank <= total:
            signs[rank - 1] = 1.0
            total -= rank
    assert total == 0
    return signs * np.arange(1.0, count + 1)


# T, tail, z and r of Table III of the null-space paper, N = 26.
PAPER = [
    (327, "greater", 3.8351, 0.5318),
    (172, "two-sided", -0.0889, -0.0123),
    (318, "greater", 3.6065, 0.5001),
]


@pytest.mark.parametrize(("total", "tail", "z", "effect"), PAPER)
def test_signed_ranks_give_the_papers_z_and_effect(total, tail, z, effect):
    found = signed_rank_test(with_rank_sum(total, 26), np.zeros(26), tail=tail)
    assert found.statistic == total
    # Table III rounds to four decimals.
    assert found.z == pytest.approx(z, abs=5.1e-5)
    assert found.effect == pytest.approx(effect, abs=5.1e-5)


def test_p_of_the_papers_times():
    found = signed_rank_test(with_rank_sum(172, 26), np.zeros(26), tail="two-sided")
    assert found.p == pytest.approx(0.9292, abs=5e-5)


def test_effect_size_of_the_paper():
    assert round(effect_size(3.8351, 26), 4) == 0.5318


@pytest.mark.parametrize("tail", ["greater", "less", "two-sided"])
@pytest.mark.parametrize("seed", range(4))
def test_signed_ranks_agree_with_scipy_with_ties_and_zeros(seed, tail):
    rng = np.random.default_rng(seed)
    first, second = rng.integers(0, 8, size=(2, 30)).astype(float)
    found = signed_rank_test(first, second, tail=tail)
    kept = first - second
    kept = kept[kept != 0.0]
    there = stats.wilcoxon(
        kept, alternative=tail, correction=tail != "two-sided", method="asymptotic"
    )
    assert found.p == pytest.approx(there.pvalue, rel=1e-10)


def test_exchanged_samples_change_the_sign():
    rng = np.random.default_rng(3)
    first, second = rng.standard_normal((2, 20))
    one = signed_rank_test(first, second, tail="greater")
    other = signed_rank_test(second, first, tail="less")
    assert one.z == pytest.approx(-other.z)
    assert one.p == pytest.approx(other.p)


def test_equal_conditions_do_not_differ():
    same = np.arange(10.0)
    found = signed_rank_test(same, same, tail="two-sided")
    assert (found.z, found.p, found.effect) == (0.0, 1.0, 0.0)


def test_levene_by_hand():
    first, second = np.array([1.0, 2.0, 6.0]), np.array([0.0, 4.0, 5.0, 7.0])[:3]
    # Distances from the means 3 and 3: 2 1 3 and 3 1 2, both 2 on average: F = 0.
    assert signed_rank_test(first, second, tail="two-sided").levene_f == pytest.approx(
        0.0, abs=1e-12
    )


def test_description():
    found = group_statistics(np.array([3.0, 1.0, 2.0, 10.0]))
    assert (found.count, found.median, found.mean) == (4, 2.5, 4.0)
    assert found.std == pytest.approx(math.sqrt((1 + 9 + 4 + 36) / 3))


def test_shapiro_wilk_rejects_a_skewed_sample():
    rng = np.random.default_rng(0)
    assert group_statistics(rng.standard_normal(26)).shapiro_p > 0.05
    assert group_statistics(rng.lognormal(0, 1.5, 26)).shapiro_p < 0.001
    assert group_statistics(np.full(5, 2.0)).shapiro_p == 1.0


@pytest.mark.parametrize("n", [3, 5, 8, 26, 100])
def test_francias_statistic_is_the_squared_correlation_with_blom_scores(n):
    sample = np.random.default_rng(n).standard_exponential(n)
    scores = [stats.norm.ppf((rank - 3 / 8) / (n + 1 / 4)) for rank in stats.rankdata(sample)]
    assert shapiro_francia(sample)[0] == pytest.approx(stats.linregress(scores, sample).rvalue ** 2)


def test_francias_statistic_is_that_of_the_probability_plot_but_for_its_scores():
    # Filliben's scores of scipy's probability plot differ from Blom's in the third digit.
    sample = np.random.default_rng(5).standard_normal(26)
    there = stats.probplot(sample)[1][2] ** 2
    assert shapiro_francia(sample)[0] == pytest.approx(there, abs=2e-3)


@pytest.mark.parametrize(
    ("n", "count", "error"),
    [
        # The approximation rejects 11.5 % of 200,000 samples of five at the level of 10 %.
        (5, 800, 0.015),
        (26, 800, 0.003),
        pytest.param(26, 20_000, 0.003, marks=pytest.mark.slow),
        pytest.param(500, 20_000, 0.003, marks=pytest.mark.slow),
    ],
)
def test_francia_rejects_normal_samples_as_often_as_its_level(n, count, error):
    samples = np.random.default_rng(n).standard_normal((count, n))
    p = np.array([shapiro_francia(sample)[1] for sample in samples])
    for level in (0.01, 0.05, 0.1):
        noise = 4.0 * math.sqrt(level * (1.0 - level) / count)
        assert (p < level).mean() == pytest.approx(level, abs=noise + error)


def test_francia_rejects_heavy_tails():
    rng = np.random.default_rng(0)
    assert shapiro_francia(rng.standard_normal(100))[1] > 0.05
    assert shapiro_francia(rng.standard_t(2, 100))[1] < 0.001


def test_francia_of_samples_without_a_p():
    assert shapiro_francia(np.full(6, 2.0)) == (1.0, 1.0)
    assert math.isnan(shapiro_francia(np.array([1.0, 2.0, 4.0]))[1])
    assert math.isnan(group_statistics(np.array([1.0, 2.0, 4.0, 5.0])).francia_p)
    scores = stats.norm.ppf((np.arange(1, 11) - 0.375) / 10.25)
    assert shapiro_francia(3.0 * scores + 1.0) == pytest.approx((1.0, 1.0))


def test_repeated_measures_by_sums_of_squares():
    rng = np.random.default_rng(7)
    table = rng.standard_normal((3, 12)) + rng.standard_normal(12) * 3 + [[0.0], [0.4], [1.2]]
    found = repeated_measures(dict(zip("abc", table, strict=True)))
    grand = table.mean()
    between = 12 * ((table.mean(axis=1) - grand) ** 2).sum()
    operators = 3 * ((table.mean(axis=0) - grand) ** 2).sum()
    error = ((table - grand) ** 2).sum() - between - operators
    f = (between / 2) / (error / 22)
    assert found.f == pytest.approx(f, rel=1e-9)
    assert (found.df_between, found.df_error) == (2.0, 22.0)
    assert found.p == pytest.approx(stats.f.sf(f, 2, 22), rel=1e-9)


def test_of_two_conditions_the_analysis_is_the_paired_t_test():
    rng = np.random.default_rng(8)
    first, second = rng.standard_normal((2, 15))
    found = repeated_measures({"a": first, "b": second})
    t, p = stats.ttest_rel(first, second)
    assert found.f == pytest.approx(t**2)
    assert found.p == pytest.approx(p)
    (pair,) = found.post_hoc
    assert (pair.t, pair.p) == (pytest.approx(t), pytest.approx(p))
    assert pair.effect == pytest.approx(math.sqrt(t**2 / (t**2 + 14)))


@pytest.mark.parametrize("tail", ["greater", "less", "two-sided"])
def test_bonferroni_multiplies_by_the_number_of_pairs(tail):
    rng = np.random.default_rng(9)
    shifted = rng.standard_normal((3, 15)) + np.array([[0], [0.3], [3]])
    table = dict(zip("abc", shifted, strict=True))
    pairs = {(one.first, one.second): one for one in repeated_measures(table, tail=tail).post_hoc}
    assert len(pairs) == 3
    for (a, b), one in pairs.items():
        there = stats.ttest_rel(table[a], table[b], alternative=tail)
        assert (one.tail, one.p) == (tail, pytest.approx(min(1.0, 3 * there.pvalue)))


def test_pairs_with_equal_differences_have_the_limits_of_p():
    flat = {"a": np.arange(4.0), "b": np.arange(4.0) + 1, "c": np.array([3.0, 1, 4, 1])}
    for tail, p in [("greater", 1.0), ("less", 0.0), ("two-sided", 0.0)]:
        assert repeated_measures(flat, tail=tail).post_hoc[0].p == p
    same = flat | {"b": flat["a"]}
    assert repeated_measures(same, tail="greater").post_hoc[0].p == 1.0


def test_the_thesis_tests_time_and_steering_with_one_tail():
    # Section III.C.5 and Table 2; its Table 7 states the direction.
    one_tailed = ("time", "steering_angle", "steering_translation")
    two_tailed = ("workload", "arc_length")
    assert ANOVA_MEASURES == (
        dict.fromkeys(one_tailed, "greater") | dict.fromkeys(two_tailed, "two-sided")
    )


@pytest.mark.parametrize(
    "table",
    [
        {"a": np.arange(4.0)},
        {"a": np.arange(4.0), "b": np.arange(5.0)},
        {"a": np.arange(4.0), "b": np.arange(4.0) + 1},
        {"a": np.arange(4.0), "b": np.array([1.0, np.nan, 2.0, 3.0])},
    ],
    ids=["one condition", "no pairs", "nothing varies", "not finite"],
)
def test_invalid_samples_are_refused(table):
    with pytest.raises(DataFileError):
        repeated_measures(table)


def test_kolmogorov_smirnov_is_the_greatest_distance_of_the_standardised_sample():
    sample = np.array([3.0, 1.0, 4.0, 1.5, 9.0, 2.6])
    z = np.sort((sample - sample.mean()) / sample.std(ddof=1))
    normal = np.array([0.5 * math.erfc(-x / math.sqrt(2.0)) for x in z])
    below, above = np.arange(6) / 6.0, np.arange(1, 7) / 6.0
    distance = max((normal - below).max(), (above - normal).max())
    assert kolmogorov_smirnov(sample) == pytest.approx(stats.kstwo.sf(distance, 6))
    # It depends on the shape only.
    assert kolmogorov_smirnov(5.0 - 2.0 * sample) == pytest.approx(
        kolmogorov_smirnov(-sample), rel=1e-9
    )
    assert kolmogorov_smirnov(np.full(4, 2.0)) == 1.0
