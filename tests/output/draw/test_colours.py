"""Colours are distinct under every type of colour vision."""

from __future__ import annotations

import itertools

import matplotlib
import numpy as np
import pytest

from tcs.output.draw import Category, colours
from tests.output.draw.vision import VISION, as_seen, difference

CLEAR = 15.0
"""A clear difference: six times the just noticeable one of 2.3 (Mahy, Van Eycken and Oosterlinck,
1994)."""
SCALE = [tuple(c) for c in matplotlib.colormaps[colours.SCALE](np.linspace(0.0, 1.0, 65))[:, :3]]
IN_SPACE = {category.label: category.colour for category in Category}
FROM_ABOVE = {
    "furniture": colours.FURNITURE,
    "person": colours.PERSON,
    "blocked": colours.BLOCKED,
    "empty": colours.EMPTY,
    "member": colours.MEMBER,
    "here": colours.HERE,
}


def test_the_simulation_reproduces_known_differences():
    # Red and green of equal lightness differ with all cones and are similar without the middle
    # ones. White is neutral under every colour vision.
    assert difference("#c05050", "#6f7f35", "all cones") > 50
    assert difference("#c05050", "#6f7f35", "deuteranopia") < 20
    for vision in VISION:
        # The matrices are given to six digits, and lightness goes with 116 times the cube root.
        np.testing.assert_allclose(as_seen("white", vision), [100.0, 0.0, 0.0], atol=1e-2)


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize("palette", [IN_SPACE, FROM_ABOVE], ids=["in space", "from above"])
def test_colours_of_a_legend_are_distinct(palette, vision):
    close = {
        (first, second): round(difference(palette[first], palette[second], vision), 1)
        for first, second in itertools.combinations(palette, 2)
        if difference(palette[first], palette[second], vision) < CLEAR
    }
    assert close == {}


@pytest.mark.parametrize("vision", VISION)
def test_a_better_score_is_lighter_under_every_colour_vision(vision):
    lightness = [as_seen(colour, vision)[0] for colour in SCALE]
    assert np.all(np.diff(lightness) > 0.0)
    assert lightness[-1] - lightness[0] > 60.0


@pytest.mark.parametrize("vision", VISION)
@pytest.mark.parametrize("line", [colours.MEMBER, colours.HERE])
def test_cased_lines_stand_out_on_every_score(line, vision):
    worst = min(
        max(difference(line, score, vision), difference(colours.CASING, score, vision))
        for score in SCALE
    )
    assert worst > 2 * CLEAR


@pytest.mark.parametrize("vision", VISION)
def test_positions_without_a_score_have_no_colour(vision):
    # The lowest score with a colour is next to the dark end; grey and white are light.
    for colour in (colours.BLOCKED, colours.EMPTY):
        assert min(difference(colour, score, vision) for score in SCALE[:32]) > CLEAR
