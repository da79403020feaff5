import itertools
import math

import numpy as np
import pytest

from tcs.capability import (
    Grasp,
    GraspPosition,
    GraspTask,
    MapGrid,
    MapVolume,
    linear_task,
    merge,
    pick_and_place_task,
    split,
)
from tcs.capability.merge import position_scores, usable_torso_heights
from tcs.capability.volume import Box
from tcs.errors import SelectionError
from tests.capability.test_map import small_map


def merged_by_loops(capability, task, torso_height=None):
    """Return {(x, y, yaw, torso height): score} of a task, base pose by base pose in plain loops.

    Tool poses on the grid, at quarter turns, side or top grasps, one height.
    """
    grid, scores = capability.grid, capability.score()
    table = {tuple(cell): row for row, cell in enumerate(capability.cells.tolist())}
    levels = capability.torso_heights

    def of_grasp(position, grasp, back):
        found = {}
        tilt = 0 if grasp.approach == "side" else 1
        quarter = round(grasp.heading / (math.pi / 2))
        p = np.array([position.x, position.y, position.height]) - back * grasp.R_FT[:, 0]
        for (t, x, y, z, yaw), row in table.items():
            if t != tilt:
                continue
            raised = capability.torso_height + p[2] + z * grid.step
            at = (raised - levels[0]) / grid.step
            near = {math.floor(at + 1e-6), math.ceil(at - 1e-6)}
            if not all(0 <= n < len(levels) for n in near):
                continue
            if not all(int(capability.free_torso_heights[row]) >> n & 1 for n in near):
                continue
            if torso_height is not None and abs(raised - torso_height) > 0.5 * grid.step + 1e-9:
                continue
            for _ in range(quarter % 4):
                x, y = -y, x
            key = (
                x + round(p[0] / grid.step),
                y + round(p[1] / grid.step),
                (yaw + quarter * grid.yaw_bins // 4) % grid.yaw_bins,
                round(raised, 6),
            )
            found[key] = scores[row]
        return found

    result = None
    for position in task.positions:
        best = {}
        for grasp in position.grasps:
            poses = of_grasp(position, grasp, 0.0)
            for back in grasp.pre_grasps:
                before = of_grasp(position, grasp, back)
                poses = {k: min(poses[k], before[k]) for k in poses.keys() & before.keys()}
            for k, score in poses.items():
                best[k] = max(best.get(k, 0.0), score)
        if result is None:
            result = best
        else:
            result = {k: min(result[k], best[k]) for k in result.keys() & best.keys()}
    return result


def as_dict(found):
    """Return a task map as `merged_by_loops` does."""
    levels, i, j, k = np.nonzero(~np.isnan(found.score))
    keys = zip(
        (i + found.box.x).tolist(), (j + found.box.y).tolist(), k.tolist(),
        np.round(found.torso_heights[levels], 6).tolist(), strict=True,
    )  # fmt: skip
    return dict(zip(keys, found.score[levels, i, j, k].tolist(), strict=True))


def random_map(rng):
    """Return a map of most cells of a small box, some of them blocked at some torso heights."""
    grid = MapGrid.of(0.05, 8, "side+top")
    sides = [range(2), range(-6, 7), range(-6, 7), range(-10, -5), range(8)]
    cells = np.array(list(itertools.product(*sides)), np.int32)
    cells = cells[rng.uniform(size=len(cells)) < 0.9]
    n = len(cells)
    free = np.where(rng.uniform(size=n) < 0.8, 7, 2).astype(np.uint32)
    return small_map(
        cells, rng.uniform(0, 0.1, n), rng.uniform(0, 1, n), grid=grid, free_torso_heights=free
    )


TASKS = {
    "one side grasp": GraspTask("t", (GraspPosition(0, 0, 0.4, (Grasp(0.0),)),)),
    "turned": GraspTask("t", (GraspPosition(0.1, -0.05, 0.4, (Grasp(-math.pi / 2),)),)),
    "off the map's height": GraspTask("t", (GraspPosition(0, 0, 0.43, (Grasp(math.pi),)),)),
    "pick and place": pick_and_place_task(0.15, 0.4, pre_grasps=(0.05,)),
    "top": pick_and_place_task(0.1, 0.35, approach="top", pre_grasps=(0.05, 0.1)),
    "line": linear_task(0.2, 3, 0.41, direction=0),
}


@pytest.mark.parametrize("torso_height", [None, 0.1], ids=["any torso height", "one torso height"])
@pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)
@pytest.mark.parametrize("seed", [0, 1])
def test_merging_agrees_with_plain_loops(task, seed, torso_height):
    capability = random_map(np.random.default_rng(seed))
    slow = merged_by_loops(capability, task, torso_height)
    fast = as_dict(merge(capability, task, torso_height=torso_height))
    assert fast.keys() == slow.keys()
    assert len(fast) > 20
    for key, score in slow.items():
        # Scores are stored in single precision.
        assert fast[key] == pytest.approx(score, rel=1e-6)


@pytest.mark.parametrize("heading_deg", [0, 45, 30])
@pytest.mark.parametrize("shift", [0.0, 0.024])
def test_the_box_contains_all_base_positions(heading_deg, shift):
    volume = MapVolume(random_map(np.random.default_rng(0)))
    grasp = Grasp(math.radians(heading_deg))
    position = GraspPosition(0.1 + shift, -0.05 - shift, 0.4, (grasp,))
    torso_heights = usable_torso_heights(volume.capability, 0.4)
    box = volume.box_about(position.x, position.y)
    wide = Box(box.x - 5, box.y - 5, box.width + 10, box.depth + 10)
    found, all_of_them = (
        int((~np.isnan(position_scores(volume, position, b, torso_heights)[0])).sum())
        for b in (box, wide)
    )
    assert found == all_of_them > 1000


def test_on_the_grid_nothing_is_rounded():
    found = merge(random_map(np.random.default_rng(0)), TASKS["pick and place"])
    assert (found.nearness.offset, found.nearness.angle) == (0.0, 0.0)


def test_the_best_base_pose_reaches_the_task(ihcm, reach):
    """The kernel confirms every position at the torso height of the best base pose."""
    task = pick_and_place_task(0.2, 0.65, step=0.1)
    best = merge(ihcm, task, torso_height=reach.torso_height).best()
    for position in task.positions:
        c, s = math.cos(best.yaw), math.sin(best.yaw)
        R_BF = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        R = np.stack([R_BF @ grasp.R_FT for grasp in position.grasps])
        p = R_BF @ [position.x - best.x, position.y - best.y, position.height]
        # The torso height of the best is within half a step of the map's; the arm moves with it.
        p[2] -= best.torso_height - reach.torso_height
        assert reach.solve(R, np.tile(p, (len(R), 1))).reached.any()


def test_rotating_the_task_by_90_deg_rotates_the_base_poses(ihcm):
    line = linear_task(0.3, 2, 0.65, headings=(0.0,), direction=0, step=0.1)
    turned = linear_task(0.3, 2, 0.65, headings=(math.pi / 2,), direction=1, step=0.1)
    one, two = merge(ihcm, line).base_poses, merge(ihcm, turned).base_poses
    expected = np.column_stack([-one[:, 1], one[:, 0], one[:, 2] + math.pi / 2, one[:, 3:]])

    def rows(poses):
        wrapped = np.mod(np.round(poses[:, 2] / (math.pi / 4)), 8)
        table = np.column_stack([poses[:, :2] * 10, wrapped, poses[:, 3:]]).round(5) + 0.0
        return sorted(map(tuple, table.tolist()))

    assert rows(expected) == rows(two)


def test_more_grasps_never_take_a_base_pose_away_nor_lower_its_score(ihcm):
    few = as_dict(merge(ihcm, linear_task(0.2, 2, 0.65, headings=(0.0,), step=0.1)))
    many = as_dict(merge(ihcm, linear_task(0.2, 2, 0.65, headings=(0.0, math.pi / 2), step=0.1)))
    assert few
    assert all(many[key] >= score for key, score in few.items())
    assert len(many) > len(few)


def test_a_pre_grasp_never_adds_a_base_pose(ihcm):
    plain = merge(ihcm, linear_task(0.2, 2, 0.65, step=0.1))
    careful = merge(ihcm, linear_task(0.2, 2, 0.65, pre_grasps=(0.1,), step=0.1))
    assert as_dict(careful).keys() < as_dict(plain).keys()


@pytest.mark.parametrize(("heading_deg", "shift"), [(10.0, 0.0), (0.0, 0.02), (37.0, 0.013)])
def test_off_the_grid_the_nearest_cell_is_used_and_its_distance_reported(ihcm, heading_deg, shift):
    grasp = Grasp(math.radians(heading_deg))
    task = GraspTask("t", (GraspPosition(shift, 0.0, 0.65, (grasp,)),))
    found = merge(ihcm, task)
    step, turn = ihcm.grid.step, ihcm.grid.yaw_step
    assert 0.0 < found.nearness.offset <= 0.5 * step + 1e-9 or (heading_deg == 0.0 and shift == 0.0)
    off = abs((math.radians(heading_deg) + turn / 2) % turn - turn / 2)
    assert found.nearness.angle == pytest.approx(off, abs=1e-9)
    # The same as looking up each base pose in the map.
    poses = found.base_poses
    R_FB = np.stack(
        [
            [[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]
            for a in poses[:, 2]
        ]
    )
    R_BT = np.swapaxes(R_FB, 1, 2) @ grasp.R_FT
    away = np.column_stack(
        [
            shift - poses[:, 0],
            -poses[:, 1],
            np.full(len(poses), 0.65) - (poses[:, 3] - ihcm.torso_height),
        ]
    )
    rows = ihcm.look_up(R_BT, np.einsum("nji,nj->ni", R_FB, away))
    same = rows >= 0
    # Between two cells either may be the nearest.
    assert same.mean() > 0.99
    np.testing.assert_allclose(ihcm.score()[rows[same]], poses[same, 4], rtol=1e-5)


def test_an_empty_intersection_names_the_best_subset(ihcm):
    with pytest.raises(
        SelectionError,
        match=r"no base pose reaches all 4 positions; best subset: [23] of 4 \(number",
    ):
        merge(ihcm, linear_task(2.4, 4, 0.65, step=0.1))


def test_positions_too_far_apart_to_share_a_box(ihcm):
    with pytest.raises(SelectionError, match=r"best subset: 1 of 2"):
        merge(ihcm, linear_task(15.0, 2, 0.65, step=0.1))


def test_an_unreachable_height(ihcm):
    with pytest.raises(SelectionError, match="nor any one of them"):
        merge(ihcm, linear_task(0.2, 2, 2.9, step=0.1))


def test_a_torso_height_out_of_range(ihcm):
    with pytest.raises(SelectionError, match="no torso height of this map"):
        merge(ihcm, linear_task(0.2, 2, 0.65, step=0.1), torso_height=2.0)


def test_the_best_and_the_worst(ihcm):
    found = merge(ihcm, linear_task(0.2, 2, 0.65, step=0.1))
    scores = found.base_poses[:, 4]
    assert found.best().score == scores.max() > found.worst().score == scores.min()
    assert np.all((found.base_poses[:, 2] > -math.pi) & (found.base_poses[:, 2] <= math.pi))


def test_a_volume_gives_the_same_results_as_its_map(ihcm):
    task = linear_task(0.2, 2, 0.65, step=0.1)
    np.testing.assert_array_equal(merge(MapVolume(ihcm), task).score, merge(ihcm, task).score)


def test_a_long_line_is_split_into_the_fewest_stops(ihcm):
    task = linear_task(2.4, 9, 0.65, step=0.1)
    stops = split(ihcm, task)
    covered = [i for stop in stops for i in range(stop.first, stop.last + 1)]
    assert covered == list(range(len(task.positions)))
    assert len(stops) >= 2
    for stop in stops:
        part = GraspTask("part", task.positions[stop.first : stop.last + 1])
        assert merge(ihcm, part).best() == stop.base

    # Exhaustive search over all divisions of the line finds no fewer stops.
    def reachable(first, last):
        try:
            merge(ihcm, GraspTask("part", task.positions[first : last + 1]))
        except SelectionError:
            return False
        return True

    n = len(task.positions)
    for fewer in range(1, len(stops)):
        for cuts in itertools.combinations(range(1, n), fewer - 1):
            ends = [0, *cuts, n]
            assert not all(reachable(a, b - 1) for a, b in itertools.pairwise(ends))


def test_the_split_maximises_the_lowest_score():
    """Exhaustive search over all divisions of a line, on maps of random scores."""
    distinguished = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        capability = random_map(rng)
        # Unevenly spaced positions: otherwise all parts of two positions are equal.
        places = np.cumsum(rng.integers(2, 9, 5)) * 0.05
        task = GraspTask("t", tuple(GraspPosition(x, 0, 0.41, (Grasp(0.0),)) for x in places))
        n = len(task.positions)
        best = {}
        for a, b in itertools.combinations(range(n + 1), 2):
            try:
                part = GraspTask("part", task.positions[a:b])
                best[a, b] = merge(capability, part).best().score
            except SelectionError:
                continue
        ways = [
            [best.get(stretch, -1.0) for stretch in itertools.pairwise((0, *cuts, n))]
            for count in range(n)
            for cuts in itertools.combinations(range(1, n), count)
        ]
        ways = [way for way in ways if min(way) >= 0.0]
        fewest = min(map(len, ways))
        lowest = [min(way) for way in ways if len(way) == fewest]
        distinguished += len(set(lowest)) > 1
        stops = split(capability, task)
        assert len(stops) == fewest
        assert min(stop.base.score for stop in stops) == max(lowest)
    assert distinguished > 0


def test_one_stop_where_one_suffices(ihcm):
    task = linear_task(0.2, 2, 0.65, step=0.1)
    assert [stop.base for stop in split(ihcm, task)] == [merge(ihcm, task).best()]


def test_an_unreachable_position_cannot_be_split(ihcm):
    with pytest.raises(SelectionError, match="nor any one"):
        split(ihcm, linear_task(0.2, 2, 2.9, step=0.1))


def test_a_merge_that_would_fill_the_memory_is_refused():
    grid = MapGrid.of(0.005, 256, "side")
    cells = [[0, -4000, 0, 0, 0], [0, 4000, 0, 0, 0]]
    heights = {"torso_heights": np.array([0.1]), "torso_height": 0.1}
    wide = small_map(cells, [0.1, 0.1], [1.0, 1.0], grid=grid, **heights)
    with pytest.raises(SelectionError, match="number of cells must be 0 to 200,000,000"):
        merge(wide, pick_and_place_task(0.1, 0.0, step=grid.step))
