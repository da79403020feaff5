"""Populations: sets scored for many people as for each alone; who is left out, and why."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import rankdata

import tcs
from tcs.errors import DataFileError, TcsError
from tcs.model.people import LINKS, Bodies, draw_bodies, load_people, papers_man
from tcs.placement.population import Population, SetForPeople, population, ranking, tree
from tcs.placement.population.differences import _ranks
from tcs.placement.robustness.statistics import binomial_interval
from tests.environments import CORNER, write_environment

PEOPLE = draw_bodies(4, seed=1)


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    """Path of a wheelchair with few base poses."""
    return write_environment(tmp_path_factory.mktemp("corner"), "corner", CORNER)


@pytest.fixture(scope="module")
def found(corner):
    """The score file of shaving there, and the population of PEOPLE and the papers' man."""
    file = tcs.score("shaving", corner, paper=True)
    man = papers_man()
    values = np.vstack([PEOPLE.values, [man.measures[name] for name in PEOPLE.measures]])
    people = Bodies(PEOPLE.measures, np.append(PEOPLE.is_male, True), values)
    return file, population(file, people, top=tcs.Top(count=3, min_apart=0.05))


def test_the_papers_man_is_served_as_scored(found):
    file, result = found
    sets = file.nominal.sets
    assert result.best.indices == sets.best
    for one in result.sets:
        rows = np.searchsorted(sets.candidates, one.indices)
        np.testing.assert_array_equal(one.reached[-1], sets.reached[rows].any(axis=0))
        np.testing.assert_array_equal(one.reached[-1], one.expected)


def test_a_person_is_served_as_if_scored_alone(found, corner):
    _, result = found
    body = PEOPLE[0]
    alone = tcs.score("shaving", corner, person={"sex": body.sex, **body.measures}, paper=True)
    reached = alone.nominal.scores.reached
    for one in result.sets:
        np.testing.assert_array_equal(one.reached[0], reached[list(one.indices)].any(axis=0))


@pytest.mark.slow
def test_errors_displace_each_person(found):
    file, result = found
    once, again = (
        population(file, result.people, top=tcs.Top(count=2), errors=True, seed=2, jobs=jobs)
        for jobs in (1, 2)
    )
    np.testing.assert_array_equal(once.best.reached, again.best.reached)
    assert once.to_json()["errors"]["person_x"] == {"distribution": "normal", "std": 0.05}
    assert not np.array_equal(once.best.reached, result.best.reached)
    with pytest.raises(TcsError, match="jobs is 0"):
        population(file, result.people, jobs=0)


def of(*served: list[bool]) -> Population:
    """Return a population with a task of one goal, and sets that reach it for some."""
    one = np.ones(1)
    people = draw_bodies(len(served[0]), seed=0)
    sets = tuple(
        SetForPeople((i,), (), 1.0, 0.0, one > 0, np.array(each)[:, None], one)
        for i, each in enumerate(served)
    )
    blocked = np.zeros((len(served[0]), 1), dtype=np.bool_)
    return Population(
        people=people, sets=sets, blocked=blocked, goal_names=("",), observed={}, about={},
        without_approach=False, errors=None, seed=0, seconds=0.0,
    )  # fmt: skip


def test_two_sets_cover_most_of_all_pairs():
    a = [True, True, True, False, False, False]
    b = [True, True, False, True, False, False]
    c = [False, False, False, False, True, True]
    result = of(b, a, c)
    assert (result.most, result.two) == (0, (0, 2))
    plain = result.to_json()
    assert plain["two_sets"]["served"] == pytest.approx(5 / 6)
    assert plain["ci95"] == list(binomial_interval(3, 6))
    assert plain["not_served"]["numbers"] == [2, 4, 5]
    assert of(a).to_json()["two_sets"] is None


def test_the_interval_is_that_of_clopper_and_pearson():
    # With all of n, the lower end p has p^n = 0.025.
    low, high = binomial_interval(20, 20)
    assert (low**20, high) == (pytest.approx(0.025), 1.0)
    low, high = binomial_interval(3, 10)
    assert (low, high) == (pytest.approx(0.0667, abs=1e-4), pytest.approx(0.6525, abs=1e-4))


def test_measures_that_decide_are_found():
    people = draw_bodies(400, seed=5)
    depth, stature = (
        people.values[:, people.measures.index(name)]
        for name in ("abdominalextensiondepthsitting", "sittingheight")
    )
    served = ~((depth > 0.28) & (stature < 0.9))
    first, second, third = sorted(tree(people, served), key=lambda part: part.served)[:3]
    assert first.served < 0.05
    assert {name for name, _, _ in first.conditions} == {
        "abdominalextensiondepthsitting", "sittingheight",
    }  # fmt: skip
    assert min(second.served, third.served) > 0.9
    best = ranking(people, depth < 0.28)[0]
    assert (best.measure, best.auc) == ("abdominalextensiondepthsitting", pytest.approx(1.0))
    assert ranking(people, depth > 0.0) == ()
    assert len(tree(people, depth > 0.0)) == 1
    assert all(name in people.measures for sums in LINKS.values() for s in sums for name in s)


def test_people_are_read_from_a_table(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text("sex,stature,mass_percentile\nfemale,1.55,\nmale,,90\n\n")
    people = load_people(path)
    assert (len(people), people[0].stature) == (2, 1.55)
    assert people[1].percentiles["weightkg"] == pytest.approx(90.0, abs=0.1)
    for text, message in (
        ("stature\n1.6\n", "'sex'"),
        ("sex,stature\nmale,tall\n", "line 2, 'stature' is 'tall'"),
        ("sex,stature\nmale\n", "line 2 has 1 cells"),
        ("sex,stature\nmale,3\n", "line 2: 'stature' is 3 m"),
        ("sex,stature\n", "has 0 people"),
    ):
        path.write_text(text)
        with pytest.raises(DataFileError, match=message):
            load_people(path)


@pytest.mark.parametrize("different", [1, 3, 1000])
def test_ranks_are_those_of_scipy(different):
    values = np.random.default_rng(different).integers(0, different, 200).astype(float)
    np.testing.assert_array_equal(_ranks(values), rankdata(values))
