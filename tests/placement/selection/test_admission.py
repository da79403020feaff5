import dataclasses
import itertools
import math

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.constraints import Constraints, Obstacle, Region
from tcs.placement.constraints.blocking import blocked_bodies, blocked_solutions
from tcs.placement.constraints.regions import Footprint
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import SelectionTables, TravelWeights, UtilityWeights, select
from tcs.placement.store.robot_shapes import Primitives, RobotShapes
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
    assert choice.constraints[-1].configurations == len(singles)
    assert len(sizes) > 1


def made_up_robot():
    """A box of a base with a torso and an arm of two spheres, which swing about the shoulder."""
    chain_p = np.zeros((8, 3))
    chain_p[1] = (0.3, 0.0, 0.0)
    arm = Primitives(
        type=np.zeros(2, dtype=np.int64),
        size=np.array([[0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]),
        pad=np.zeros(2),
        frame=np.array([1, 7]),
        R=np.tile(np.eye(3), (2, 1, 1)),
        p=np.array([[0.15, 0.0, 0.0], [0.2, 0.0, 0.0]]),
    )
    body = Primitives(
        type=np.array([2]),
        size=np.array([[0.1, 0.15, 0.3]]),
        pad=np.zeros(1),
        frame=np.zeros(1, dtype=np.int64),
        R=np.eye(3)[None],
        p=np.array([[0.0, 0.0, 0.3]]),
    )
    return RobotShapes(
        chain_R=np.tile(np.eye(3), (8, 1, 1)),
        chain_p=chain_p,
        arm_base_R=np.eye(3),
        arm_base_p=np.array([0.0, 0.0, 0.7]),
        torso_shift=np.zeros((1, 3)),
        arm=arm,
        body=body,
        margin=0.001,
    )


@pytest.mark.parametrize("most", [2, 3])
def test_obstacles_and_regions_equal_filtering_all_kept_sets(most):
    scores = random_scores(GRID, 6, seed=4, share=0.2)
    sets = build_sets(scores, GRID, max_members=most)
    robot = made_up_robot()
    tables = SelectionTables(sets, GRID, None, lambda _: robot, lambda: scores)
    (postures,) = tables.postures
    region = Region.parse("-1 0.3, -0.5 0.3, -0.5 0.9, -1 0.9")
    obstacle = Obstacle.parse("0.1 0.4 0.2 0.1 20 0.5 0.8")
    constraints = Constraints(forbid=(region,), blocked=(obstacle,))
    base = np.stack([postures.base[:, i] for i in range(3)], axis=1)
    stands = Footprint.of(robot).overlaps(region, base) | blocked_bodies(obstacle, postures)
    hit = blocked_solutions(obstacle, postures, ~stands)
    candidate, goal = postures.pairs
    blocked = {
        (int(sets.candidates[c]), int(g)) for c, g in zip(candidate[hit], goal[hit], strict=True)
    }
    assert stands.any()
    assert blocked
    left = {}
    for members, _ in all_sets(scores, GRID, 0.4, max_members=most).items():
        reached = {
            h: [g for g in range(6) if scores.reached[h, g] and (h, g) not in blocked]
            for h in members
        }
        if any(stands[np.searchsorted(sets.candidates, h)] or not reached[h] for h in members):
            continue
        reachability = manipulability = 0.0
        for g, weight in enumerate(scores.weights.tolist()):
            of_members = [float(scores.dexterity[h, g]) for h in members if g in reached[h]]
            if of_members:
                reachability += weight
                manipulability += weight * max(of_members)
        left[members] = (reachability, manipulability)
    for x, y, gamma in [(-2.0, 0.5, 0.05), (0.3, 0.0, 0.5), (0.0, 0.0, 0.0)]:
        here = InitialConfiguration(base_x=x, base_y=y, base_yaw=0.0, torso=0.0)
        weights = UtilityWeights(travel=gamma)
        choice = select(tables, here, weights=weights, constraints=constraints)
        members, value, cost = brute_force(left, GRID, here, weights, TravelWeights())
        assert (choice.indices, choice.utility, choice.cost) == (members, value, cost)
        assert (choice.reachability, choice.manipulability) == left[members]
    found = choice.constraints[-1]
    assert found.configurations == sum(len(members) == 1 for members in left)
    assert found.solutions is not None


def test_an_obstacle_needs_the_shapes_of_the_robot(scored):
    with pytest.raises(SelectionError, match="does not hold the robot's shapes"):
        select(scored[0], HERE, constraints=Constraints(blocked=(Obstacle.parse("1 1 1 1"),)))


def test_without_shapes_a_region_is_kept_clear_of_a_circle(scored):
    region = Region.parse("-0.5 0, 0.5 0, 0 -1")
    choice = select(scored[0], HERE, constraints=Constraints(forbid=(region,)))
    assert choice.to_json("isotropy")["footprint"] == {"type": "circle", "radius": 0.5}
    assert "counts as a circle of 0.5 m" in choice.warnings[0]


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
        (Constraints(keep=("torso",)), "present value is 0.01 m, but only 0 m is scored"),
    ],
)
def test_constraints_that_leave_nothing(scored, constraints, message):
    with pytest.raises(SelectionError, match=message):
        select(scored[0], dataclasses.replace(HERE, torso=0.01), constraints=constraints)


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
    with pytest.raises(SelectionError, match="must be of type Obstacle"):
        Constraints(blocked=("1 1 1 1",))
    with pytest.raises(SelectionError, match="must be a tuple"):
        Constraints(only="bed_height = 0")
    assert not Constraints(prefer=("left",)).exclude
    assert Constraints(keep=("torso",)).exclude
