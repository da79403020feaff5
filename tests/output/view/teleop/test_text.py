from __future__ import annotations

import numpy as np
import pytest

from tcs.output.view.teleop.text import ADVANCE, text_mesh


def area(text):
    corners, faces = text_mesh(text)
    a, b, c = (corners[:2, faces[i]] for i in range(3))
    return 0.5 * np.sum((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])


def outline_area(letter):
    """Area inside the letter's outlines, holes run the other way around."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    path = TextPath((0, 0), letter, size=24, prop=FontProperties(family="DejaVu Sans Mono"))
    total = 0.0
    for one in path.to_polygons():
        x, y = np.asarray(one).T
        total += 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    return abs(total) / 24**2


@pytest.mark.parametrize("letter", "oB8@i%g1-")
def test_triangles_fill_the_letter_and_none_of_its_holes(letter):
    # The slabs between corners are exact; rounding of some hundred sums.
    assert area(letter) == pytest.approx(outline_area(letter), rel=1e-9)


def test_letters_stand_beside_each_other():
    corners, faces = text_mesh("a b")
    alone = text_mesh("b")[0]
    assert faces.dtype == np.int32
    assert faces.max() == corners.shape[1] - 1
    last = corners[:, -alone.shape[1] :]
    np.testing.assert_allclose(last[0], alone[0] + 2 * ADVANCE, atol=1e-12)


def test_blanks_have_no_triangles():
    corners, faces = text_mesh("  ")
    assert corners.shape == (3, 0)
    assert faces.shape == (3, 0)
