"""A map for each state of a bed, from a real but small score file."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.report.score.states import has_states, states_figure
from tcs.placement.scoring import score
from tests.environments import write_environment
from tests.output.draw.test_map import words
from tests.placement.store.example import score_file
from tests.placement.tables.small import small_grid

SMALL_BED = {
    "bed_height": (0, 0.1, 3),
    "head_rest": (0, 70, 2),
    "base_x": (0.5, 0.2, 5),
    "base_y": (-0.8, 1.6, 2),
    "base_yaw": (0, 90, 4),
    "torso": (0.3, 0.1, 1),
}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bed")
    environment = write_environment(folder, "small-bed", SMALL_BED, based_on="bed", observed={})
    return score("scratching_chest", environment, paper=True)


def test_each_panel_shows_its_own_state(file):
    shown = ShownSet.of(file, None)
    figure = states_figure(file, shown)
    panels = figure.axes[:6]
    scores = file.nominal.scores
    # States in C order: bed height, then head rest; the highest bed is on top.
    by_state = scores.reachability().reshape(3, 2, 5, 2, 4)[::-1].max(axis=-1).reshape(6, 5, 2)
    assert len({one.tobytes() for one in by_state}) > 3
    for axes, expected in zip(panels, by_state, strict=True):
        drawn = axes.collections[1].get_array()
        # The two rows are so far apart that the map leaves a gap between them.
        assert np.all(np.ma.getmaskarray(drawn)[1])
        drawn = np.ma.getdata(drawn[::2])
        np.testing.assert_allclose(drawn, 100.0 * expected.T, atol=1e-9)
    assert panels[0].get_ylabel().startswith("bed height 0.20 m")
    assert panels[4].get_ylabel().startswith("bed height 0.00 m")
    assert [axes.texts[-1].get_text() for axes in panels[:2]] == [
        "head rest 0 deg",
        "head rest 70 deg",
    ]


def test_members_stand_in_the_panel_of_the_state_they_want(file):
    shown = ShownSet.of(file, None)
    figure = states_figure(file, shown, "manipulability")
    for number, member in enumerate(shown.members, start=1):
        wanted = dict(member.environment)
        row = 2 - round(wanted["bed_height"] / 0.1)
        column = round(np.degrees(wanted["head_rest"]) / 70)
        marked = [
            i
            for i, axes in enumerate(figure.axes[:6])
            if str(number) in [text.get_text() for text in axes.texts]
        ]
        assert marked == [2 * row + column]


def test_the_person_is_drawn_as_the_head_rest_has_them(file):
    figure = states_figure(file, ShownSet.of(file, None))
    flat, raised = (
        [p.vertices for p in axes.collections[2].get_paths()] for axes in figure.axes[:2]
    )
    # The head moves forward as the head rest is raised.
    assert not all(np.allclose(a, b) for a, b in zip(flat, raised, strict=False))


def test_an_environment_without_states_has_one_map():
    file = score_file(grid=small_grid(nx=3, ny=2))
    assert not has_states(file)
    with pytest.raises(SelectionError, match=r"has a single state.*without --states"):
        states_figure(file, ShownSet.of(file, None))


def test_too_many_states_are_refused():
    most = score_file(grid=small_grid(nx=2, ny=2, yaws=1, torsos=1, bed=20, head=3))
    assert has_states(most)
    file = score_file(grid=small_grid(nx=2, ny=2, yaws=1, torsos=1, bed=21, head=3))
    assert not has_states(file)
    with pytest.raises(SelectionError, match="63 states, but at most 60"):
        states_figure(file, ShownSet.of(file, None))


def test_words_of_a_panel(file):
    wording = words(states_figure(file, ShownSet.of(file, None)))
    for word in (
        "best ",
        "head rest 70 deg",
        "person",
        "Best of all headings at each base position.",
    ):
        assert word in wording
