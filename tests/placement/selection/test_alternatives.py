import dataclasses
import itertools
import math

import numpy as np
import pytest

from tcs.errors import GridError, SelectionError, UnknownNameError
from tcs.model.grid import InitialConfiguration
from tcs.placement.constraints import Constraints
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import SelectionTables, Top, TravelWeights, UtilityWeights, select
from tcs.placement.tables import RefinedTable
from tests.placement.selection.test_choice import brute_force, keeps
from tests.placement.store.example import score_file
from tests.placement.tables.small import all_sets, random_scores, small_grid

GRID = small_grid(nx=5, ny=3, torsos=1, bed=2)
HERE = InitialConfiguration(
    base_x=-1.0,
    base_y=0.2,
    base_yaw=0.0,
    torso=0.0,
    environment=(("bed_height", 0.1),),
    environment_units=("m",),
)


def differ(first, second, min_apart):
    """Whether two sets differ: by environment states, or by a member far from the other set."""
    one, other = ([GRID.configuration(h) for h in members] for members in (first, second))
    if {c.environment for c in one} != {c.environment for c in other}:
        return True

    def has_far(some, others):
        return any(
            all(
                math.dist((c.base_x, c.base_y), (d.base_x, d.base_y)) >= min_apart - 1e-9
                for d in others
            )
            for c in some
        )

    return has_far(one, other) or has_far(other, one)


@pytest.fixture(scope="module", params=[2, 3], ids=["pairs", "triples"])
def scored(request):
    scores = random_scores(GRID, 5, seed=2, share=0.3)
    sets = build_sets(scores, GRID, max_members=request.param)
    return SelectionTables(sets, GRID), all_sets(scores, GRID, 0.4, max_members=request.param)


@pytest.mark.parametrize("min_apart", [0.0, 0.4, 0.7, 5.0])
def test_alternatives_equal_the_best_of_the_distinct_sets(scored, min_apart):
    tables, kept = scored
    weights = UtilityWeights(travel=0.1)
    choice = select(tables, HERE, weights=weights, top=Top(count=6, min_apart=min_apart))
    found = [choice, *choice.alternatives]
    offered = []
    while len(offered) < 6:
        left = {
            members: both
            for members, both in kept.items()
            if all(differ(members, other, min_apart) for other in offered)
        }
        if not left:
            break
        members, value, cost = brute_force(left, GRID, HERE, weights, TravelWeights())
        offered.append(members)
        of_set = found[len(offered) - 1]
        assert (of_set.indices, of_set.utility, of_set.cost) == (members, value, cost)
    assert len(found) == len(offered)
    # Far apart, only sets with other environment states differ.
    assert len(found) == {0.0: 6, 0.4: 6}.get(min_apart, len(found)) > 1
    nets = [one.net_utility for one in found]
    assert nets == sorted(nets, reverse=True)


def test_an_alternative_states_what_it_trades(scored):
    choice = select(scored[0], HERE, top=Top(count=3, min_apart=0.4))
    plain = choice.to_json("isotropy")
    first = choice.alternatives[0]
    trades = plain["alternatives"][0]["trades"]
    assert trades["cost"] == pytest.approx(first.cost - choice.cost, abs=1e-9)
    assert trades["net_utility"] <= 0.0
    assert trades["places"] == len(first.members) - len(choice.members)
    assert plain["alternatives"][0]["moves"] == list(first.moves)


@pytest.mark.parametrize("places", [0.0, 0.01, 0.2])
def test_a_single_is_preferred_if_it_loses_at_most_that_fraction(scored, places):
    tables, kept = scored
    weights = UtilityWeights(travel=0.0, places=places, environment=0.0)
    choice = select(tables, HERE, weights=weights, max_members=2)
    best = {
        size: max(sum(both) for members, both in kept.items() if len(members) == size)
        for size in (1, 2)
    }
    loses = 1.0 - best[1] / best[2]
    assert len(choice.members) == (1 if loses <= places else 2)
    assert choice.net_utility <= choice.utility


def test_a_set_that_keeps_the_environment_is_preferred_at_equal_scores():
    grid = small_grid(nx=3, ny=1, torsos=1, bed=2)
    # Few dexterities, so that many configurations tie.
    tables = SelectionTables(build_sets(random_scores(grid, 2, 3, levels=1, share=0.9), grid), grid)
    free = {"travel": 0.0, "places": 0.0}
    paper = select(tables, HERE, weights=UtilityWeights(**free, environment=0.0))
    kept = select(tables, HERE, weights=UtilityWeights(**free))
    assert kept.utility == paper.utility
    assert paper.moves == ("bed_height",)
    assert kept.moves == ()
    assert all(keeps(member, HERE, grid) for member in kept.members)


def test_without_a_known_environment_moving_it_is_free(scored):
    here = InitialConfiguration(base_x=-1.0, base_y=0.2, base_yaw=0.0, torso=0.0)
    costly = UtilityWeights(environment=10.0)
    assert select(scored[0], here, weights=costly).indices == select(scored[0], here).indices


SIDES = {"upper_arm_left": (0.0, 0.5), "hand_right": (0.0, 0.1), "head": (-0.7, 0.3)} | {
    "foot_left": (0.2, 0.5),
    "foot_right": (0.2, 0.1),
}
"""Body frames of a person who lies with the head at negative x."""


@pytest.fixture(scope="module")
def person():
    """A file with a person as in `SIDES` in its first environment state, mirrored in the second."""
    frames = {name: [x, y, 0.5, x, 0.6 - y, 0.5] for name, (x, y) in SIDES.items()}
    return score_file(grid=GRID, body_frames=frames)


@pytest.mark.parametrize("side", ["left", "right", "head", "foot"])
def test_a_side_of_the_person(person, side):
    def is_on_side(member):
        mirrored = dict(member.environment)["bed_height"] > 0.0
        if side in ("head", "foot"):
            return member.base_x < -0.25 if side == "head" else member.base_x > -0.25
        above = member.base_y > 0.3 + 1e-9, member.base_y < 0.3 - 1e-9
        return above[(side == "right") != mirrored]

    weights = UtilityWeights(preference=100.0)
    constraints = Constraints(prefer=(side,))
    choice = select(person, HERE, weights=weights, constraints=constraints, top=Top(count=5))
    for one in (choice, *choice.alternatives):
        violated = one.net_utility < -50.0
        assert all(is_on_side(member) for member in one.members) is not violated
    # A preference excludes nothing, and without weight it has no effect.
    free = select(person, HERE, weights=UtilityWeights(preference=0.0), constraints=constraints)
    assert free.indices == select(person, HERE).indices


def test_preferences_that_cannot_be_used(scored, person):
    with pytest.raises(SelectionError, match="must be a side of the person, left, right, head"):
        Constraints(prefer=("window",))
    with pytest.raises(GridError, match="is not of the form"):
        Constraints(prefer=("torso <= low",))
    with pytest.raises(SelectionError, match="no body frames on this side"):
        select(scored[0], HERE, constraints=Constraints(prefer=("left",)))
    with pytest.raises(UnknownNameError, match="unknown axis 'headrest'"):
        select(person, HERE, constraints=Constraints(prefer=("headrest = 0 deg",)))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"count": 0}, "top is 0; must be 1 to 100"),
        ({"count": 2.5}, "must be a whole number"),
        ({"min_apart": -1.0}, "min_apart is -1.0; must be 0 to 40 m"),
        ({"min_apart": float("nan")}, "min_apart is nan"),
    ],
)
def test_numbers_out_of_range(values, message):
    with pytest.raises(SelectionError, match=message):
        Top(**values)


def test_penalties_out_of_range():
    with pytest.raises(SelectionError, match=r"must be at most 0\.5"):
        UtilityWeights(places=0.6)


def test_alternatives_to_a_refined_set_are_apart_from_it(scored):
    tables, _ = scored
    best = select(tables, HERE)
    shift = 0.02
    origin = np.array([best.indices], dtype=np.int32)
    named = [axis.name for axis in GRID.axes]
    values = np.zeros((1, len(best.members), len(named)))
    for i, member in enumerate(best.members):
        at = {**dataclasses.asdict(member), **dict(member.environment)}
        values[0, i] = [at[name] + shift * (name == "base_x") for name in named]
    rows = np.searchsorted(tables.sets.candidates, best.indices)
    reached = tables.sets.reached[rows][None]
    refined = RefinedTable(
        origin=origin,
        values=values,
        reached=reached,
        dexterity=np.where(reached, np.float32(1.0), np.float32(0.0)),
        arm_joints=np.zeros((*reached.shape, 7), dtype=np.float32),
        objective=np.ones(1),
        weights=tables.sets.weights,
    )
    tables = dataclasses.replace(tables, refined=refined)
    found = select(tables, HERE, top=Top(count=4, min_apart=0.5))
    assert found.refined == 0
    offered = [found, *found.alternatives]
    assert len(offered) == 4
    for one, other in itertools.combinations(offered, 2):
        bases, others = ([(m.base_x, m.base_y) for m in c.members] for c in (one, other))
        states = [{m.environment for m in c.members} for c in (one, other)]
        far = any(all(math.dist(a, b) >= 0.5 - 1e-9 for b in others) for a in bases)
        far |= any(all(math.dist(a, b) >= 0.5 - 1e-9 for a in bases) for b in others)
        assert far or states[0] != states[1]
