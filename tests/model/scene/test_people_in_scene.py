"""People in a scene without a plant of their own: the arrays that the resized scene lowers to."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from tcs.errors import EnvironmentFileError
from tcs.model.people import draw_bodies, scales_of_people
from tcs.model.scene import PeopleInScene, environment_at
from tcs.placement.scoring import load_job

WITHIN = 1e-6
"""Link orientations in the model files are rounded to seven digits [m]."""
PEOPLE = draw_bodies(2, seed=3)
# Joints keep the positions that a state does not name.
STATES = {
    "wheelchair": (
        {"person_x": 0.02, "person_yaw": 0.0, "wheelchair_yaw": 0.0, "head_turn": 0.0},
        {"person_x": 0.01, "person_yaw": 0.2, "wheelchair_yaw": -0.3, "head_turn": 0.5},
    ),
    "bed": (
        {"head_rest": 0.0, "person_x": 0.01, "head_turn": 0.0, "head_neck_1": 0.0},
        {"head_rest": 1.2, "person_x": 0.02, "head_turn": 0.5, "head_neck_1": 0.3},
    ),
}


@pytest.mark.parametrize(
    ("name", "task", "number"),
    [("bed", "bathing", 0), pytest.param("wheelchair", "shaving", 1, marks=pytest.mark.slow)],
)
def test_arrays_equal_those_of_the_resized_scene(name, task, number):
    job = load_job(task, name, "pr2")
    scene = job.scene()
    people = PeopleInScene(job.lowered(scene), scene, job.task, STATES[name])
    states = [[1, 0] if person == number else [0, 0] for person in range(len(PEOPLE))]
    found = people.arrays_of(scales_of_people(PEOPLE), np.array(states))[number]

    body = PEOPLE[number]
    alone = load_job(task, name, "pr2", person={"sex": body.sex, **body.measures})
    resized = alone.scene()
    expected = environment_at(alone.lowered(resized), resized, alone.task, STATES[name][::-1])
    for key in ("type", "size", "pad"):
        of_found, of_expected = (getattr(one.environment, key) for one in (found, expected))
        np.testing.assert_array_equal(of_found, of_expected)
    # The orientation of a turned capsule is multiplied here, by Drake there.
    np.testing.assert_allclose(found.environment.R, expected.environment.R, atol=1e-12)
    np.testing.assert_allclose(found.environment.p, expected.environment.p, atol=WITHIN)
    np.testing.assert_allclose(found.goal_p, expected.goal_p, atol=WITHIN)
    np.testing.assert_allclose(found.goal_R, expected.goal_R, atol=1e-12)
    with pytest.raises(EnvironmentFileError, match="resized already"):
        PeopleInScene(alone.lowered(resized), resized, alone.task, STATES[name])


# Computed with commit fb81e56, before people could have other sizes or postures.
SCENES_OF_THE_PAPERS_MAN = {
    ("shaving", "wheelchair"): ("57aa6c8e5b67daa0", "a05893b8a7dd0854"),
    ("bathing", "bed"): ("f136e45e81c06072", "0aa83bdfe396f00d"),
}


@pytest.mark.parametrize(("task", "name"), SCENES_OF_THE_PAPERS_MAN)
def test_the_scene_of_the_papers_man_is_what_it_was(task, name):
    job = load_job(task, name, "pr2")
    arrays = job.lowered(job.scene()).arrays
    shapes = arrays.environment
    exact = [shapes.type, shapes.size, shapes.pad]
    # The joint of the head changed Drake's products by up to 4e-16 m, and no score of shaving.
    poses = [shapes.R[0], shapes.p[0], arrays.goal_R[0], arrays.goal_p[0]]
    rounded = [np.round(array, 9) + 0.0 for array in poses]
    found = tuple(
        hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in group)).hexdigest()[:16]
        for group in (exact, rounded)
    )
    assert found == SCENES_OF_THE_PAPERS_MAN[task, name]
