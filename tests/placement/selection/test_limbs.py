"""Goals on limbs that are observed one by one, against a plain loop over all kept sets."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.constraints import (
    Constraints,
    Obstacle,
    blocked_bodies,
    blocked_solutions,
)
from tcs.placement.reasons import explain
from tcs.placement.selection import (
    SelectionTables,
    TravelWeights,
    UtilityWeights,
    scores_at_limbs,
    select,
)
from tcs.placement.selection.admission import (
    admitted_at_limbs,
    admitted_candidates,
    tables_of_goals,
)
from tcs.placement.selection.observed import nearest_table
from tcs.placement.tables import ScoreTable
from tests.placement.selection.test_admission import made_up_robot
from tests.placement.selection.test_choice import brute_force
from tests.placement.store.example import score_file
from tests.placement.tables.small import all_sets, set_scores, small_grid

GRID = small_grid(nx=5, ny=3, bed=2)
SHIFTS = {"name": "person_y", "unit": "m", "start": -0.1, "step": 0.05, "count": 5}
HERE = InitialConfiguration(
    base_x=-1.0,
    base_y=0.3,
    base_yaw=0.0,
    torso=0.0,
    environment=(("bed_height", 0.0),),
    environment_units=("m",),
)
WEIGHTS = UtilityWeights(places=0.0, environment=0.0)
SPREAD = {"head": (0.3, 0.06, 0.7), "arm": (0.0, -0.04, 0.7)}
"""The head is nearest to the shift of 5 cm, the arm to that of -5 cm, both together to 0."""


@pytest.fixture(scope="module")
def file():
    """Head and arm shift with the person; the heel stays."""
    shifts = np.arange(-0.1, 0.11, 0.05)
    place = {
        "head": [[(0.3, y, 0.7 + z) for z in (0.0, 0.1)] for y in shifts],
        "arm": [[(0.0, y, 0.7 + z) for z in (0.0, 0.1)] for y in shifts],
        "heel": [[(-0.8, 0.0, 0.5)] * 2 for _ in shifts],
    }
    frames = {name: np.ravel(at).tolist() for name, at in place.items()}
    goals = [{"body_frame": name} for name in ("head", "arm", "heel", "head", "arm")]
    return score_file(
        grid=GRID,
        tables=5,
        observed=[SHIFTS],
        body_frames=frames,
        task={"name": "bathing", "goals": goals},
    )


def test_each_goal_has_the_table_of_its_frame(file):
    match = nearest_table(file, HERE, frames={**SPREAD, "heel": (-0.8, 0.0, 0.5)})
    assert match.index == 2
    assert tables_of_goals(file, match) == (3, 1, 2, 3, 1)
    found = match.to_json()["frames"]
    assert [one["frame"] for one in found] == ["head", "arm", "heel"]
    assert [one["observed"]["person_y"] for one in found] == pytest.approx([0.05, -0.05, 0.0])
    assert [one["position_error"] for one in found] == pytest.approx([0.01, 0.01, 0.0])


@pytest.mark.parametrize("members", [1, 2])
def test_equals_a_loop_over_all_kept_sets(file, members):
    choice = select(file, HERE, weights=WEIGHTS, frames=SPREAD, max_members=members)
    whole, head, arm = (file.tables[i].scores for i in (2, 3, 1))
    dexterity, reason = whole.dexterity.copy(), whole.reason.copy()
    for table, goals in ((head, (0, 3)), (arm, (1, 4))):
        for h in range(GRID.size):
            for g in goals:
                if not table.reached[h, g]:
                    dexterity[h, g], reason[h, g] = 0.0, max(reason[h, g], 1)
                elif whole.reached[h, g]:
                    dexterity[h, g] = min(dexterity[h, g], table.dexterity[h, g])
    reached = reason == 0
    less = ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=np.full(reason.shape, -1, np.int32),
        pair_names=(),
        arm_joints=np.zeros((int(reached.sum()), 7), np.float32),
        weights=whole.weights,
    )
    kept = {
        one: set_scores(less, one)
        for one in all_sets(whole, GRID, 0.4)
        if len(one) <= members and all(reached[h].any() for h in one)
    }
    indices, value, cost = brute_force(kept, GRID, HERE, WEIGHTS, TravelWeights())
    assert (choice.indices, choice.cost) == (indices, cost)
    assert choice.utility == pytest.approx(value, abs=1e-12)
    assert (choice.reachability, choice.manipulability) == pytest.approx(kept[indices])
    # The spread costs something, so that the test is not empty.
    together = select(file, HERE, weights=WEIGHTS, frames={"heel": (-0.8, 0, 0.5)})
    assert choice.utility < together.utility


@pytest.mark.parametrize(
    "frames",
    [{"head": (0.3, 0.06, 0.7)}, {"head": (0.3, 0.06, 0.7), "arm": (0.0, 0.05, 0.7)}],
    ids=["one frame", "two that agree"],
)
def test_one_frame_or_frames_that_agree_use_one_table(file, frames):
    choice = select(file, HERE, frames=frames)
    same = select(file, HERE, observed={"person_y": 0.05})
    assert choice.match.index == 3
    assert ("frames" in choice.match.to_json()) == (len(frames) > 1)
    assert (choice.indices, choice.utility) == (same.indices, same.utility)
    np.testing.assert_equal(dataclasses.astuple(choice)[3:7], dataclasses.astuple(same)[3:7])


def test_obstacles_block_the_solutions_of_every_table(file):
    robot = dataclasses.replace(made_up_robot(), torso_shift=np.zeros((2, 3)))
    metadata = {**file.metadata, "robot_shapes": robot.to_dict()}
    file = dataclasses.replace(file, metadata=metadata)
    match = nearest_table(file, HERE, frames=SPREAD)
    box = Obstacle.parse("0.1 0.4 0.2 0.1 20 0.5 0.8")
    constraints = Constraints(blocked=(box,))
    tables = [SelectionTables.of(file, i) for i in (2, 3, 1)]
    admitted = admitted_candidates(constraints, HERE, tables[0], tables[0].index)
    found = admitted_at_limbs(file, match, constraints, admitted)
    # In plain loops: free in the table nearest to all, and in that of the goal's own frame.
    free = []
    for one in tables:
        everyone = np.ones(len(one.sets.candidates), dtype=np.bool_)
        (postures,) = one.postures
        hit = blocked_solutions(box, postures, everyone)
        pairs = zip(*postures.pairs, hit, strict=True)
        free.append({(int(one.sets.candidates[c]), int(g)) for c, g, is_hit in pairs if not is_hit})
    candidates = tables[0].sets.candidates
    standing = ~blocked_bodies(box, tables[0].postures[0])
    own = {0: free[1], 3: free[1], 1: free[2], 4: free[2], 2: free[0]}
    for c, h in enumerate(candidates.tolist()):
        expected = [(h, g) in free[0] and (h, g) in own[g] for g in range(5)]
        if standing[c] and admitted.candidates[c]:
            assert found.reached[c].tolist() == expected
            assert found.candidates[c] == any(expected)
    choice = select(file, HERE, frames=SPREAD, constraints=constraints)
    without = select(file, HERE, frames=SPREAD)
    assert choice.utility < without.utility


def test_scores_where_each_limb_is(file):
    match = nearest_table(file, HERE, frames=SPREAD)
    whole, head, arm = (file.tables[i].scores for i in (2, 3, 1))
    found = scores_at_limbs(file, match)
    own = (head, arm, whole, head, arm)
    for h, g in np.ndindex(found.reason.shape):
        first = whole if whole.reason[h, g] else own[g]
        assert found.reason[h, g] == first.reason[h, g]
        assert found.dexterity[h, g] == min(whole.dexterity[h, g], own[g].dexterity[h, g])
        pair, names = found.pair[h, g], first.pair[h, g]
        assert (pair < 0) == (names < 0)
        assert pair < 0 or found.pair_names[pair] == first.pair_names[names]
        if found.reached[h, g]:
            np.testing.assert_array_equal(found.joints_of(h, g), whole.joints_of(h, g))
    together = nearest_table(file, HERE, frames={"heel": (-0.8, 0, 0.5)})
    assert scores_at_limbs(file, together) is file.tables[together.index].scores


def test_an_explanation_follows_the_limb_of_the_goal(file):
    match = nearest_table(file, HERE, frames=SPREAD)
    whole, found = file.tables[2].scores, scores_at_limbs(file, match)
    h = int(np.flatnonzero(whole.reached[:, 0] & ~found.reached[:, 0])[0])
    explanation = explain(file, 0, h, frames={**SPREAD})
    assert not explanation.explained.is_reached
    assert explanation.explained.reason == found.reason[h, 0]
    assert found.reached[explanation.fix.index, 0]
    assert [one["frame"] for one in explanation.to_json()["frames"]] == ["head", "arm"]


def test_constraints_hold_too(file):
    only = Constraints(only=("base_x <= 0 m",))
    choice = select(file, HERE, frames=SPREAD, constraints=only)
    assert all(member.base_x <= 1e-9 for member in choice.members)
    assert choice.constraints[0].constraint == "only base_x <= 0 m"


def test_limbs_from_which_nothing_is_reached_are_refused(file):
    none = file.tables[3]
    empty = dataclasses.replace(file, task={"name": "x", "goals": [{"body_frame": "arm"}] * 5})
    assert none.sets.reached.any()
    low = score_file(
        grid=GRID, tables=5, share=0.0, observed=[SHIFTS], body_frames=empty.body_frames
    )
    tables = (low.tables[0], low.tables[1], file.tables[2], file.tables[3], file.tables[4])
    empty = dataclasses.replace(empty, tables=tables)
    with pytest.raises(SelectionError, match=r"limbs where they are observed, no initial"):
        select(empty, HERE, frames=SPREAD)
