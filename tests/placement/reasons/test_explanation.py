import dataclasses
import math

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.reasons import fix_weights
from tcs.placement.reasons.distribution import CHECKS
from tcs.placement.scoring.sets import build_sets
from tcs.placement.store import StateTables
from tcs.placement.tables import Reason, ScoreTable
from tests.placement.store.example import SHIFT, score_file
from tests.placement.tables.small import small_grid

GRID = small_grid(nx=4, ny=3, yaws=4, torsos=2, bed=2, head=2)


def cost(before, after, weights):
    """Cost of a straight change, in plain numbers."""
    total = weights.metre * math.hypot(after.base_x - before.base_x, after.base_y - before.base_y)
    turn = abs(math.remainder(after.base_yaw - before.base_yaw, 2 * math.pi))
    total += weights.turn * turn + weights.torso * abs(after.torso - before.torso)
    start, end = dict(before.environment), dict(after.environment)
    return total + sum(w * abs(end[name] - start[name]) for name, w in weights.environment)


def nearest(file, goal, before, weights, held):
    """The cheapest configuration that reaches a goal and loses fewest of `held`, by loops."""
    grid, scores = Grid.from_dict(file.grid), file.nominal.scores
    best, fewest = None, None
    for h in range(grid.size):
        if scores.reason[h, goal] != Reason.REACHED:
            continue
        lost = sum(1 for other in held if not scores.reached[h, other])
        if fewest is not None and lost > fewest:
            continue
        if fewest is None or lost < fewest:
            best, fewest = None, lost
        price = cost(before, grid.configuration(h), weights)
        value = sum(
            float(w) * float(i) for w, i in zip(scores.weights, scores.dexterity[h], strict=True)
        )
        if (
            best is None
            or price < best[1] - 1e-9
            or (price < best[1] + 1e-9 and value > best[2] + 1e-12)
        ):
            best = (h, price, value)
    return best


@pytest.mark.parametrize("share", [0.02, 0.1, 0.4])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"metre": 0.0, "turn": 0.0},
        {"turn": 2.0, "torso": 0.1, "environment": (("head_rest", 0.0), ("bed_height", 0.3))},
    ],
    ids=["default", "free driving", "other"],
)
def test_fix_equals_brute_force(share, changes):
    file = score_file(grid=GRID, share=share)
    weights = fix_weights(GRID, route="straight", **changes)
    rng = np.random.default_rng(8)
    for _ in range(12):
        h, goal = int(rng.integers(GRID.size)), int(rng.integers(5))
        explained = tcs.explain(file, goal, h, weights=weights)
        before = GRID.configuration(h)
        held = np.flatnonzero(file.nominal.scores.reached[h])
        index, price, value = nearest(file, goal, before, weights, held)
        fix = explained.fix
        assert fix.index == index
        # Sums of five terms in another order.
        assert fix.cost == pytest.approx(price, abs=1e-12)
        assert fix.manipulability == pytest.approx(value, abs=1e-12)
        assert fix.configuration == GRID.configuration(index)
        scores = file.nominal.scores
        assert fix.reached == tuple(g for g in range(5) if scores.reached[index, g])
        assert fix.lost == tuple(
            g for g in range(5) if scores.reached[h, g] and not scores.reached[index, g]
        )


def test_fix_starts_at_the_stated_place():
    file = score_file(grid=GRID, share=0.05)
    here = InitialConfiguration(
        base_x=-0.42,
        base_y=0.33,
        base_yaw=0.3,
        torso=0.1,
        environment=(("bed_height", 0.04), ("head_rest", 0.2)),
        environment_units=("m", "rad"),
    )
    weights = fix_weights(GRID, route="straight")
    explained = tcs.explain(file, 1, here, weights=weights)
    held = np.flatnonzero(file.nominal.scores.reached[explained.explained.index])
    index, price, _ = nearest(file, 1, here, weights, held)
    assert (explained.fix.index, explained.fix.cost) == (index, pytest.approx(price, abs=1e-12))
    changed = {change.axis: change for change in explained.fix.changes}
    assert changed["base_x"].start == -0.42
    assert changed["torso"].start == 0.1
    # Following the changes leads to the configuration.
    end = explained.fix.configuration.to_json()
    start = here.to_json()
    for axis, change in changed.items():
        moved = start[axis] + change.change - end[axis]
        assert (math.remainder(moved, 360.0) if axis == "base_yaw_deg" else moved) == pytest.approx(
            0.0, abs=1e-8
        )
    assert set(changed) == {axis for axis in end if abs(end[axis] - start[axis]) > 1e-8}


def test_ties_go_to_the_greater_manipulability():
    grid = small_grid(nx=3, ny=1, yaws=1, torsos=1, step=0.15)
    x = grid.values(np.arange(3))["base_x"]
    assert x[1] - x[0] != x[2] - x[1]
    for values in ((0.2, 0.0, 0.6), (0.6, 0.0, 0.2)):
        file = made(grid, lambda h, values=values: values[h] or Reason.TOO_FAR)
        fix = tcs.explain(file, 0, 1, weights=fix_weights(grid, route="straight")).fix
        # One step to either side costs the same, but for the last bit.
        assert fix.index == int(np.argmax(values))


def made(grid, outcome):
    """A file of one goal: for each configuration its dexterity where reached, else the reason."""
    outcomes = [outcome(h) for h in range(grid.size)]
    reached = np.array([not isinstance(one, Reason) for one in outcomes])
    dexterity = np.where(reached, outcomes, 0.0).astype(np.float32)
    reason = np.where(reached, Reason.REACHED, outcomes).astype(np.uint8)
    blocked = reason >= Reason.BODY_BLOCKED
    scores = ScoreTable(
        dexterity=dexterity[:, None],
        reason=reason[:, None],
        pair=np.where(blocked, 0, -1).astype(np.int32)[:, None],
        pair_names=(("base", "bed"),),
        arm_joints=np.zeros((int(reached.sum()), 7), np.float32),
        weights=np.ones(1),
    )
    tables = (StateTables.of(scores, build_sets(scores, grid)),)
    return dataclasses.replace(score_file(grid=grid), tables=tables)


def bed_between(h, here_side):
    """A bed along x = 0.1 on a grid of 1.8 m by 1.8 m, open at one end; reached beyond it."""
    x, y = divmod(h, 10)
    if x == 4 and y < 8:
        return Reason.BODY_BLOCKED
    if (x, y) == (5, 2) or (x, y) == (here_side, 2):
        return 0.5
    return Reason.TOO_FAR


@pytest.fixture(scope="module")
def bedside():
    grid = small_grid(nx=10, ny=10, yaws=1, torsos=1)
    return grid, made(grid, lambda h: bed_between(h, here_side=0))


def test_path_around_the_furniture(bedside):
    grid, file = bedside
    here = 3 * 10 + 2
    straight = tcs.explain(file, 0, here, weights=fix_weights(grid, route="straight")).fix
    assert (straight.index, straight.sentence) == (52, "Drive 40 cm forward.")
    # By default around: on this side of the bed it is 60 cm.
    around = tcs.explain(file, 0, here).fix
    assert (around.index, around.sentence) == (2, "Drive 60 cm back.")
    assert (around.route, around.driving) == ("around", pytest.approx(0.6))


def test_detour_is_refused():
    grid = small_grid(nx=10, ny=10, yaws=1, torsos=1)
    file = made(grid, lambda h: bed_between(h, here_side=5))
    fix = tcs.explain(file, 0, 3 * 10 + 2).fix
    assert fix.index == 52
    # From y = 0.5 up to y = 1.7, over two columns and back down; the corners at the bed are
    # not cut.
    assert fix.driving > 2 * 1.0 + 0.4
    assert fix.sentence == f"Drive 40 cm forward ({fix.driving:.2f} m around the furniture)."


def test_distances_are_straight_from_a_base_in_contact(bedside):
    grid, file = bedside
    blocked = 4 * 10 + 1
    explained = tcs.explain(file, 0, blocked)
    assert explained.explained.reason == Reason.BODY_BLOCKED
    assert explained.weights.route == "around"
    assert (explained.fix.route, explained.fix.index) == ("straight", 52)
    # A robot with a pose error remains on its side of the bed.
    place = dataclasses.replace(grid.configuration(blocked), base_x=0.06)
    explained = tcs.explain(file, 0, place)
    assert explained.explained.index == blocked
    assert (explained.fix.route, explained.fix.index) == ("around", 2)


def test_distances_are_straight_from_an_enclosed_base():
    grid = small_grid(nx=10, ny=10, yaws=1, torsos=1)

    def outcome(h):
        x, y = divmod(h, 10)
        if 3 <= x <= 6 and 3 <= y <= 6:
            return Reason.BODY_BLOCKED
        return 0.5 if h == 0 else Reason.TOO_FAR

    file = made(grid, outcome)
    place = dataclasses.replace(grid.configuration(44), base_x=0.15, base_y=0.95)
    explained = tcs.explain(file, 0, place)
    assert (explained.fix.route, explained.fix.index) == ("straight", 0)


def test_distribution_equals_counting():
    file = score_file(grid=GRID, share=0.3)
    scores = file.nominal.scores
    for goal in range(5):
        found = tcs.explain(file, goal).distribution
        reasons = [Reason(r) for r in scores.reason[:, goal]]
        assert found.reasons == {reason: reasons.count(reason) for reason in Reason}
        assert found.configurations == GRID.size
        blocking = [
            (scores.pair_names[pair], reason)
            for pair, reason in zip(scores.pair[:, goal], reasons, strict=True)
            if pair >= 0
        ]
        counted = {(one.pair, one.reason): one.count for one in found.blocking_pairs}
        assert counted == {key: blocking.count(key) for key in set(blocking)}
        counts = [one.count for one in found.blocking_pairs]
        assert counts == sorted(counts, reverse=True)
        left = GRID.size
        for check, reason in zip(found.checks, CHECKS[1:-4], strict=True):
            assert (check.reason, check.of) == (reason, left)
            left -= check.stopped
        assert left == found.reasons[Reason.REACHED]
        assert found.farthest.reason == Reason.ARM_BLOCKED


def test_best_member_is_explained_by_default():
    file = score_file(grid=GRID, share=0.1)
    sets = file.nominal.sets
    for goal in range(5):
        explained = tcs.explain(file, goal)
        assert explained.best_set == sets.best
        alone = {h: sum(sets.scores_of((h,))) for h in sets.best}
        assert alone[explained.explained.index] == max(alone.values())
        assert explained.best_reaching == tuple(
            h for h in sets.best if file.nominal.scores.reached[h, goal]
        )


def test_goal_that_is_reached_needs_no_change():
    file = score_file(grid=GRID)
    h = int(file.nominal.sets.candidates[3])
    goal = int(np.argmax(file.nominal.scores.reached[h]))
    explained = tcs.explain(file, goal, h)
    assert explained.explained.is_reached
    assert (explained.fix.index, explained.fix.changes) == (h, ())
    # Half a turn less half a turn leaves a bit of rounding.
    assert explained.fix.cost == pytest.approx(0.0, abs=1e-12)
    assert explained.to_json()["nearest_reaching"]["cost"] == 0.0
    assert explained.fix.sentence == "Nothing needs to change."


def test_goal_that_nothing_reaches():
    grid = small_grid(nx=4, ny=3, yaws=1, torsos=1)
    gripper = Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT
    reasons = [Reason.BODY_BLOCKED] * 6 + [Reason.TOO_FAR] * 4 + [gripper] * 2
    file = made(grid, reasons.__getitem__)
    for configuration in (None, 7):
        explained = tcs.explain(file, 0, configuration)
        assert (explained.explained is None) == (configuration is None)
        plain = explained.to_json()
        assert plain["nearest_reaching"] is None
        assert plain["reasons"]["reached"] == 0
        # Free of contact but too far: these passed the most checks.
        assert plain["farthest"] == {"reason": "too_far", "of": 4, "stopped": 4}
        assert plain["blocking_pairs"][0] == {
            "pair": ["base", "bed"],
            "reason": "body_blocked",
            "count": 6,
        }


def test_observed_state_chooses_the_table():
    file = score_file(tables=3, observed=[SHIFT], share=0.1)
    for index, shift in enumerate((-0.05, 0.0, 0.05)):
        explained = tcs.explain(file, 2, 5, observed={"person_y": shift + 0.01})
        scores = file.tables[index].scores
        assert explained.match.index == index
        assert explained.explained.reason == scores.reason[5, 2]
        assert explained.distribution.reached == int(scores.reached[:, 2].sum())
        assert scores.reached[explained.fix.index, 2]
        assert explained.to_json()["observed"] == {"person_y": shift}
    assert tcs.explain(file, 2, 5).match.index == 1


def test_keys():
    plain = tcs.explain(score_file(grid=GRID, share=0.1), 3, 0).to_json()
    assert {"reasons", "blocking_pairs", "nearest_reaching"} <= set(plain)
    assert list(plain["reasons"]) == [reason.name.lower() for reason in Reason]
    assert {"members", "changes", "sentence", "cost"} <= set(plain["nearest_reaching"])
    (member,) = plain["nearest_reaching"]["members"]
    assert set(member) == {
        *("base_x", "base_y", "base_yaw_deg", "torso", "bed_height", "head_rest_deg"),
    }
    assert plain["weights"]["environment"] == {"bed_height": 2.0, "head_rest": 1.0}


@pytest.mark.parametrize("goal", [-1, 5, True])
def test_no_such_goal(goal):
    with pytest.raises(SelectionError, match=rf"no goal {goal}: .* has 5, numbered 0 to 4"):
        tcs.explain(score_file(), goal)


def test_weight_of_an_unknown_axis():
    file = score_file(grid=GRID)
    weights = tcs.TravelWeights(environment=(("bed_hight", 1.0),))
    with pytest.raises(UnknownNameError, match="Did you mean 'bed_height'"):
        tcs.explain(file, 0, weights=weights)
