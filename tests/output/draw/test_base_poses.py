import io

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba

from tcs.output.draw.base_poses import BasePoseView, draw_base_poses


def view(poses, **changes):
    given = {
        "poses": np.array(poses, dtype=float),
        "length": 0.02,
        "positions": np.zeros((1, 2)),
        "grasps": np.array([[0.0, 0.0, np.pi / 2]]),
        "caption": "two poses",
    }
    return BasePoseView(**(given | changes))


def lines_of(figure):
    (found,) = [c for c in figure.axes[0].collections if isinstance(c, LineCollection)]
    return found


def test_a_line_starts_at_the_base_position_and_points_along_its_heading():
    figure = draw_base_poses([view([[1.0, 2.0, np.pi / 2, 0.3]])], title="t")
    (segment,) = lines_of(figure).get_segments()
    np.testing.assert_allclose(segment, [[1.0, 2.0], [1.0, 2.02]], atol=1e-12)


def test_the_better_pose_lies_on_top_and_colours_go_from_0_to_1():
    figure = draw_base_poses([view([[0, 0, 0, 0.9], [0, 0, 1, 0.2]])], title="t")
    drawn = lines_of(figure)
    np.testing.assert_allclose(drawn.get_array(), [0.2, 0.9])
    assert (drawn.norm.vmin, drawn.norm.vmax) == (0.0, 1.0)


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
