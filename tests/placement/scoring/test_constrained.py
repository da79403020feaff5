"""Scoring under constraints: what is excluded is not scored, all else is unchanged."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError, StoreError, UnknownNameError
from tcs.model.grid import Grid
from tcs.placement.constraints import (
    Footprint,
    constraint_texts,
    excluded_configurations,
    scored_constraints,
)
from tcs.placement.scoring import rebuild_scenes, sweep
from tcs.placement.tables import Reason
from tcs.placement.tables.place_map import PlaceMap
from tests.placement.tables.small import small_grid

CORNER = tcs.Region(((0.4, 0.3), (0.85, 0.3), (0.85, 1.2), (0.4, 1.2)))
"""A part of the strip on the left of the wheelchair."""
BOX = tcs.Obstacle(x=0.9, y=-0.6, width=0.4, depth=0.3, yaw=0.3, z_high=0.9)


@pytest.fixture(scope="module")
def forbidden(small_environment):
    """Shaving, with a region that is forbidden."""
    return tcs.score(
        "shaving", small_environment, constraints=tcs.Constraints(forbid=(CORNER,)), paper=True
    )


@pytest.fixture(scope="module")
def blocked(small_environment):
    """Shaving, with a box."""
    return tcs.score(
        "shaving", small_environment, constraints=tcs.Constraints(blocked=(BOX,)), paper=True
    )


def test_excluded_configurations_are_those_that_stand_on_the_region(forbidden):
    grid, scores = Grid.from_dict(forbidden.grid), forbidden.nominal.scores
    excluded = scores.reason[:, 0] == Reason.EXCLUDED
    footprint = Footprint.of(forbidden.robot_shapes)
    for h in range(grid.size):
        at = grid.configuration(h)
        base = np.array([[at.base_x, at.base_y, at.base_yaw]])
        assert excluded[h] == footprint.overlaps(CORNER, base)[0]
    assert 0 < excluded.sum() < grid.size
    assert forbidden.metadata["constraints"]["excluded"] == excluded.sum()


def test_all_other_scores_are_unchanged(forbidden, small_file):
    free, all_ = forbidden.nominal.scores, small_file.nominal.scores
    kept = free.reason[:, 0] != Reason.EXCLUDED
    np.testing.assert_array_equal(free.reason[kept], all_.reason[kept])
    np.testing.assert_array_equal(free.dexterity[kept], all_.dexterity[kept])
    assert not np.any(free.dexterity[~kept])
    for h, g in np.argwhere(free.reached):
        np.testing.assert_array_equal(free.joints_of(h, g), all_.joints_of(h, g))
    for h, g in np.argwhere(kept[:, None] & (all_.pair >= 0)):
        names = (free.pair_names[free.pair[h, g]], all_.pair_names[all_.pair[h, g]])
        assert names[0] == names[1]


def test_sets_have_no_excluded_member_and_drake_confirms_the_rest(forbidden, tmp_path):
    tcs.save(tmp_path / "a.tcs", forbidden)
    loaded = tcs.load(tmp_path / "a.tcs")
    scores, sets = loaded.nominal.scores, loaded.nominal.sets
    assert not np.any(scores.reason[sets.candidates] == Reason.EXCLUDED)
    assert tcs.verify(loaded, pairs=20, dense=2).is_sound
    assert constraint_texts(loaded) == [f"forbid {CORNER.name}"]
    places = PlaceMap.of(scores, Grid.from_dict(loaded.grid))
    assert places.excluded.any()
    assert not np.any(places.excluded & places.free)


def test_explanation_names_the_constraint(forbidden):
    h = int(np.flatnonzero(forbidden.nominal.scores.reason[:, 0] == Reason.EXCLUDED)[0])
    explanation = tcs.explain(forbidden, 0, h)
    assert explanation.explained.reason == Reason.EXCLUDED
    first = explanation.distribution.checks[0]
    assert first.reason == Reason.EXCLUDED
    assert first.stopped == forbidden.metadata["constraints"]["excluded"]


def test_the_kernel_scores_no_more_than_needed(forbidden, small_job, monkeypatch):
    calls = []
    module = __import__("tcs.placement.scoring.scorer", fromlist=["score"])
    real = module.score

    def counted(problem, rows, grippers):
        calls.append(rows.number)
        return real(problem, rows, grippers)

    monkeypatch.setattr(module, "score", counted)
    scene = small_job.scene()
    out = np.zeros(small_job.grid.size, dtype=np.bool_)
    out[: small_job.grid.size // 2] = True
    found = sweep(small_job.lowered(scene), small_job.task.weights, excluded=out, jobs=1)
    assert sum(calls) == np.count_nonzero(~out)
    assert np.all(found.tables[0].reason[out] == Reason.EXCLUDED)


def test_a_box_is_an_obstacle_of_the_environment(blocked, small_environment, tmp_path):
    path = tmp_path / "environment.yaml"
    path.write_text(
        f"based_on: {small_environment}\nname: cluttered\nobstacles:\n"
        f"  - {{name: blocked_1, box: [0.4, 0.3, 0.9], xyz: [0.9, -0.6, 0.45], "
        f"rpy_deg: [0, 0, {math.degrees(0.3)!r}]}}\n"
    )
    same, found = tcs.score("shaving", path, paper=True).nominal.scores, blocked.nominal.scores
    np.testing.assert_array_equal(found.reason, same.reason)
    np.testing.assert_array_equal(found.dexterity, same.dexterity)
    np.testing.assert_array_equal(found.arm_joints, same.arm_joints)
    assert any("blocked_1" in names for names in found.pair_names)


def test_the_scene_of_the_file_has_the_box(blocked):
    _, scene, _ = rebuild_scenes(blocked)[0]
    # The base in the box: Drake finds the contact.
    scene.place_base(BOX.x, BOX.y, 0.0)
    assert any("blocked_1" in pair[:2] for pair in scene.violations())
    assert tcs.verify(blocked, pairs=20, dense=2).is_sound
    assert scored_constraints(blocked).blocked == (BOX,)


def test_live_scoring_honours_constraints(forbidden, small_environment):
    scorer = tcs.LiveScorer(
        "shaving", small_environment, constraints=tcs.Constraints(forbid=(CORNER,)), paper=True
    )
    live = scorer.score().nominal.scores
    np.testing.assert_array_equal(live.reason, forbidden.nominal.scores.reason)


def test_an_axis_to_keep_has_one_value(small_environment):
    keep = tcs.Constraints(keep=("torso",))
    file = tcs.score("shaving", small_environment, constraints=keep, now={"torso": 0.2}, paper=True)
    torso = Grid.from_dict(file.grid).axis("torso")
    assert (torso.count, torso.start) == (1, 0.15)
    assert constraint_texts(file) == ["only torso = 0.15 m"]
    assert rebuild_scenes(file)[0][0].grid == Grid.from_dict(file.grid)
    with pytest.raises(SelectionError, match=r"keep torso: the current state lacks its value"):
        tcs.score("shaving", small_environment, constraints=keep)
    with pytest.raises(UnknownNameError, match=r"present values: .*'tors'.*Did you mean 'torso'"):
        tcs.score("shaving", small_environment, constraints=keep, now={"tors": 0.2})


def test_all_states_and_torso_levels_of_a_base_pose_are_excluded():
    grid, shapes = small_grid(bed=2, head=3, yaws=3), Footprint((-0.1, -0.3), (0.3, 0.1), 0.0)
    region = tcs.Region(((-0.4, 0.2), (-0.1, 0.2), (-0.1, 0.6)))
    excluded = excluded_configurations((region,), shapes, grid)
    for h in range(grid.size):
        at = grid.configuration(h)
        base = np.array([[at.base_x, at.base_y, at.base_yaw]])
        assert excluded[h] == shapes.overlaps(region, base)[0]
    assert 0 < excluded.sum() < grid.size
    far = tcs.Region(((9, 9), (9, 10), (10, 9)))
    assert excluded_configurations((far,), shapes, grid) is None


def test_forbidding_everything_is_refused(small_environment):
    everywhere = tcs.Region(((-9, -9), (9, -9), (9, 9), (-9, 9)))
    with pytest.raises(SelectionError, match=r"at every base pose of the grid .* Make the regions"):
        tcs.score("shaving", small_environment, constraints=tcs.Constraints(forbid=(everywhere,)))


@pytest.mark.parametrize("entry", [[], {"forbid": [[0, 1]]}, {"blocked": [{"x": 1.0}]}])
def test_a_damaged_record_of_constraints_is_refused(forbidden, entry):
    damaged = dataclasses.replace(forbidden, metadata={**forbidden.metadata, "constraints": entry})
    with pytest.raises(StoreError, match=r"metadata 'constraints'"):
        scored_constraints(damaged)
