from __future__ import annotations

import dataclasses

import pytest

from tcs.output.view import Controls, ViewedSet
from tcs.output.view.controls import BACK, NEXT_COLOUR, NEXT_GOAL, NEXT_MEMBER
from tests.output.view.conftest import made
from tests.placement.tables.small import small_grid


def test_first_is_the_first_member_at_a_goal_it_reaches(bed):
    controls = Controls(bed)
    state = controls.first()
    assert controls.index(state) == bed.members[0]
    assert bed.scores.reached[bed.members[0], state.goal]
    assert controls.heading(state) == "member 1 of 2"


def test_every_variable_axis_has_a_slider(bed):
    names = [slider.name for slider in Controls(bed).sliders]
    assert names == [
        "set member", "goal", "floor colour", "bed height [m]", "head rest [deg]",
        "base x [m]", "base y [m]", "heading [deg]",
        "torso [m]",
    ]  # fmt: skip


def test_a_single_value_has_no_slider():
    alone = made(small_grid(2, 2, 1, 1), 1, (1,))
    names = [slider.name for slider in Controls(alone).sliders]
    assert names == ["floor colour", "base x [m]", "base y [m]"]


def test_every_slider_goes_through_all_its_values(bed):
    controls = Controls(bed)
    for slider in controls.sliders:
        for k in range(round((slider.high - slider.low) / slider.step) + 1):
            value = slider.low + k * slider.step
            after = controls.moved(controls.first(), slider.name, value)
            assert controls.values(after)[slider.name] == pytest.approx(value, abs=1e-12)


def test_another_base_pose_moves_that_axis_alone(bed):
    controls = Controls(bed)
    before = controls.first()
    after = controls.moved(before, "base x [m]", -0.3 + 0.04)
    here, there = (bed.grid.configuration(controls.index(s)) for s in (before, after))
    assert there.base_x == pytest.approx(-0.3)
    assert dataclasses.replace(there, base_x=here.base_x) == here
    assert controls.heading(after) == "other configuration"
    assert controls.clicked(after, BACK) == before


def test_a_value_beyond_the_range_is_its_end(bed):
    controls = Controls(bed)
    after = controls.moved(controls.first(), "bed height [m]", 9.0)
    assert controls.values(after)["bed height [m]"] == pytest.approx(0.2)


def test_bed_and_head_rest_number_the_environment_as_the_grid_does(bed):
    controls = Controls(bed)
    per_state = bed.grid.size // 6
    for height in (0.0, 0.1, 0.2):
        for head in (0.0, 35.0):
            state = controls.moved(controls.first(), "bed height [m]", height)
            state = controls.moved(state, "head rest [deg]", head)
            assert controls.environment_state(state) == controls.index(state) // per_state


def test_members_are_stepped_through_in_a_ring(bed):
    controls = Controls(bed)
    first = controls.first()
    second = controls.clicked(first, NEXT_MEMBER)
    assert controls.index(second) == bed.members[1]
    assert controls.moved(first, "set member", 2.0) == second
    assert controls.index(controls.clicked(second, NEXT_MEMBER)) == bed.members[0]


def test_a_member_shows_a_goal_it_reaches(bed):
    controls = Controls(bed)
    for goal in range(bed.goals):
        state = controls.moved(controls.first(), "goal", goal)
        state = controls.moved(state, "set member", 2.0)
        assert bed.scores.reached[bed.members[1], state.goal]


def test_goals_and_colours_are_stepped_through_in_rings(estimated):
    controls = Controls(estimated)
    state, goals, colourings = controls.first(), [], []
    for _ in range(estimated.goals):
        goals.append(state.goal)
        state = controls.clicked(state, NEXT_GOAL)
    for _ in range(4):
        colourings.append(state.colouring)
        state = controls.clicked(state, NEXT_COLOUR)
    assert sorted(goals) == list(range(estimated.goals))
    assert colourings == ["reachability", "manipulability", "reason", "success"]
    assert state == controls.first()


def test_without_a_set_the_free_base_positions_are_shown(bed):
    nothing = ViewedSet(bed.grid, bed.scores, (), None)
    controls = Controls(nothing)
    state = controls.first()
    assert "set member" not in controls.values(state)
    assert controls.clicked(state, NEXT_MEMBER) == state == controls.clicked(state, BACK)
    assert controls.heading(state) == "other configuration"
