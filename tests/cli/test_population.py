"""`tcs population`: whom the sets serve, as text, JSON and picture, and what it refuses."""

from __future__ import annotations

import pytest

import tcs


def test_sets_are_counted_for_people(tcs_command, corner, tmp_path):
    file, picture, people = (tmp_path / name for name in ("a.tcs", "map.png", "people.csv"))
    tcs.save(file, tcs.score("shaving", corner, paper=True))
    people.write_text("sex,stature_percentile\nfemale,5\nmale,95\n")
    found = tcs_command(
        *("population", file, "--people", people, "--sets", 2, "--min-apart", 0.1),
        *("--map", picture, "--json"),
    ).json
    assert (found["bodies"], found["women"], len(found["sets"])) == (2, 1, 2)
    assert {"served", "ci95", "sets", "not_served"} <= set(found)
    assert picture.stat().st_size > 10_000

    from tcs.output.terminal.set_tables import report_population

    report_population(found)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--people", "a.csv", "--age", "6"], 2, "excludes --bodies, --sex and --age"),
        (["--sex", "men"], 1, "sex"),
        (["--people", "nobody.csv"], 1, "nobody.csv"),
        (["--map", "map.txt"], 1, ".png"),
        (["--sets", "0"], 2, "--sets"),
    ],
)
def test_odd_requests_are_refused(tcs_command, tmp_path, words, code, message):
    ran = tcs_command("population", tmp_path / "missing.tcs", *words)
    assert (ran.code, ran.out) == (code, "")
    assert message in ran.err
