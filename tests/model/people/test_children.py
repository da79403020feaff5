"""Children: sizes by the growth charts, proportions that change with age, and what is refused."""

import csv

import numpy as np
import pytest

import tcs.model.people as people
from tcs.errors import DataFileError
from tcs.files.paths import data_folder
from tcs.model.people import (
    Person,
    body,
    draw_bodies,
    link_scales,
    load_people,
    load_survey,
    scales_of_people,
    survey_at,
)
from tcs.output.words.people import person_text

# Stature [m] and mass [kg] at the 5th, 50th and 95th percentile in the month after the birthday, by
# hand from L, M and S of the charts.
CHARTS = {
    ("male", 4): ((0.9563, 1.0251, 1.0951), (13.62, 16.32, 20.32)),
    ("female", 10): ((1.2752, 1.3823, 1.4960), (24.85, 33.12, 48.20)),
}


@pytest.mark.parametrize(("sex", "age"), CHARTS)
def test_stature_and_mass_are_those_of_the_growth_charts(sex, age):
    for measure, expected in zip(("stature", "mass"), CHARTS[sex, age], strict=True):
        found = [
            body(sex, age=age, percentiles={measure: p}).measures[
                {"mass": "weightkg"}.get(measure, measure)
            ]
            for p in (5, 50, 95)
        ]
        np.testing.assert_allclose(found, expected, rtol=2e-3)


@pytest.mark.parametrize("sex", people.SEXES)
def test_children_are_no_small_adults(sex):
    adult = load_survey(sex)
    at = {age: survey_at(sex, age) for age in (4, 8, 12, 16)}
    share = {
        name: [
            float(s.values(np.zeros(58))[s.index(name)] / s.values(np.zeros(58))[0])
            for s in (*at.values(), adult)
        ]
        for name in ("headlength", "sittingheight")
    }
    # A child's head and trunk are more of the stature than an adult's.
    head = np.array(share["headlength"])
    assert head[0] > 1.2 * head[-1]
    assert (np.diff(head) < 1e-12).all()
    assert share["sittingheight"][0] > 1.01 * share["sittingheight"][-1]


def test_a_heavier_child_is_broader_and_not_longer():
    light, heavy = (
        body("female", age=9, percentiles={"stature": 50, "mass": p}).measures for p in (5, 95)
    )
    assert heavy["waistbreadth"] > 1.2 * light["waistbreadth"]
    assert heavy["tragiontopofhead"] == pytest.approx(light["tragiontopofhead"], rel=0.04)


def test_drawn_children_have_sizes_that_their_links_can_take():
    children = draw_bodies(300, age=4, seed=0)
    assert len(scales_of_people(children)) == 300
    assert (children[0].age, children[0].sex) == (4, "female")
    # As the charts say of the middle nine tenths; women and men in turn.
    low, high = np.percentile(children.values[::2, 0], (5, 95))
    np.testing.assert_allclose((low, high), (0.940, 1.084), atol=0.02)


def test_ages_from_eighteen_are_adults():
    assert body("male", age=18) == body("male") == body("male", age=70)
    assert draw_bodies(2, age=30).ages is None
    scales = link_scales(Person(sex="female", age=6).body())
    assert scales["quad"][0] < 0.7 < scales["head"][2]


def test_what_cannot_be_a_child_is_refused(tmp_path):
    with pytest.raises(DataFileError, match="must be 4 or more"):
        body("male", age=3.9)
    with pytest.raises(DataFileError, match="m for a child of 6 years who is male"):
        body("male", age=6, measures={"stature": 1.75})
    path = tmp_path / "children.csv"
    path.write_text("sex,age,stature\nfemale,6,1.2\nmale,,\n")
    found = load_people(path)
    assert (found[0].age, found[0].stature, found[1].age) == (6, 1.2, None)


def test_a_child_is_called_one():
    entry = Person(sex="male", age=6).to_json()
    assert person_text(entry).startswith("a boy of 6 years, 1.1")
    assert "age" not in Person(sex="male", age=40).to_json()


def test_every_measure_has_a_proportion_that_ends_at_the_adults():
    path = data_folder() / "models" / "people" / "child_proportions.csv"
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for sex in people.SEXES:
        of_sex = {row["measure"]: row for row in rows if row["sex"] == sex}
        assert set(of_sex) | {"stature"} == set(load_survey(sex).measures)
        assert all(float(row["age_18"]) == 1.0 for row in of_sex.values())
