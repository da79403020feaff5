"""`tcs score --person`: for whom it scores, and what it refuses."""

import pytest

import tcs


def test_a_task_is_scored_for_a_person(tcs_command, corner, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "anna.yaml"
    file.write_text("sex: female\nstature: 1.62\n")
    words = ("score", "shaving", "--environment", corner, "--person", file)
    ran = tcs_command(*words, "--person", "stature=1.525")
    assert ran.code == 0
    assert "scored for a woman of 1.525 m (5th percentile)" in ran.out
    # Not over the file of the papers' man.
    (made,) = tmp_path.glob("*-person.tcs")
    person = tcs.load(made).metadata["person"]
    assert (person["sex"], person["stature"], person["touching_goals"]) == ("female", 1.525, [])


@pytest.mark.parametrize(
    ("person", "message"),
    [
        (["sex=female", "statur=1.6"], "Did you mean 'stature'"),
        (["stature=1.6"], "'sex' is missing"),
        (["sex=male", "stature=tall"], "must be KEY=NUMBER"),
        (["sex=male", "stature=1.8", "stature=1.9"], "sets 'stature' twice"),
        (["sex=male", "stature=1.8", "stature_percentile=50"], "given twice"),
        (["sex=male", "stature=1e400"], "stature"),
        (["nobody.yaml"], "nobody.yaml"),
    ],
)
def test_odd_people_are_refused_in_one_line(tcs_command, person, message):
    options = [word for value in person for word in ("--person", value)]
    ran = tcs_command("score", "shaving", *options)
    assert (ran.code, ran.out) == (1, "")
    assert message in ran.err
    assert ran.err.count("\n") == 1
