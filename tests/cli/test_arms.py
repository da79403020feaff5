import pandas as pd
import pytest


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("both")


@pytest.fixture
def both(tcs_command, corner, folder):
    """A file of both arms, scored once by the command line, and what the command printed."""
    path = folder / "both.tcs"
    if not path.exists():
        ran = tcs_command(
            *("score", "shaving", "--environment", corner, "--robot", "pr2", "--arms", "both"),
            *("--out", path, "--paper", "--json"),
        )
        assert ran.code == 0
        assert ran.json["configurations"] == 36
        used = {hand for member in ran.json["best"]["members"] for hand in member["hand"]}
        assert used <= {"left", "right", None}
    return path


def test_members_have_a_hand_for_each_goal(tcs_command, both):
    here = ("--here", 1.4, -1.2, 180)
    ran = tcs_command("select", both, *here, "--json")
    assert all(len(member["hand"]) == 8 for member in ran.json["members"])
    used = {hand for member in ran.json["members"] for hand in member["hand"]} - {None}
    shown = tcs_command("select", both, *here, "--top", 2)
    assert used
    assert all(hand in shown.out for hand in used)


def test_table_names_the_hand(tcs_command, both, tmp_path):
    path = tmp_path / "scores.csv"
    assert tcs_command("export", both, "--out", path, "--all").code == 0
    frame = pd.read_csv(path)
    assert len(frame) == 36
    reached = frame["reason_7"] == "reached"
    assert set(frame["hand_7"][reached]) <= {"left", "right"}
    assert frame["hand_7"][~reached].isna().all()


def test_a_goal_is_explained_for_an_arm(tcs_command, both):
    words = ("explain", both, "--goal", 1, "--here", 1.05, -0.7, 180, "--torso", 0.3)
    for arm in ("left", "right"):
        ran = tcs_command(*words, "--arm", arm, "--json")
        assert ran.json["explained"]["hand"] == arm


def test_answers_are_confirmed_by_drake(tcs_command, both):
    ran = tcs_command("verify", both, "--pairs", 8, "--dense", 0, "--json")
    assert (ran.code, ran.json["checked"], ran.json["false_reached"]) == (0, 8, 0)


def test_what_is_shown_takes_both_arms(tcs_command, both, tmp_path):
    page = tmp_path / "v.html"
    assert tcs_command("view", both, "--export", page).code == 0
    assert page.stat().st_size > 100_000


@pytest.mark.parametrize("command", ["map", pytest.param("picture", marks=pytest.mark.slow)])
def test_pictures_show_members_with_their_arm(tcs_command, both, tmp_path, command):
    path = tmp_path / f"{command}.svg"
    assert tcs_command(command, both, "--out", path).code == 0
    assert path.stat().st_size > 10_000


def test_success_is_estimated_for_sets_of_both_arms(tcs_command, both, tmp_path):
    copy = tmp_path / "copy.tcs"
    copy.write_bytes(both.read_bytes())
    assert tcs_command("evaluate", copy, "--samples", 5).code == 0
    assert tcs_command("robustify", copy, "--sets", 3, "--samples", 5).code == 0
    ran = tcs_command("select", copy, "--here", 1.4, -1.2, 180, "--delta", 1, "--json")
    assert 0.0 <= ran.json["success"] <= 1.0


def test_an_arm_that_the_robot_does_not_have_is_refused(tcs_command, corner):
    ran = tcs_command("score", "shaving", "--environment", corner, "--arms", "middle")
    assert (ran.code, "unknown arm 'middle'" in ran.err.lower()) == (1, True)
