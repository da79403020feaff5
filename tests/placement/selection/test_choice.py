import dataclasses
import itertools
import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given, settings

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.constraints import Constraints
from tcs.placement.scoring.sets import build_sets, lattice_of
from tcs.placement.selection import (
    SelectionTables,
    TravelWeights,
    UtilityWeights,
    branch_and_bound,
    select,
)
from tcs.placement.tables import Reason, ScoreTable
from tests.placement.tables.small import all_sets, random_scores, small_grid

HERE = InitialConfiguration(base_x=-2.0, base_y=0.5, base_yaw=0.0, torso=0.0)


def leg(p, q, travel):
    """Cost of one leg between two configurations, in scalar arithmetic."""
    dx, dy = q.base_x - p.base_x, q.base_y - p.base_y
    cost = travel.metre * math.sqrt(dx * dx + dy * dy)
    turn = abs(q.base_yaw - p.base_yaw)
    cost += travel.turn * abs((turn + math.pi) % (2 * math.pi) - math.pi)
    cost += travel.torso * abs(q.torso - p.torso)
    before, after = dict(p.environment), dict(q.environment)
    for name, weight in travel.environment:
        cost += weight * abs(after[name] - before[name])
    return cost


def keeps(configuration, here, grid):
    """Whether a configuration has the scored environment state nearest to the present one."""
    at = dict(configuration.environment)
    for name, now in here.environment:
        values = grid.axis(name).values.tolist()
        nearest = min(values, key=lambda value: abs(value - now))
        if at[name] != nearest:
            return False
    return True


def brute_force(kept, grid, here, weights, travel, disliked=()):
    """Members, utility and cost of the best of all kept sets, the first among equals.

    Sets are compared by their utility less their penalties; `disliked` holds functions that
    return whether a configuration violates a preference.
    """
    best = None
    configuration = {h: grid.configuration(h) for members in kept for h in members}
    for members, (reachability, manipulability) in kept.items():
        tours = []
        for order in itertools.permutations(members):
            stops = [here, *(configuration[h] for h in order)]
            cost = 0.0
            for p, q in itertools.pairwise(stops):
                cost += leg(p, q, travel)
            tours.append(cost)
        cost = min(tours)
        value = (
            weights.reachability * reachability + weights.manipulability * manipulability
        ) - weights.travel * cost
        left = 1.0 - weights.places * (len(members) - 1)
        net = (
            weights.reachability * left * reachability
            + weights.manipulability * left * manipulability
        ) - weights.travel * cost
        penalty = 0.0
        for dislikes in disliked:
            penalty += weights.preference * any(dislikes(configuration[h]) for h in members)
        if not all(keeps(configuration[h], here, grid) for h in members):
            penalty += weights.environment
        net -= penalty
        if best is None or net > best[0]:
            best = (net, members, value, cost)
    return best[1:]


weight = st.one_of(st.just(0.0), st.sampled_from([0.05, 0.5, 1.0, 10.0]), st.floats(0.0, 3.0))
no_penalties = {"places": st.just(0.0), "environment": st.just(0.0)}
utility_weights = st.builds(
    UtilityWeights, reachability=weight, manipulability=weight, travel=weight, **no_penalties
)
all_weights = st.builds(
    UtilityWeights,
    reachability=weight,
    manipulability=weight,
    travel=weight,
    places=st.sampled_from([0.0, 0.01, 0.3]),
    environment=weight,
    preference=weight,
)
place = st.one_of(st.sampled_from([-0.7, -0.5, -0.1, 0.1, 0.3]), st.floats(-3.0, 3.0))


@settings(deadline=None, max_examples=80)
@given(
    seed=st.integers(0, 2**32 - 1),
    goals=st.integers(1, 5),
    levels=st.sampled_from([0, 1, 2]),
    share=st.sampled_from([0.1, 0.5, 1.0]),
    beds=st.sampled_from([(0, 0), (2, 0), (2, 2)]),
    min_distance=st.sampled_from([0.0, 0.4]),
    weights=all_weights,
    travel=st.tuples(weight, weight, weight, weight, weight),
    turned=st.booleans(),
    where=st.tuples(place, place, st.floats(-7.0, 7.0), st.floats(0.0, 0.2)),
    bed_now=st.floats(0.0, 0.15),
    first_candidates=st.sampled_from([1, 5, branch_and_bound.FIRST_CANDIDATES]),
    options=st.fixed_dictionaries(
        {
            "rule": st.sampled_from(["paper", "code2015"]),
            "same_environment": st.booleans(),
            "max_members": st.sampled_from([1, 2, 3]),
        }
    ).filter(lambda options: options["rule"] == "paper" or options["max_members"] < 3),
    chunk=st.sampled_from([3, branch_and_bound.CHUNK]),
    cells=st.sampled_from(
        [(branch_and_bound.FIRST_CELLS, branch_and_bound.MOST_CELLS), (1, 1.0), (2, 0.5)]
    ),
)
def test_equals_brute_force_over_all_kept_sets(
    seed,
    goals,
    levels,
    share,
    beds,
    min_distance,
    weights,
    travel,
    turned,
    where,
    bed_now,
    first_candidates,
    options,
    chunk,
    cells,
):
    bed, head = beds
    grid = small_grid(nx=5, ny=2, yaws=3, torsos=1 if bed else 2, bed=bed, head=head)
    scores = random_scores(grid, goals, seed, levels=levels, share=share)
    kept = all_sets(scores, grid, min_distance, **options)
    assume(kept)
    axes = grid.environment_axes
    travel = TravelWeights(
        metre=travel[0],
        turn=travel[1],
        torso=travel[2],
        environment=tuple((axis.name, w) for axis, w in zip(axes, travel[3:], strict=False)),
    )
    here = InitialConfiguration(
        base_x=where[0],
        base_y=where[1],
        # Headings are equal modulo a full rotation.
        base_yaw=math.remainder(where[2], 2 * math.pi),
        torso=where[3],
        environment=tuple((axis.name, bed_now) for axis in axes),
        environment_units=tuple(axis.held_unit for axis in axes),
    )
    tables = SelectionTables(build_sets(scores, grid, min_distance=min_distance, **options), grid)
    with pytest.MonkeyPatch.context() as patch:
        # Small tables open every group in the first round, unless that is small too.
        patch.setattr(branch_and_bound, "FIRST_CANDIDATES", first_candidates)
        patch.setattr(branch_and_bound, "CHUNK", chunk)
        patch.setattr(branch_and_bound, "FIRST_CELLS", cells[0])
        patch.setattr(branch_and_bound, "MOST_CELLS", cells[1])
        constraints = Constraints(prefer=("base_yaw = 120 deg", "base_x <= 0")) if turned else None
        asked = {"weights": weights, "travel": travel, "constraints": constraints or Constraints()}
        choice = select(tables, here, **asked)
        select(tables, dataclasses.replace(here, base_x=here.base_x + 1.0), **asked)
        # Later selections use what is kept of the former.
        later = select(tables, here, **asked)
    assert dataclasses.replace(later, seconds=choice.seconds) == choice
    disliked = (lambda c: abs(c.base_yaw - 2.0943951) > 1e-3, lambda c: c.base_x > 1e-9)
    members, value, cost = brute_force(
        kept, grid, here, weights, travel, disliked if turned else ()
    )
    assert choice.indices == members
    assert (choice.utility, choice.cost) == (value, cost)
    assert (choice.reachability, choice.manipulability) == kept[members]


def floor_with_walls(grid, seed, fraction):
    """Return a lattice on which this fraction of the positions is blocked."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((grid.axis("base_x").count, grid.axis("base_y").count)) < fraction
    reason = np.full((grid.size, 1), Reason.TOO_FAR, dtype=np.uint8)
    along = grid.indices(np.arange(grid.size))[:, -4:]
    reason[blocked[along[:, 0], along[:, 1]]] = Reason.BODY_BLOCKED
    scores = ScoreTable(
        dexterity=np.zeros((grid.size, 1), dtype=np.float32),
        reason=reason,
        pair=np.full((grid.size, 1), -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((0, 7), dtype=np.float32),
        weights=np.ones(1),
    )
    return lattice_of(scores, grid)


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    levels=st.sampled_from([0, 1, 2]),
    blocked=st.sampled_from([0.1, 0.5, 0.8]),
    weights=utility_weights,
    metre=weight,
    turn=weight,
    where=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
)
def test_equals_brute_force_around_the_furniture(
    seed, levels, blocked, weights, metre, turn, where
):
    grid = small_grid(nx=6, ny=5, yaws=2, torsos=1)
    scores = random_scores(grid, 3, seed, levels=levels, share=0.3)
    sets = dataclasses.replace(
        build_sets(scores, grid), lattice=floor_with_walls(grid, seed, blocked)
    )
    kept = all_sets(scores, grid, 0.4)
    tables = SelectionTables(sets, grid)
    distances = tables.index.distances["around"]
    here = state(base_x=where[0], base_y=where[1], base_yaw=1.0)
    travel = TravelWeights(metre=metre, turn=turn, route="around")
    try:
        metres = distances.from_position(*where)
    except SelectionError:
        with pytest.raises(SelectionError, match="no path around the furniture starts there"):
            select(tables, here, weights=weights, travel=travel)
        return
    cell = dict(zip(sets.candidates.tolist(), sets.cell.tolist(), strict=True))
    yaw = {h: grid.configuration(h).base_yaw for h in cell}
    best = None
    for members, both in kept.items():
        if not all(np.isfinite(metres[cell[h]]) for h in members):
            continue
        costs = []
        for first, *rest in itertools.permutations(members):
            cost = metre * metres[cell[first]] + turn * abs(yaw[first] - 1.0)
            for h in rest:
                driven = metre * distances.between(np.array(cell[first]), np.array(cell[h]))
                cost += driven + turn * abs(yaw[h] - yaw[first])
            costs.append(cost)
        value = weights.reachability * both[0] + weights.manipulability * both[1]
        value -= weights.travel * min(costs)
        if best is None or value > best[1]:
            best = (members, value, min(costs))
    if best is None:
        with pytest.raises(SelectionError, match="no path around the furniture leads to"):
            select(tables, here, weights=weights, travel=travel)
        return
    choice = select(tables, here, weights=weights, travel=travel)
    for _ in range(2):
        later = select(tables, here, weights=weights, travel=travel)
        assert dataclasses.replace(later, seconds=choice.seconds) == choice
    assert choice.unreachable == sum(not np.isfinite(metres[c]) for c in cell.values())
    assert choice.utility == pytest.approx(best[1], rel=1e-12, abs=1e-12)
    if not turn:
        # Only the library wraps rotations, which may cost a tie its last bit.
        assert (choice.indices, choice.utility, choice.cost) == best


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("levels", [0, 2, 50], ids=["distinct", "many ties", "some ties"])
def test_equals_brute_force_on_a_larger_table(seed, levels, monkeypatch):
    monkeypatch.setattr(branch_and_bound, "FIRST_CANDIDATES", 8)
    monkeypatch.setattr(branch_and_bound, "FIRST_CELLS", 1 + 3 * (seed % 2))
    monkeypatch.setattr(branch_and_bound, "MOST_CELLS", 0.25 if seed > 1 else 1.0)
    grid = small_grid(nx=12, ny=8, yaws=2, torsos=1, step=0.15)
    scores = random_scores(grid, 8, seed, levels=levels, share=0.2)
    kept = all_sets(scores, grid, 0.4)
    tables = SelectionTables(build_sets(scores, grid), grid)
    assert tables.sets.kept_pairs > 100  # otherwise the first round opens every group
    rng = np.random.default_rng(seed)
    members = list(kept)
    reachability, manipulability = np.array(list(kept.values())).T
    xy = {
        h: (c.base_x, c.base_y)
        for (h,) in members[: len(tables.sets.candidates)]
        for c in [grid.configuration(h)]
    }
    for alpha, beta, gamma in [
        (1, 1, 0.05),
        (1, 0, 0),
        (0, 1, 0),
        (1, 1, 3),
        (0.3, 2, 0.1),
        (0, 0, 1),
        (0, 0, 0),
        (1, 0, 0.05),
    ]:
        x, y = rng.uniform(-3.0, 3.0, 2)
        here = InitialConfiguration(base_x=x, base_y=y, base_yaw=0.0, torso=0.0)
        legs = {h: math.sqrt((p[0] - x) ** 2 + (p[1] - y) ** 2) for h, p in xy.items()}
        cost = [
            legs[m[0]]
            if len(m) == 1
            else min(legs[m[0]], legs[m[1]])
            + math.sqrt((xy[m[1]][0] - xy[m[0]][0]) ** 2 + (xy[m[1]][1] - xy[m[0]][1]) ** 2)
            for m in members
        ]
        values = (alpha * reachability + beta * manipulability) - gamma * np.array(cost)
        first = int(np.argmax(values))
        weights = UtilityWeights(
            reachability=alpha, manipulability=beta, travel=gamma, places=0.0, environment=0.0
        )
        choice = select(tables, here, weights=weights)
        assert choice.indices == members[first]
        assert choice.utility == values[first]
        select(tables, dataclasses.replace(here, base_x=x + 0.3), weights=weights)
        choice = select(tables, here, weights=weights)
        assert choice.indices == members[first]
        assert choice.utility == values[first]


def test_bounds_are_computed_for_the_groups_of_few_cells(monkeypatch):
    """Of a robot that is near some of its cells, the groups of the others are not looked at."""
    grid = small_grid(nx=12, ny=8, yaws=2, torsos=1, step=0.15)
    tables = SelectionTables(build_sets(random_scores(grid, 8, 0, share=0.2), grid), grid)
    examined = []
    among = branch_and_bound._best_among

    def counted(bounds, *rest):
        examined.append(bounds.groups.size)
        return among(bounds, *rest)

    monkeypatch.setattr(branch_and_bound, "_best_among", counted)
    here = InitialConfiguration(base_x=0.5, base_y=0.5, base_yaw=0.0, torso=0.0)
    travel = select(tables, here, weights=UtilityWeights(travel=1.0))
    assert sum(examined) < tables.index.groups[0].cells[0].size / 2
    monkeypatch.setattr(branch_and_bound, "FIRST_CELLS", tables.sets.cell_xy.shape[0])
    assert select(tables, here, weights=UtilityWeights(travel=1.0)).indices == travel.indices


@pytest.mark.parametrize("members", [2, 3])
def test_groups_of_further_cells_are_examined(members, monkeypatch):
    """The best set need not be in the groups that are examined first."""
    grid = small_grid(nx=6, ny=4, yaws=2, torsos=1, step=0.3)
    rng, found = np.random.default_rng(1), []
    among = branch_and_bound._best_among

    def recorded(bounds, to_beat, best):
        result = among(bounds, to_beat, best)
        found.append(best is not None and result is not best)
        return result

    monkeypatch.setattr(branch_and_bound, "_best_among", recorded)
    monkeypatch.setattr(branch_and_bound, "MOST_CELLS", 1.0)
    for seed in range(12):
        scores = random_scores(grid, 6, seed, share=0.3)
        tables = SelectionTables(build_sets(scores, grid, max_members=members), grid)
        for gamma in (0.1, 0.5, 2.0):
            x, y, yaw = rng.uniform(-2.0, 2.0, 3)
            here = InitialConfiguration(base_x=x, base_y=y, base_yaw=yaw, torso=0.0)
            options = {
                "weights": UtilityWeights(travel=gamma, manipulability=3.0),
                "travel": TravelWeights(turn=0.5),
            }
            monkeypatch.setattr(branch_and_bound, "FIRST_CELLS", 1)
            choice = select(tables, here, **options)
            monkeypatch.setattr(branch_and_bound, "FIRST_CELLS", 10_000)
            assert select(tables, here, **options).indices == choice.indices
    assert any(found)


@pytest.fixture(scope="module")
def tables():
    grid = small_grid(nx=8, ny=4, bed=2)
    return SelectionTables(build_sets(random_scores(grid, 5, seed=1, share=0.3), grid), grid)


def test_the_choice_holds_the_selected_set(tables):
    choice = select(tables, HERE, weights=UtilityWeights(travel=0.0))
    assert choice.indices == tables.sets.best
    assert len(choice.indices) == 2
    assert choice.members == tuple(tables.grid.configuration(h) for h in choice.indices)
    assert sorted(choice.order) == [0, 1]
    assert choice.seconds > 0.0
    visits = [HERE, *(choice.members[i] for i in choice.order)]
    legs = [
        math.dist((p.base_x, p.base_y), (q.base_x, q.base_y)) for p, q in itertools.pairwise(visits)
    ]
    # Two legs, each rounded once.
    assert choice.cost == pytest.approx(sum(legs), rel=1e-14)


def test_one_member_at_most(tables):
    free = UtilityWeights(travel=0.0)
    assert select(tables, HERE, weights=free, max_members=1).indices == tables.sets.best_single
    with pytest.raises(SelectionError, match="max_members is 0; must be 1 or more"):
        select(tables, HERE, max_members=0)
    held = "holds sets of 1 and 2 only. Score the task again: tcs score ... --max-members 3."
    with pytest.raises(SelectionError, match=held):
        select(tables, HERE, max_members=3)
    with pytest.raises(SelectionError, match="No set has more than 3"):
        select(tables, HERE, max_members=4)


def test_full_rotations_of_the_robot_change_nothing(tables):
    travel = TravelWeights(turn=0.5)
    turned = InitialConfiguration(base_x=-2.0, base_y=0.5, base_yaw=2 * math.pi, torso=0.0)
    one, two = select(tables, HERE, travel=travel), select(tables, turned, travel=travel)
    assert (one.indices, one.cost) == (two.indices, two.cost)


def test_expensive_travel_selects_a_near_set(tables):
    near = select(tables, HERE, weights=UtilityWeights(travel=1e6))
    sets = tables.sets
    nearest = np.hypot(*(sets.cell_xy - [HERE.base_x, HERE.base_y]).T).min()
    assert near.cost == pytest.approx(nearest, rel=1e-14)
    assert len(near.indices) == 1


def test_no_goal_is_reached():
    grid = small_grid()
    sets = build_sets(random_scores(grid, 3, seed=0, share=0.0), grid)
    with pytest.raises(SelectionError, match="no initial configuration reaches a goal"):
        select(SelectionTables(sets, grid), HERE)


def state(**changes):
    plain = {"base_x": 0.0, "base_y": 0.0, "base_yaw": 0.0, "torso": 0.0}
    return InitialConfiguration(**(plain | changes))


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e7, None, "1"])
@pytest.mark.parametrize("axis", ["base_x", "base_yaw", "torso"])
def test_an_impossible_state_is_refused(tables, axis, value):
    with pytest.raises(SelectionError, match=f"Current state: {axis} is"):
        select(tables, state(**{axis: value}))


def test_the_bed_is_needed_only_if_it_has_a_weight(tables):
    select(tables, state())
    travel = TravelWeights(environment=(("bed_height", 1.0),))
    with pytest.raises(SelectionError, match="lacks bed_height"):
        select(tables, state(), travel=travel)
    with pytest.raises(SelectionError, match="'bed_height' is given in 'rad'; must be in 'm'"):
        select(
            tables,
            state(environment=(("bed_height", 0.1),), environment_units=("rad",)),
            travel=travel,
        )


def test_an_unknown_axis_is_named(tables):
    travel = TravelWeights(environment=(("bed_heigth", 1.0),))
    with pytest.raises(UnknownNameError, match="Did you mean 'bed_height'"):
        select(tables, state(), travel=travel)
    other = state(environment=(("table_height", 0.1),), environment_units=("m",))
    with pytest.raises(UnknownNameError, match=r"current state: unknown .* 'table_height'"):
        select(tables, other)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"torso": 5.0}, "torso is 5 m, out of range: the scores cover 0 to 0.15 m"),
        ({"torso": -0.08}, "torso is -0.08 m"),
        ({"bed_height": 5.0}, "bed_height is 5 m, out of range: the scores cover 0 to 0.1 m"),
        ({"bed_height": 0.151}, "at most half a step beyond"),
        ({"bed_height": -0.051}, "bed_height is -0.051 m"),
    ],
    ids=str,
)
@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_a_torso_or_bed_out_of_range_is_refused(tables, weight, changes, message):
    robot = {name: value for name, value in changes.items() if name == "torso"}
    bed = (("bed_height", changes.get("bed_height", 0.0)),)
    travel = TravelWeights(torso=weight, environment=(("bed_height", weight),))
    with pytest.raises(SelectionError, match=message) as caught:
        select(tables, state(**robot, environment=bed, environment_units=("m",)), travel=travel)
    assert "\n" not in str(caught.value)


def test_an_angle_out_of_range_is_reported_in_degrees():
    grid = small_grid(bed=2, head=2)
    tables = SelectionTables(build_sets(random_scores(grid, 3, seed=0), grid), grid)
    axes = {"environment": (("head_rest", math.radians(80)),), "environment_units": ("rad",)}
    with pytest.raises(SelectionError, match=r"head_rest is 80 deg, .* cover 0 to 35 deg"):
        select(tables, state(**axes))


def test_states_within_half_a_step_and_any_position_on_the_floor_are_allowed(tables):
    select(tables, state(base_x=-40.0, base_y=39.0, torso=0.225))
    for bed in (-0.05, 0.15):
        select(tables, state(environment=(("bed_height", bed),), environment_units=("m",)))


def test_a_lowered_torso_and_a_single_value_are_allowed():
    axes = ("base_x", "base_y", "base_yaw", "torso")
    spec = {axis: {"unit": "m", "start": 0.0, "step": 0.2, "count": 3} for axis in axes}
    spec["base_yaw"] |= {"unit": "deg", "step": 120.0}
    spec["bed_height"] = {"unit": "m", "start": 0.0, "step": 0.1, "count": 1}
    # The torso has never been scored as low as 0.
    spec["torso"] |= {"start": 0.2, "step": 0.1}
    grid = Grid.from_spec(spec)
    tables = SelectionTables(build_sets(random_scores(grid, 3, seed=0), grid), grid)
    # Only one bed height was scored, so its range is unknown.
    bed = {"environment": (("bed_height", 0.3),), "environment_units": ("m",)}
    select(tables, state(torso=0.0, **bed))
    with pytest.raises(SelectionError, match=r"cover 0\.2 to 0\.4 m"):
        select(tables, state(torso=-0.01, **bed))
