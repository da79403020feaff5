"""Whether goals are scored with their approaches: where they can be, unless it is said."""

import shutil

import numpy as np
import pytest

from tcs.errors import ArmClassError
from tcs.files.blocks import BlockFolder
from tcs.files.paths import data_folder
from tcs.model.robots import robot_names
from tcs.placement.scoring import LiveScorer, load_job, score, summary
from tcs.placement.scoring.approaches import (
    ApproachScorer,
    approach_hindrance,
    approach_lines,
    choose_approach,
)
from tcs.placement.scoring.dry_run import estimate
from tcs.placement.scoring.offline import load_setups
from tcs.placement.scoring.sweep import approaches_key
from tcs.placement.tables import Reason
from tests.environments import CORNER, write_environment

APPROACH = (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED)


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("choice"), "corner", CORNER)


@pytest.fixture(scope="module")
def by_default(corner):
    return score("shaving", corner)


@pytest.fixture(scope="module")
def slow_iiwa(tmp_path_factory):
    """Path of a robot file whose URDF limits no velocity."""
    folder = tmp_path_factory.mktemp("iiwa")
    for name in ("iiwa7.urdf", "iiwa7.yaml", "iiwa7_primitives.csv"):
        shutil.copy(data_folder() / "models" / "robots" / name, folder / name)
    text = (folder / "iiwa7.urdf").read_text()
    assert 'velocity="1.710422667"' in text
    (folder / "iiwa7.urdf").write_text(text.replace(' velocity="1.710422667"', ""))
    return folder / "iiwa7.yaml"


def test_approaches_are_scored_where_they_can_be(by_default, corner):
    assert by_default.metadata["approach"] == {"tool_speed": 0.1}
    chosen = score("shaving", corner, approach=True).nominal.scores
    np.testing.assert_array_equal(by_default.nominal.scores.reason, chosen.reason)
    without = score("shaving", corner, approach=False)
    assert not {"approach", "no_approach"} & set(without.metadata)
    stopped = np.isin(by_default.nominal.scores.reason, APPROACH)
    assert stopped.any()
    assert without.nominal.scores.reached[stopped].all()


def test_live_scoring_decides_as_offline_scoring(by_default, corner):
    live = LiveScorer("shaving", corner).score()
    assert live.metadata["approach"] == by_default.metadata["approach"]
    np.testing.assert_array_equal(live.nominal.scores.reason, by_default.nominal.scores.reason)


def test_all_arms_of_a_file_are_scored_with_approach_or_none(corner, slow_iiwa):
    both = score("shaving", corner, arms="both")
    assert "approach" in both.metadata
    assert np.isin(both.nominal.scores.reason, APPROACH).any()
    jobs = [load_job("shaving", corner, "pr2"), load_job("feeding", corner, slow_iiwa)]
    assert choose_approach(None, jobs[:1]).is_scored
    choice = choose_approach(None, jobs)
    assert not choice.is_scored
    assert "'iiwa_joint_1'" in choice.hindrance
    with pytest.raises(ArmClassError, match="Leave out 'approach'"):
        choose_approach(True, jobs)
    assert choose_approach(False, jobs).entry == {}


@pytest.mark.parametrize("robot", robot_names())
def test_approaches_of_every_robot_are_scored(robot):
    assert approach_hindrance(load_job("feeding", "wheelchair", robot)) == ""


def test_unknown_velocity_limits_are_named(slow_iiwa, corner):
    why = approach_hindrance(load_job("feeding", corner, slow_iiwa))
    assert "no velocity limit of 'iiwa_joint_1'" in why
    assert "velocity_limits" in why


def test_a_dry_run_scores_approaches_too(by_default, corner):
    sizes = [
        estimate(
            load_setups(
                "shaving", corner, "pr2", measure="isotropy", jobs=1, sets={}, approach=approach
            )
        ).memory_bytes
        for approach in (None, False)
    ]
    postures = summary(by_default)["approach"]
    fewer = postures["limits"] + postures["blocked"]
    # Seven angles of four bytes for each pair that is reached.
    assert sizes[1] - sizes[0] == 28 * fewer


def test_approaches_are_kept_in_blocks(by_default, corner, tmp_path, monkeypatch):
    folder = BlockFolder(tmp_path / "blocks")
    first = score("shaving", corner, blocks=folder)
    monkeypatch.setattr(ApproachScorer, "score", None)
    again = score("shaving", corner, blocks=folder)
    for file in (first, again):
        for name in ("reason", "dexterity", "arm_joints", "pair", "pair_names"):
            expected = getattr(by_default.nominal.scores, name)
            np.testing.assert_array_equal(getattr(file.nominal.scores, name), expected)
    assert again.metadata["timings"]["compile_seconds"] == 0.0
    # The same scores without approach are there too.
    without = score("shaving", corner, paper=True, blocks=folder)
    assert not np.isin(without.nominal.scores.reason, APPROACH).any()


def test_other_approaches_have_blocks_of_their_own(corner):
    lines = approach_lines(load_job("shaving", corner, "pr2"))
    keys = [
        approaches_key(scores, of)
        for scores in ("1", "2")
        for of in (lines, lines._replace(offset=2.0 * lines.offset))
    ]
    assert len({*keys}) == 4
