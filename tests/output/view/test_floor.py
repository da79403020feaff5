from __future__ import annotations

import dataclasses
import itertools

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex

from tcs.output.view import floor_map
from tcs.output.view.floor import colourings
from tcs.output.words import REASON_COLOURS
from tcs.placement.tables import Reason, SuccessTable

# Worst first: base blocked, then the other checks in their order.
ORDER = [
    Reason.BODY_BLOCKED, Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT, Reason.TOO_FAR,
    Reason.GRIPPER_BLOCKED_BY_ROBOT, Reason.JOINT_LIMITS, Reason.ARM_BLOCKED, Reason.REACHED,
]  # fmt: skip


def configurations_at(viewed, state, x, y):
    """Return the flat indices of all configurations at a base position."""
    found = []
    heights, heads = viewed.grid.environment_shape
    at = np.unravel_index(state, (heights, heads))
    *_, yaws, torsos = viewed.grid.shape
    for yaw, torso in itertools.product(range(yaws), range(torsos)):
        found.append(int(viewed.grid.flat([*at, x, y, yaw, torso])))
    return found


@pytest.mark.parametrize("state", [0, 4])
def test_the_reason_is_that_of_the_most_checks_passed(bed, state):
    floor = floor_map(bed, state, 2, "reason")
    nx, ny = bed.grid.axis("base_x").count, bed.grid.axis("base_y").count
    assert len(floor.places) == nx * ny
    for k, (x, y) in enumerate(itertools.product(range(nx), range(ny))):
        found = [Reason(bed.scores.reason[h, 2]) for h in configurations_at(bed, state, x, y)]
        assert to_hex(floor.colours[k]) == REASON_COLOURS[max(found, key=ORDER.index)]


@pytest.mark.parametrize("colouring", ["reachability", "manipulability"])
def test_colours_rise_with_the_best_score_of_a_place(bed, colouring):
    state = 3
    floor = floor_map(bed, state, 0, colouring)
    scores = getattr(bed.scores, colouring)()
    x, y = bed.grid.axis("base_x").values, bed.grid.axis("base_y").values
    best = []
    for place in floor.places:
        at = int(np.argmin(abs(x - place[0]))), int(np.argmin(abs(y - place[1])))
        best.append(max(scores[h] for h in configurations_at(bed, state, *at)))
    # Viridis grows brighter all the way up.
    order = np.argsort(best)
    brightness = floor.colours[order] @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(brightness) > -1e-3)
    assert min(best) > 0.0


def test_success_is_shown_where_a_single_has_an_estimate(estimated):
    per_state = estimated.grid.size // 6
    for h in (50, 98):
        floor = floor_map(estimated, h // per_state, 0, "success")
        at = estimated.grid.configuration(h)
        gap = abs(floor.places - [at.base_x, at.base_y]).max(axis=1)
        assert gap.min() < 1e-12
    assert not len(floor_map(estimated, 5, 0, "success").places)


@pytest.mark.parametrize("colouring", ["reason", "manipulability"])
def test_a_place_is_as_wide_as_the_step_of_the_grid(bed, colouring):
    steps = [bed.grid.axis(name).step for name in ("base_x", "base_y")]
    assert floor_map(bed, 0, 0, colouring).half == pytest.approx([step / 2 for step in steps])


def test_success_belongs_to_its_own_state_and_has_the_colour_of_its_value(bed):
    """The last configuration of one state, and the first of the next."""
    per_state = bed.grid.size // 6
    members = np.array([[per_state - 1], [per_state]], np.int32)
    success = np.array([0.25, 0.75])
    table = SuccessTable(
        members=members, success=success, low=success, high=success,
        samples=np.full(2, 100, np.int32),
    )  # fmt: skip
    viewed = dataclasses.replace(bed, success=table)
    for state, member, value in ((0, per_state - 1, 0.25), (1, per_state, 0.75)):
        floor = floor_map(viewed, state, 0, "success")
        at = bed.grid.configuration(member)
        np.testing.assert_allclose(floor.places, [[at.base_x, at.base_y]], atol=1e-12)
        np.testing.assert_allclose(floor.colours, [matplotlib.colormaps["viridis"](value)[:3]])


def test_success_is_available_only_where_it_is_stored(bed, estimated):
    assert colourings(bed) == ("reachability", "manipulability", "reason")
    assert colourings(estimated) == (*colourings(bed), "success")
