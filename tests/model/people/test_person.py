"""A person as files and options give them: keys, percentiles, and what is refused."""

import pytest

from tcs.errors import DataFileError, TcsError, UnknownNameError
from tcs.model.people import PAPERS_MAN, Person, link_scales, load_person, papers_man


def test_a_person_is_read_from_a_file(tmp_path):
    path = tmp_path / "anna.yaml"
    path.write_text("sex: female\nstature_percentile: 5\nabdominal extension depth sitting: 0.25\n")
    found = load_person(path).body()
    assert found.percentiles["stature"] == pytest.approx(5.0)
    assert found.measures["abdominalextensiondepthsitting"] == 0.25
    entry = load_person(path).to_json()
    assert entry["given"]["sex"] == "female"
    assert load_person(entry["given"]).body() == found


@pytest.mark.parametrize(
    ("person", "message"),
    [
        ({"sex": "female", "statur": 1.6}, "Did you mean 'stature'"),
        ({"sex": "femal"}, "'sex' is 'femal'"),
        ({"stature": 1.6}, "'sex' is missing"),
        ({"sex": "male", "stature": 2.9}, "must be 1.47 to 2.06 m"),
        ({"sex": "male", "stature_percentile": 100}, "must be 0.1 to 99.9"),
        ({"sex": "male", "stature": 1.8, "stature_percentile": 50}, "given twice"),
        ({"sex": "male", "stature": "tall"}, "must be a valid number"),
        ({"sex": "male", "stature": float("nan")}, "stature"),
    ],
)
def test_odd_people_are_refused_in_one_line(person, message):
    with pytest.raises((DataFileError, UnknownNameError), match=message) as raised:
        load_person(person)
    assert "\n" not in str(raised.value)
    assert str(raised.value).startswith("person")


def test_the_papers_man_is_a_slim_man_of_ordinary_stature():
    # His shapes alone say so: nothing below is an input.
    man = papers_man()
    assert 25 < man.percentiles["stature"] < 60
    assert man.percentiles["weightkg"] < 20
    assert set(link_scales(man).values()) == {(1.0, 1.0, 1.0)}


def test_each_link_follows_its_own_measures():
    # Twice the depth of the abdomen of a tall man changes no length, and a long arm no girth.
    man = link_scales(Person(sex="male", **PAPERS_MAN).body())
    stout = {**PAPERS_MAN, "abdominalextensiondepthsitting": 0.30}
    changed = link_scales(Person(sex="male", **stout).body())
    assert changed["mid_body"][1] == pytest.approx(0.30 / 0.201)
    assert changed["arm"] == man["arm"]
    long_arm = {**PAPERS_MAN, "shoulderelbowlength": 0.40}
    changed = link_scales(Person(sex="male", **long_arm).body())
    assert changed["arm"][0] == pytest.approx(0.40 / 0.369)
    assert changed["arm"][1:] == (1.0, 1.0)


def test_measures_that_contradict_each_other_are_refused():
    odd = {**PAPERS_MAN, "forearmhandlength": 0.41, "handlength": 0.235}
    with pytest.raises(TcsError, match="forearmhandlength, handlength do not fit together"):
        link_scales(Person(sex="male", **odd).body())
