import dataclasses
import math
import os
import pickle

import joblib
import numpy as np
import pytest

import tcs
from tcs.errors import OutputError
from tcs.placement import parking
from tcs.placement.parking import with_windows
from tcs.placement.store import StateTables
from tests.chosen import some_of
from tests.placement.store.example import SHIFT, known_everywhere, score_file

HERE = ("--here", "0.5", "-1", "90")


def state(**changes):
    values = {"base_x": 0.5, "base_y": -1.0, "base_yaw": math.pi / 2, "torso": 0.0} | changes
    return tcs.InitialConfiguration(**values)


def test_select_prints_the_choice(tcs_command, small_file):
    ran = tcs_command("select", small_file, *HERE, "--json")
    assert (ran.code, ran.err) == (0, "")
    result = ran.json
    assert set(result) == {
        "members", "measure", "reachability", "manipulability", "cost", "utility", "seconds",
        "unreachable", "net_utility", "moves", "configurations", "places", "here_place", "here",
        "basis", "fewer", "gain",
    }  # fmt: skip
    choice = tcs.select(tcs.load(small_file), state())
    assert result["configurations"] == [choice.indices[i] for i in choice.order]
    # The order of the tour, which is not that of the indices.
    assert result["members"] == [choice.members[i].to_json() for i in choice.order]
    assert result["utility"] == choice.utility
    assert result["cost"] == choice.cost


def test_without_here_the_recommended_set_is_selected(tcs_command, small_file):
    result = tcs_command("select", small_file, "--json").json
    file = tcs.load(small_file)
    assert result["basis"] == "goals"
    assert result["configurations"] == list(tcs.select(file).indices)
    assert result["here"] is None
    # One weight is a wish: then the utility decides, and travel costs nothing.
    wished = tcs_command("select", small_file, "--gamma", 5, "--json").json
    assert wished["basis"] == "utility"
    choice = tcs.select(file, state(), weights=tcs.UtilityWeights(travel=0.0, environment=0.0))
    assert wished["utility"] == choice.utility
    text = tcs_command("select", small_file).out
    assert "most goals, then fewest stops: " in text
    assert "travel cost" not in text


def test_members_come_in_the_order_of_the_tour(tcs_command, small_file):
    turned = 0
    for x in (-3.0, 3.0):
        words = ("select", small_file, "--here", x, 0, 0, "--gamma", 0.01, "--json")
        members = tcs_command(*words).json["members"]
        assert len(members) == 2
        distance = [abs(x - member["base_x"]) for member in members]
        turned += members[0]["base_x"] > members[1]["base_x"]
        assert distance[0] <= distance[1]
    assert turned == 1


def test_weights_reach_the_selection(tcs_command, small_file):
    words = (
        *("--alpha", 2, "--beta", 0.5, "--gamma", 0.3, "--metre-weight", 0.7),
        *("--turn-weight", 0.2, "--torso-weight", 0.4, "--torso", 0.1, "--max-members", 1),
        *("--at", "bed_height=0.1", "--axis-weight", "bed_height=3"),
    )
    result = tcs_command("select", small_file, *HERE, *words, "--json").json
    here = state(torso=0.1, environment=(("bed_height", 0.1),), environment_units=("m",))
    choice = tcs.select(
        tcs.load(small_file),
        here,
        weights=tcs.UtilityWeights(reachability=2, manipulability=0.5, travel=0.3),
        travel=tcs.TravelWeights(metre=0.7, turn=0.2, torso=0.4, environment=(("bed_height", 3),)),
        max_members=1,
    )
    assert len(result["members"]) == 1
    assert (result["utility"], result["cost"]) == (choice.utility, choice.cost)
    assert result["members"][0] == choice.members[0].to_json()


def test_select_as_text(tcs_command, small_file):
    ran = tcs_command("select", small_file, *HERE)
    for word in ("base x [m]", "heading [deg]", "bed height [m]", "of the goals", "utility"):
        assert word in ran.out


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(("--at", "bed_height=0"), id="no place"),
        pytest.param(("--here", "1", "2"), id="half a place"),
        pytest.param(("--here", "1", "2", "north"), id="no number"),
        pytest.param((*HERE, "--max-members", "4"), id="four members"),
        pytest.param((*HERE, "--epsilon", "1"), id="unknown option"),
    ],
)
def test_misuse_exits_with_2(tcs_command, small_file, words):
    ran = tcs_command("select", small_file, *words)
    assert ran.code == 2
    assert ran.out == ""
    assert ran.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        pytest.param((*HERE, "--gamma", "-1"), "Weight gamma (travel) is -1,", id="negative"),
        pytest.param(
            (*HERE, "--max-members", "3"),
            "holds sets of 1 and 2 only. Score the task again: tcs score ... --max-members 3.",
            id="three members",
        ),
        pytest.param((*HERE, "--travel", "arround"), "Did you mean 'around'?", id="no route"),
        pytest.param((*HERE, "--alpha", "nan"), "Weight alpha (reachability) is nan", id="nan"),
        pytest.param(("--here", "inf", "0", "0"), "base_x is inf", id="far away"),
        pytest.param(
            (*HERE, "--at", "bed_height=5"),
            "bed_height is 5 m, out of range: the scores cover 0 to 0.1 m.",
            id="bed out of range",
        ),
        pytest.param((*HERE, "--torso", "5"), "torso is 5 m, out of range", id="torso"),
        pytest.param((*HERE, "--at", "bed=high"), "--at is 'bed=high'; must be", id="no number"),
        pytest.param((*HERE, "--at", "bed_hight=1"), "Did you mean 'bed_height'?", id="no axis"),
        pytest.param(
            (*HERE, "--axis-weight", "bed_height=1"), "Current state lacks bed_height", id="unset"
        ),
        pytest.param(
            (*HERE, "--at", "bed_height_deg=1"), "'bed_height' is given in 'rad'", id="unit"
        ),
    ],
)
def test_impossible_values_are_one_line(tcs_command, small_file, words, message):
    ran = tcs_command("select", small_file, *words)
    assert ran.code == 1
    assert ran.out == ""
    assert ran.err.startswith("tcs: ")
    assert ran.err.count("\n") == 1
    assert message in ran.err


class Call:
    """A call that a pickle makes when it is loaded: it creates a folder."""

    def __init__(self, folder):
        self.folder = str(folder)

    def __reduce__(self):
        return os.mkdir, (self.folder,)


def test_malicious_file_is_refused_and_nothing_is_called(tcs_command, tmp_path):
    path, folder = tmp_path / "evil.tcs", tmp_path / "made"
    joblib.dump({"format": "tcs scores", "task": Call(folder)}, path)
    ran = tcs_command("select", path, *HERE)
    assert (ran.code, ran.out) == (1, "")
    assert ran.err.count("\n") == 1
    assert "not on the allow-list" in ran.err
    assert not folder.exists()
    pickle.loads(pickle.dumps(Call(folder)))
    assert folder.exists()


def test_truncated_file(tcs_command, small_file):
    content = small_file.read_bytes()
    small_file.write_bytes(content[: len(content) // 2])
    ran = tcs_command("select", small_file, *HERE)
    assert ran.code == 1
    assert "is truncated. Make it again with `tcs score`." in ran.err


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG"])
def test_foreign_file(tcs_command, tmp_path, content):
    path = tmp_path / "foreign.tcs"
    path.write_bytes(content)
    ran = tcs_command("select", path, *HERE)
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "Make it again with `tcs score`." in ran.err


@pytest.mark.parametrize("verb", ["select", "verify", "map", "picture"])
def test_missing_file(tcs_command, tmp_path, verb):
    more = {"select": HERE, "verify": ()}.get(verb, ("--out", tmp_path / "p.png"))
    ran = tcs_command(verb, tmp_path / "none.tcs", *more)
    assert ran.code == 1
    assert "none.tcs' cannot be read: No such file or directory." in ran.err


def test_nothing_to_select(tcs_command, tmp_path):
    path = tmp_path / "none.tcs"
    tcs.save(path, score_file(share=0.0))
    ran = tcs_command("select", path, *HERE)
    assert ran.code == 1
    assert "Nothing to select" in ran.err


def test_the_observed_shift_is_reported(tcs_command, tmp_path):
    path = tmp_path / "shifts.tcs"
    tcs.save(path, score_file(tables=3, observed=[SHIFT]))
    ran = tcs_command("select", path, *HERE, "--observed", "person_y=0.04", "--json").json
    assert ran["observed"] == {"person_y": 0.05}
    assert ran["observed_error"] == {"person_y": -0.01}
    for option in ("--frames", "--seen"):
        words = (*HERE, option, "head=0.1,0.1,0.12", "--json")
        result = tcs_command("select", path, *words).json
        assert result["frame_position_error"] == pytest.approx(0.02)
    message = tcs_command("select", path, *HERE, "--observed", "person_y=0.04")
    assert "scored for person y 0.05 m; observed person y differs by -0.01 m" in message.out
    # A negative zero is printed without a sign.
    exact = tcs_command("select", path, *HERE, "--observed", "person_y=-0.0")
    assert "scored for person y 0 m; observed person y is the scored one" in exact.out


def test_limbs_observed_one_by_one(tcs_command, tmp_path):
    path = tmp_path / "limbs.tcs"
    shifts = (-0.05, 0.0, 0.05)
    place = {name: [(x, y, 0.7) for y in shifts for _ in range(2)] for name, x in (("head", 0.0),
             ("arm_left", 1.0))}  # fmt: skip
    goals = [{"body_frame": name} for name in ("head", "head", "head", "arm_left", "arm_left")]
    tcs.save(path, score_file(
        tables=3, observed=[SHIFT], task={"name": "bathing", "goals": goals},
        body_frames={name: np.ravel(at).tolist() for name, at in place.items()},
    ))  # fmt: skip
    words = ("select", path, *HERE, "--frames", "head=0,0.04,0.7", "--frames")
    result = tcs_command(*words, "arm_left=1,-0.04,0.7", "--json").json
    assert [(one["frame"], one["observed"]["person_y"]) for one in result["frames"]] == [
        ("head", 0.05),
        ("arm_left", -0.05),
    ]
    shown = tcs_command(*words, "arm_left=1,-0.04,0.7").out
    assert "goals on arm left also as scored for person y -0.05 m, 0.010 m from it" in shown
    words = ("explain", path, "--goal", 4, *words[6:])
    explained = tcs_command(*words, "arm_left=1,-0.04,0.7")
    assert "Goals on arm left also as scored for person y -0.05 m" in explained.out
    ran = tcs_command(*words, "arm_right=1,-0.04,0.7")
    assert ran.code == 1
    assert "'arm_right'" in ran.err
    assert "Known: arm_left, head." in ran.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--observed", "person_y=0.2"), "scored are only -0.05 to 0.05 m"),
        (("--observed", "person_y"), "NAME=NUMBER"),
        (("--observed", "person_y=0", "--observed", "person_y=1"), "twice"),
        (("--observed", "person_y_deg=2"), "scored in m. Write person_y=VALUE"),
        (("--frames", "head=1,2,x"), "FRAME=X,Y,Z"),
    ],
)
def test_a_shift_that_was_not_scored_is_reported(process, tmp_path, words, message):
    path = tmp_path / "shifts.tcs"
    tcs.save(path, score_file(tables=3, observed=[SHIFT]))
    ran = process("select", path, *HERE, *words)
    assert ran.code == 1
    assert message in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize("command", some_of(["map", "picture"], "map"))
def test_a_set_larger_than_the_file_holds_is_not_drawn(process, tmp_path, command):
    path, out = tmp_path / "pairs.tcs", tmp_path / "drawn.png"
    tcs.save(path, score_file())
    ran = process(command, path, "--out", out, "--max-members", 3)
    assert ran.code == 1
    assert "holds sets of 1 and 2 only" in ran.err
    assert ran.err.count("\n") == 1
    assert not out.exists()


def test_travel_around_the_furniture(tcs_command, tmp_path):
    file = score_file()
    sets = file.nominal.sets
    # A wall round the first base cell.
    x, y = np.rint((sets.cell_xy[0] - sets.lattice.start) / sets.lattice.step).astype(int)
    moves = sets.lattice.moves.copy()
    moves[:, x - 1 : x + 1, y - 1 : y + 2] = False
    sets = dataclasses.replace(sets, lattice=dataclasses.replace(sets.lattice, moves=moves))
    file = dataclasses.replace(file, tables=(StateTables.of(file.nominal.scores, sets),))
    path = tmp_path / "walled.tcs"
    tcs.save(path, file)
    words = ("select", path, "--here", -3, 0.5, 0, "--gamma", 0.5)
    straight = tcs_command(*words, "--json").json
    around = tcs_command(*words, "--travel", "around", "--json").json
    travel = tcs.TravelWeights(route="around")
    weights = tcs.UtilityWeights(travel=0.5)
    choice = tcs.select(file, state(base_x=-3, base_y=0.5), weights=weights, travel=travel)
    assert (around["cost"], around["utility"]) == (choice.cost, choice.utility)
    assert around["unreachable"] == choice.unreachable
    assert straight["unreachable"] == 0
    assert around["unreachable"] == int(np.count_nonzero(sets.cell == 0)) > 0
    assert around["cost"] != straight["cost"]
    assert "unreachable from here:" in tcs_command(*words, "--travel", "around").out


def test_sets_of_three(tcs_command, tmp_path):
    path = tmp_path / "three.tcs"
    tcs.save(path, score_file(options={"max_members": 3}))
    words = ("select", path, *HERE, "--gamma", 0, "--json")
    assert len(tcs_command(*words).json["members"]) == 3
    assert len(tcs_command(*words, "--max-members", 2).json["members"]) == 2


def test_constraints_reach_the_selection(tcs_command, small_file):
    words = ("--only", "base_x <= 0", "--keep", "bed_height", "--at", "bed_height=0.1")
    ran = tcs_command("select", small_file, *HERE, *words, "--json")
    assert all(m["base_x"] <= 0 and m["bed_height"] == 0.1 for m in ran.json["members"])
    names = [entry["constraint"] for entry in ran.json["constraints"]]
    assert names == ["only base_x <= 0", "keep bed_height"]
    assert "warnings" not in ran.json
    assert "keep bed_height: " in tcs_command("select", small_file, *HERE, *words).out


def test_warnings_are_part_of_the_result_and_printed_once(tcs_command, small_file):
    ran = tcs_command("select", small_file, *HERE, "--only", "bed_height <= 1", "--json")
    (warning,) = ran.json["warnings"]
    assert "excludes nothing" in warning
    assert ran.err.count("excludes nothing") == 1


def test_regions_reach_the_selection(tcs_command, small_file, tmp_path):
    path = tmp_path / "left.yaml"
    path.write_text("polygon: [[-9, -9], [-0.75, -9], [-0.75, 9], [-9, 9]]")
    ran = tcs_command("select", small_file, *HERE, "--forbid", path, "--json")
    assert all(member["base_x"] > -0.25 for member in ran.json["members"])
    assert ran.json["footprint"] == {"type": "circle", "radius": 0.5}
    assert "score the task again" in ran.err.lower()


def test_an_obstacle_needs_shapes(tcs_command, small_file):
    ran = tcs_command("select", small_file, *HERE, "--blocked", "1 1 0.5 0.5")
    assert (ran.code, ran.out) == (1, "")
    assert "does not hold the robot's shapes" in ran.err


def test_alternatives_are_listed(tcs_command, small_file):
    words = ("select", small_file, *HERE, "--top", 3, "--min-apart", 0.3)
    result = tcs_command(*words, "--json").json
    assert len(result["alternatives"]) == 2
    assert set(result["alternatives"][0]["trades"]) == {
        "reachability", "manipulability", "cost", "utility", "net_utility", "places",
    }  # fmt: skip
    assert [len(one["places"]) for one in result["alternatives"]] == [
        len(one["members"]) for one in result["alternatives"]
    ]
    assert "base poses" in tcs_command(*words).out


def test_penalties_reach_the_selection(tcs_command, small_file):
    words = ("--at", "bed_height=0.1", "--prefer", "base_x <= 0", "--environment-penalty", 5)
    result = tcs_command("select", small_file, *HERE, *words, "--preference-penalty", 9, "--json")
    assert all(m["bed_height"] == 0.1 and m["base_x"] <= 0 for m in result.json["members"])
    assert result.json["moves"] == []
    for penalty, size in ((0, 2), (0.5, 1)):
        members = tcs_command("select", small_file, *HERE, "--place-penalty", penalty, "--json")
        assert len(members.json["members"]) == size


def test_constraints_of_a_file_are_added(tcs_command, small_file, tmp_path):
    path = tmp_path / "ward.yaml"
    path.write_text("only: ['base_x <= 0']")
    words = ("select", small_file, *HERE, "--constraints", path, "--only", "bed_height = 0")
    result = tcs_command(*words, "--json").json
    assert [entry["constraint"] for entry in result["constraints"]] == [
        "only base_x <= 0",
        "only bed_height = 0",
    ]


def test_windows_of_the_file_are_requested_and_shown(tcs_command, tmp_path):
    path, file = tmp_path / "windows.tcs", score_file()
    best = tcs.select(file)
    tcs.select(file, parking=(0.05, 0.05, 3), find_windows=known_everywhere)
    tcs.save(path, with_windows(file))
    before = path.read_bytes()
    result = tcs_command("select", path, "--parking", "0.05,0.05,3", "--json").json
    assert result["parking"] == {"x": 0.05, "y": 0.05, "yaw_deg": 3.0, "sets_looked_at": 1}
    assert result["configurations"] == [best.indices[i] for i in best.order]
    windows = [member["window"] for member in result["members"]]
    assert windows == [{"x": 0.08, "y": 0.062, "yaw_deg": 5.0}] * len(best.members)
    text = tcs_command("select", path).out
    assert "Stop 1 may stand up to 8 cm off in x, 6 cm in y, 5 degrees in heading." in text
    # Nothing was found that the file did not hold: it is not written again.
    assert path.read_bytes() == before


def test_windows_that_are_found_are_kept_in_the_file(tcs_command, small_file, monkeypatch):
    monkeypatch.setattr(parking, "find_windows", known_everywhere)
    assert tcs_command("select", small_file, "--parking", "0.05,0.05,3").code == 0
    monkeypatch.setattr(parking, "find_windows", lambda *_, **__: pytest.fail("it is known"))
    again = tcs_command("select", small_file, "--parking", "0.05,0.05,3", "--json").json
    assert all(member["window"]["x"] == 0.08 for member in again["members"])


def test_a_file_that_cannot_be_written_is_selected_from_all_the_same(
    tcs_command, small_file, monkeypatch
):
    def refuse(path, file):
        raise OutputError(f"'{path}' cannot be written.")

    monkeypatch.setattr(parking, "find_windows", known_everywhere)
    monkeypatch.setattr(tcs, "save", refuse)
    ran = tcs_command("select", small_file, "--parking", "0.05,0.05,3", "--json")
    assert ran.code == 0
    assert "not kept" in ran.err
    assert all("window" in member for member in ran.json["members"])


@pytest.mark.parametrize("wrong", ["0.05", "0.05,0.05", "a,b,c", "0.05,0.05,200", "nan,0,0"])
def test_parking_is_three_half_widths(tcs_command, small_file, wrong):
    ran = tcs_command("select", small_file, "--parking", wrong)
    assert ran.code == 1
    assert "half widths" in ran.err
