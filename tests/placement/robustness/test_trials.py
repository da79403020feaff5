"""Trials: equal to the scores without error, and confirmed by Drake in perturbed environments."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from tcs.errors import (
    GridError,
    SelectionError,
    StoreMismatchError,
    TcsError,
    UnknownNameError,
)
from tcs.kernel.arrays import GridArrays
from tcs.model.robots import load_robot
from tcs.model.scene import (
    EMPTY_ENVIRONMENT,
    ErrorDistribution,
    Scene,
    SceneSpec,
    environment_at,
    goal_poses,
)
from tcs.model.scene.contacts import Group
from tcs.placement.robustness import PerturbedPoints, Trials, perturbed_scenes
from tcs.placement.robustness import trials as trials_module
from tcs.placement.robustness.body_collisions import (
    BODY_COLLISIONS,
    base_bodies,
    counted_pairs,
    counted_rests,
)
from tcs.placement.scoring.drake_check import CLEARANCE_ROUNDING, POSITION_BAR, ROTATION_BAR
from tcs.placement.tables import Reason
from tests.kernel.judge import is_true


def no_error(trials, samples):
    return {name: np.zeros(samples) for name in trials.errors.errors}


def some(rng, trials, count):
    """Some of the configurations that reach a goal."""
    return np.sort(rng.choice(trials.scored.sets.candidates, count, replace=False))


def test_without_error_every_candidate_reaches_its_scored_goals(trials):
    for table in range(len(trials.file.tables)):
        here = trials.at_table(table)
        sets = here.scored.sets
        assert len(sets.candidates) > 30
        found = here.reached(sets.candidates, no_error(here, 2))
        assert np.array_equal(found[:, 0], sets.reached)
        assert np.array_equal(found[:, 1], sets.reached)


def test_without_error_the_joints_are_the_stored_ones(bed_trials, rng):
    scores = bed_trials.scored.scores
    for h in some(rng, bed_trials, 10):
        reached, joints = bed_trials.solutions(int(h), no_error(bed_trials, 1))
        for g in np.flatnonzero(reached[0]):
            assert np.array_equal(joints[0, g], scores.joints_of(int(h), int(g)))


def test_only_the_paper_ignores_contacts_of_the_base_with_furniture(chair_file, chair_trials):
    # Configurations whose body touches something: all goals blocked, offline.
    scores = chair_trials.scored.scores
    blocked = np.flatnonzero(np.all(scores.reason == Reason.BODY_BLOCKED, axis=1))
    nothing = no_error(chair_trials, 1)
    checked = chair_trials
    ignored = Trials.of(chair_file, body_collisions="none").reached(blocked, nothing)
    assert not checked.reached(blocked, nothing).any()
    here = Trials.of(chair_file, body_collisions="paper").reached(blocked, nothing)
    assert here.any()
    assert np.all(ignored[here])
    # Drake's contacts of the configurations that reach a goal: those of the base with the chair.
    scene, base = chair_trials.scene, base_bodies(chair_trials.scene)
    body = {part.name for part in scene.built.parts if part.group is Group.BODY}
    before, contacts = scene.positions(), set()
    for h in blocked[here.any(axis=(1, 2))]:
        at = chair_trials.job.grid.configuration(int(h))
        scene.place_base(at.base_x, at.base_y, at.base_yaw)
        scene.set_torso(at.torso)
        touching = [c for c in scene.clearances(0.0) if c[0] in body and c[2] < 0.0]
        contacts |= {(first in base, second.split("::")[0]) for first, second, _ in touching}
    scene.restore(before)
    assert contacts == {(True, "wheelchair")}
    everything = np.arange(chair_trials.job.grid.size)
    assert np.array_equal(checked.reached(everything, nothing)[:, 0], scores.reached)


def test_checking_the_base_never_adds_a_goal(chair_file, chair_trials, rng):
    # The chair moves sideways into the robot, so a free base may become blocked.
    members, offsets = some(rng, chair_trials, 30), {"wheelchair_y": np.linspace(-0.4, 0.4, 20)}
    free = Trials.of(chair_file, body_collisions="paper").reached(members, offsets)
    checked = chair_trials.reached(members, offsets)
    assert not np.any(checked & ~free)
    assert np.count_nonzero(checked) < np.count_nonzero(free)


def test_results_do_not_depend_on_threads_or_batches(trials, rng, monkeypatch):
    members, offsets = some(rng, trials, 20), trials.errors.draw(15, 0)
    found = trials.reached(members, offsets, jobs=1)
    assert np.array_equal(trials.reached(members, offsets, jobs=3), found)
    monkeypatch.setattr(trials_module, "CHUNK", 7)
    monkeypatch.setattr(trials_module, "BATCH", 3)
    monkeypatch.setattr(perturbed_scenes, "BATCH", 3)
    assert np.array_equal(trials.reached(members, offsets), found)
    assert np.array_equal(trials.reached(members[::-1], offsets)[::-1], found)


def test_the_first_solution_gives_the_reasons_that_the_best_gives(trials, rng):
    members, offsets = some(rng, trials, 12), trials.errors.draw(20, 0)
    at = trials.grid.values(members)
    points = np.stack([*at.values()], axis=1)
    found = PerturbedPoints(trials, offsets, 1).reasons(points)
    best = np.array([trials.outcome(int(member), offsets).scores.reason for member in members])
    assert np.array_equal(found, best)
    assert np.unique(best).size > 2
    reached = trials.reached(members, offsets, jobs=1)
    assert np.array_equal(reached, best == Reason.REACHED)


def test_configurations_on_their_own_samples_are_the_diagonal(trials, rng):
    members, offsets = some(rng, trials, 30), trials.errors.draw(30, 0)
    every = trials.reached(members, offsets)
    each = trials.reached_each(members, offsets)
    assert np.array_equal(each, every[np.arange(30), np.arange(30)])
    with pytest.raises(TcsError, match="29 configurations for 30 samples"):
        trials.reached_each(members[1:], offsets)


def test_progress_ends_with_everything_done(bed_trials, rng):
    steps = []
    members, offsets = some(rng, bed_trials, 5), bed_trials.errors.draw(4, 0)
    bed_trials.reached(members, offsets, on_progress=lambda *step: steps.append(step))
    assert steps[-1] == (20, 20)
    assert [done for done, _ in steps] == sorted({done for done, _ in steps})


def test_an_interrupt_is_passed_on(bed_trials, rng):
    def stop(_done, _total):
        raise KeyboardInterrupt

    before = bed_trials.scene.positions()
    with pytest.raises(KeyboardInterrupt):
        bed_trials.reached(some(rng, bed_trials, 5), bed_trials.errors.draw(9, 0), on_progress=stop)
    assert np.array_equal(bed_trials.scene.positions(), before)


def put(trials, member, offsets, sample):
    """Set robot, bed and every joint with an error in the live scene as in one sample."""
    scene, place = trials.scene, trials.job.grid.configuration(int(member))
    scene.place_base(place.base_x, place.base_y, place.base_yaw)
    scene.set_torso(place.torso)
    nominal = {**trials.file.observed_states[trials.table], **dict(place.environment)}
    for name, value in {**dict.fromkeys(offsets, 0.0), **nominal}.items():
        error = offsets[name][sample] if name in offsets else 0.0
        scene.set_joint(name, value + error)


def test_drake_confirms_solutions_in_perturbed_environments(trials, rng):
    """Random samples and members: the tool is at the displaced goal, without collisions."""
    scene = trials.scene
    offsets = trials.errors.draw(3, 11)
    before, judged = scene.positions(), 0
    for member in some(rng, trials, 4):
        reached, joints = trials.solutions(int(member), offsets)
        for sample, g in np.argwhere(reached):
            put(trials, member, offsets, sample)
            scene.set_arm(joints[sample, g])
            X_TG = scene.tool_pose().inverse() @ goal_poses(scene, trials.job.task)[g]
            assert np.linalg.norm(X_TG.translation()) < POSITION_BAR
            assert X_TG.rotation().ToAngleAxis().angle() < ROTATION_BAR
            for first, second, distance in scene.violations():
                slack = scene.required_clearance(first, second) - CLEARANCE_ROUNDING
                of_base = is_of_base(scene, first) and is_of_environment(scene, second)
                # Contacts of the base are deliberately not checked.
                assert of_base or distance >= slack, (first, second, distance)
            judged += 1
    scene.restore(before)
    assert judged > 20


def is_of_base(scene, name):
    return any(part.name == name and part.group is Group.BODY for part in scene.built.parts)


def is_of_environment(scene, name):
    return any(part.name == name and part.group is Group.ENVIRONMENT for part in scene.built.parts)


@pytest.mark.slow
def test_the_reference_confirms_solutions_in_perturbed_environments(trials, rng):
    """The plain-loop reference, on one perturbed environment, without contacts of the base."""
    offsets = trials.errors.draw(2, 5)
    judged = 0
    for member in some(rng, trials, 3):
        reached, joints = trials.solutions(int(member), offsets)
        place = trials.job.grid.configuration(int(member))
        level = int(member) % trials.job.grid.axis("torso").count
        believed = {**trials.file.observed_states[trials.table], **dict(place.environment)}
        for sample in range(2):
            state = {
                name: believed.get(name, 0.0) + (offsets[name][sample] if name in offsets else 0.0)
                for name in {**offsets, **believed}
            }
            arrays = environment_at(trials.hands[0].lowered, trials.scene, trials.job.task, [state])
            only = slice(level, level + 1)
            arrays = arrays._replace(
                arm_base_R=arrays.arm_base_R[only],
                arm_base_p=arrays.arm_base_p[only],
                body=arrays.body._replace(R=arrays.body.R[only], p=arrays.body.p[only]),
                body_vs_environment=np.zeros_like(arrays.body_vs_environment),
            )
            at = (np.array([v]) for v in (place.base_x, place.base_y, place.base_yaw))
            grid = GridArrays(1, *at, 1)
            for g in np.flatnonzero(reached[sample]):
                assert is_true(arrays, grid, 0, g, joints[sample, g])
                judged += 1
    assert judged > 2


def test_a_joint_stays_at_its_limit(bed_file):
    errors = {"head_rest": ErrorDistribution(distribution="uniform", half_width_deg=20.0)}
    trials = Trials.of(bed_file, errors=errors)
    sets = trials.scored.sets
    flat, high = (sets.candidates[sets.state % 2 == side][:1] for side in (0, 1))
    up = {"head_rest": np.radians([-20.0, 5.0, 20.0])}
    # The bed's head rest goes to 80 deg: 70 + 20 is beyond it, 35 + 20 is not.
    assert trials.clipped(flat[None].astype(int), up) == 0
    assert trials.clipped(high[None].astype(int), up) == 1
    at_limit = {"head_rest": np.radians([10.0, 20.0, 500.0])}
    found = trials.reached(high, at_limit)[0]
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


def test_a_joint_at_its_limit_counts_regardless_of_others(bed_trials):
    member = bed_trials.scored.sets.candidates[None, :1].astype(int)
    beyond, within = np.radians([200.0, 0.0, -200.0]), np.array([0.01, 0.01, 0.01])
    for offsets in (
        {"head_rest": beyond, "person_x": within},
        {"person_x": within, "head_rest": beyond},
    ):
        assert bed_trials.clipped(member, offsets) == 2


def test_a_joint_beyond_its_limit_by_rounding_is_not_moved(bed_trials):
    """The last value of a grid may be; moving it back would add an error that was not drawn."""
    believed = bed_trials.positions(0, {"person_x": np.zeros(1)})[0]["head_rest"][0]
    limits = (believed + 1e-12, believed + 1.0)
    joints = SimpleNamespace(limits=lambda name: limits, default=lambda name: 0.0)
    scene = SimpleNamespace(built=SimpleNamespace(environment_joints=joints))
    (arm,) = bed_trials.hands
    found = dataclasses.replace(bed_trials, hands=(dataclasses.replace(arm, scene=scene),))
    positions, stopped = found.positions(0, {"head_rest": np.array([0.0, 0.5, -0.5, 2.0])})
    assert positions["head_rest"].tolist() == [believed, believed + 0.5, believed, limits[1]]
    assert stopped.tolist() == [False, False, True, True]


def test_missing_configurations_tables_and_samples_are_refused(bed_file, bed_trials):
    offsets = no_error(bed_trials, 1)
    with pytest.raises(GridError, match="no configuration 10000000"):
        bed_trials.reached([10_000_000], offsets)
    with pytest.raises(SelectionError, match="no table 7; the file has 2"):
        Trials.of(bed_file, table=7)
    with pytest.raises(TcsError, match="the same number of samples for each"):
        bed_trials.reached([0], {"person_x": np.zeros(2), "person_y": np.zeros(3)})


def test_a_file_of_other_models_is_refused(bed_file):
    other = dataclasses.replace(bed_file, metadata={**bed_file.metadata, "scene_digest": "5f" * 32})
    with pytest.raises(StoreMismatchError, match="from other models"):
        Trials.of(other)


def test_body_collisions_decide_by_base_and_person(chair_file, chair_trials):
    lowered = chair_trials.hands[0].lowered
    arrays = lowered.arrays
    checked = {
        choice: counted_pairs(chair_trials.scene, lowered, choice) for choice in BODY_COLLISIONS
    }
    assert np.array_equal(checked["all"], arrays.body_vs_environment)
    assert not checked["none"].any()
    rests = {choice: counted_rests(lowered, choice).arrays.rest for choice in BODY_COLLISIONS}
    assert len(rests["all"]) == len(rests["paper"]) == len(arrays.rest) > 0
    assert not len(rests["none"])
    names = np.array(lowered.robot_bodies)[arrays.body.body]
    models = np.array([name.split("::")[0] for name in lowered.environment_bodies])
    of_base = names == "base_link"
    of_chair = (models == "wheelchair")[arrays.environment.body]
    of_person = (models == "person")[arrays.environment.body]
    assert checked["all"][np.ix_(of_base, of_chair)].all()
    assert not checked["paper"][np.ix_(of_base, of_chair)].any()
    assert checked["paper"][np.ix_(of_base, of_person)].all()
    torso = names == "torso_lift_link"
    assert torso.any()
    assert checked["paper"][np.ix_(torso, of_chair | of_person)].all()
    with pytest.raises(UnknownNameError, match="paper"):
        Trials.of(chair_file, body_collisions="papers")


@pytest.mark.parametrize(
    ("robot", "inside", "outside"),
    [
        ("pr2", {"base_link", "fl_caster_rotation_link", "fl_caster_l_wheel_link"}, "torso"),
        ("tiago", {"base_link", "wheel_left_link"}, "torso_lift_link"),
        ("baxter", {"base", "torso", "pedestal"}, "head"),
    ],
)
def test_base_bodies_end_at_the_first_joint_with_limits(robot, inside, outside):
    found = base_bodies(Scene(SceneSpec(load_robot(robot), EMPTY_ENVIRONMENT)))
    assert inside <= found, sorted(found)
    assert not any(name.startswith(outside) and name not in inside for name in found)
