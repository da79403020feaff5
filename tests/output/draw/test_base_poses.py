import io

import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba

from tcs.output.draw.base_poses import BasePoseView, draw_base_poses


def view(poses, **changes):
    given = {
        "poses": np.array(poses, dtype=float),
        "step": 0.05,
        "positions": np.zeros((1, 2)),
        "grasps": np.array([[0.0, 0.0, np.pi / 2]]),
        "caption": "two poses",
    }
    return BasePoseView(**(given | changes))


def cells_of(figure):
    (found,) = [c for c in figure.axes[0].collections if isinstance(c, QuadMesh)]
    return found


def test_a_cell_is_around_its_base_position_and_has_the_colour_of_its_best_heading():
    poses = [[1.0, 2.0, 0.0, 0.3], [1.0, 2.0, 1.0, 0.8], [1.0, 2.0, 2.0, 0.1]]
    drawn = cells_of(draw_base_poses([view(poses)], title="t"))
    corners = drawn.get_coordinates().reshape(-1, 2)
    np.testing.assert_allclose(corners.min(axis=0), [0.975, 1.975], atol=1e-12)
    np.testing.assert_allclose(corners.max(axis=0), [1.025, 2.025], atol=1e-12)
    np.testing.assert_allclose(np.ravel(drawn.get_array()), [0.8])
    assert (drawn.norm.vmin, drawn.norm.vmax) == (0.0, 1.0)


def test_positions_without_a_base_pose_are_left_empty():
    drawn = cells_of(draw_base_poses([view([[0, 0, 0, 0.9], [0.1, 0.05, 1, 0.2]])], title="t"))
    found = np.ma.filled(np.ma.masked_invalid(drawn.get_array()), -1.0).reshape(2, 3)
    np.testing.assert_allclose(found, [[0.9, -1, -1], [-1, -1, 0.2]])


def test_panels_share_their_extent_and_marks_have_a_legend():
    marked = (("best", np.array([0.5, 0.0, 0.0]), "#c0007a"),)
    views = [view([[0, 0, 0, 0.5]], marked=marked), view([[3, 1, 0, 0.5]])]
    figure = draw_base_poses(views, title="t")
    first, second = figure.axes[:2]
    assert first.get_xlim() == second.get_xlim() == (-0.15, 3.15)
    assert [text.get_text() for text in first.get_legend().get_texts()] == ["best"]
    colours = [to_rgba(line.get_color()) for line in first.lines]
    assert to_rgba("#c0007a") in colours
    figure.savefig(io.BytesIO())
