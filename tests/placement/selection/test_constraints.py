import itertools
import math

import pytest

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import (
    Constraints,
    SelectionTables,
    TravelWeights,
    UtilityWeights,
    select,
)
from tests.placement.selection.test_choice import brute_force
from tests.placement.tables.small import all_sets, random_scores, small_grid

GRID = small_grid(nx=4, ny=3, torsos=1, bed=2, head=2)
HERE = InitialConfiguration(
    base_x=-2.0,
    base_y=0.5,
    base_yaw=0.0,
    torso=0.0,
    environment=(("bed_height", 0.1), ("head_rest", 0.0)),
    environment_units=("m", "rad"),
)
WEIGHTS = UtilityWeights(travel=0.05)


@pytest.fixture(scope="module", params=[2, 3], ids=["pairs", "triples"])
def scored(request):
    scores = random_scores(GRID, 6, seed=4, share=0.2)
    sets = build_sets(scores, GRID, max_members=request.param)
    return SelectionTables(sets, GRID), all_sets(scores, GRID, 0.4, max_members=request.param)


def by_hand(constraints, configuration):
    """Whether one configuration satisfies constraints, in plain comparisons of its values."""
    now = {"base_x": HERE.base_x, "torso": HERE.torso, **dict(HERE.environment)}
    at = {"base_x": configuration.base_x, "base_y": configuration.base_y}
    at |= {"base_yaw": configuration.base_yaw, **dict(configuration.environment)}
    satisfied = [abs(at[name] - now[name]) < 1e-9 for name in constraints.keep]
    for text in constraints.only:
        name, comparison, value, *unit = text.split()
        factor = math.pi / 180 if unit == ["deg"] else 1.0
        difference = at[name] - float(value) * factor
        satisfied.append(
            {"<=": difference < 1e-9, ">=": difference > -1e-9, "=": abs(difference) < 1e-9}[
                comparison
            ]
        )
    return all(satisfied)


@pytest.mark.parametrize(
    "constraints",
    [
        Constraints(only=("head_rest >= 35 deg",)),
        Constraints(only=("base_x <= -0.1", "base_yaw = 180 deg")),
        Constraints(keep=("bed_height",)),
        Constraints(keep=("bed_height", "head_rest"), only=("base_y >= 0.3",)),
    ],
    ids=lambda constraints: " and ".join(constraints.only + constraints.keep),
)
def test_equals_filtering_all_kept_sets(scored, constraints):
    tables, kept = scored
    admitted = {
        members: both
        for members, both in kept.items()
        if all(by_hand(constraints, GRID.configuration(h)) for h in members)
    }
    sizes = set()
    for (x, y), travel, most in itertools.product(
        [(-2.0, 0.5), (0.3, 0.0)],
        [TravelWeights(), TravelWeights(turn=0.2, environment=(("bed_height", 1.0),))],
        range(1, tables.sets.max_members + 1),
    ):
        here = InitialConfiguration(
            base_x=x,
            base_y=y,
            base_yaw=0.0,
            torso=0.0,
            environment=HERE.environment,
            environment_units=HERE.environment_units,
        )
        choice = select(
            tables,
            here,
            weights=WEIGHTS,
            travel=travel,
            constraints=constraints,
            max_members=most,
        )
        few = {members: both for members, both in admitted.items() if len(members) <= most}
        members, value, cost = brute_force(few, GRID, here, WEIGHTS, travel)
        assert (choice.indices, choice.utility, choice.cost) == (members, value, cost)
        sizes.add(len(members))
    singles = [members for members in admitted if len(members) == 1]
    assert choice.constraints[-1][1] == len(singles)
    assert len(sizes) > 1


def test_without_constraints_nothing_changes(scored):
    tables, _ = scored
    choice = select(tables, HERE, constraints=Constraints())
    assert choice.indices == select(tables, HERE).indices
    assert (choice.constraints, choice.warnings) == ((), ())


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        (
            Constraints(only=("bed_height = 0",), keep=("bed_height",)),
            "'keep bed_height' excludes all of the [0-9]+ that 'only bed_height = 0' leaves",
        ),
        (Constraints(keep=("base_x",)), "more than half a step from the scored ones"),
    ],
)
def test_constraints_that_leave_nothing(scored, constraints, message):
    with pytest.raises(SelectionError, match=message):
        select(scored[0], HERE, constraints=constraints)


def test_keep_requires_the_present_value(scored):
    here = InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    with pytest.raises(SelectionError, match="Give it: --at head_rest_deg=VALUE"):
        select(scored[0], here, constraints=Constraints(keep=("head_rest",)))


def test_a_present_value_between_scored_ones_is_reported(scored):
    here = InitialConfiguration(
        base_x=-2.0,
        base_y=0.5,
        base_yaw=0.0,
        torso=0.0,
        environment=(("bed_height", 0.07),),
        environment_units=("m",),
    )
    choice = select(scored[0], here, constraints=Constraints(keep=("bed_height",)))
    assert {dict(member.environment)["bed_height"] for member in choice.members} == {0.1}
    assert choice.warnings == (
        "keep bed_height: the present value 0.07 m is not scored; the scores are those of 0.1 m.",
    )


def test_a_condition_without_effect_is_reported(scored):
    choice = select(scored[0], HERE, constraints=Constraints(only=("bed_height <= 5",)))
    assert choice.warnings == (
        "only bed_height <= 5 excludes nothing: the grid has bed_height 0, 0.1 m.",
    )


def test_constraints_are_tuples_of_texts():
    assert Constraints(keep=["bed_height"]).keep == ("bed_height",)
    with pytest.raises(SelectionError, match="must be a tuple"):
        Constraints(only="bed_height = 0")
    assert not Constraints()
    assert Constraints(keep=("torso",))
