import numpy as np
import pytest
from matplotlib.colors import to_rgb

from tcs.draw import Kind, Solid, View, draw_scene, primitive_corners
from tcs.kernel.arrays import BOX, SPHERE


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    monkeypatch.setattr("tcs.draw.picture._SIZE", (240, 200))


def ball(kind, at, radius=0.3):
    return Solid.placed(kind, primitive_corners(SPHERE, (radius, 0.0, 0.0)), np.eye(3), at)


def view(*solids, azimuths=(0.0,)):
    return View(solids, np.array([0.0, 0.0, 1.0]), 4.0, azimuths, "caption")


def picture(figure, panel=0):
    return np.asarray(figure.axes[panel].images[0].get_array())


def share(image, kind):
    """Share of the pixels with the hue of a kind."""
    colour = np.array(to_rgb(kind.colour))
    wanted = colour / np.linalg.norm(colour)
    hue = image / np.maximum(np.linalg.norm(image, axis=-1, keepdims=True), 1e-9)
    return float(np.mean(hue @ wanted > 0.9995))


def test_what_is_nearer_hides_what_is_behind():
    # The camera looks from +x.
    near, far = [1.0, 0.0, 1.3], [-1.0, 0.0, 0.6]
    for kinds in ((Kind.ARM, Kind.PERSON), (Kind.PERSON, Kind.ARM)):
        image = picture(
            draw_scene([view(ball(kinds[0], near), ball(kinds[1], far, 0.1))], title="")
        )
        assert share(image, kinds[0]) > 0.01
        assert share(image, kinds[1]) == 0.0


def test_solids_that_pass_through_one_another_are_both_seen():
    both = (ball(Kind.ARM, [0.0, -0.1, 1.0]), ball(Kind.PERSON, [0.0, 0.1, 1.0]))
    image = picture(draw_scene([view(*both)], title=""))
    arm, person = share(image, Kind.ARM), share(image, Kind.PERSON)
    # Mirror images of one another but for the light.
    assert arm == pytest.approx(person, rel=0.15)
    assert arm > 0.01


@pytest.mark.parametrize("order", [(0.0, np.pi), (np.pi, 0.0)])
def test_the_side_that_shows_the_goals_is_taken(order):
    wall = primitive_corners(BOX, (0.05, 2.0, 2.0))
    solids = (
        Solid.placed(Kind.FURNITURE, wall, np.eye(3), [1.0, 0.0, 2.0]),
        ball(Kind.GOAL, [0.0, 0.0, 1.0], 0.2),
    )
    # From +x the wall is in the way.
    image = picture(draw_scene([view(*solids, azimuths=order)], title=""))
    assert share(image, Kind.GOAL) > 0.002


def test_size_on_the_picture_follows_from_the_distance():
    image = picture(draw_scene([view(ball(Kind.ARM, [0.0, 0.0, 1.0], 0.2))], title=""))
    seen = np.flatnonzero([share(row[None], Kind.ARM) > 0 for row in image])
    # Half height 100 px of 200, halved; focal 3.5: 0.4 m at 4 m is 0.1 x 3.5 x 50 = 17.5 px.
    assert seen.max() - seen.min() + 1 == pytest.approx(17.5, abs=2)


def test_one_panel_for_each_view_and_a_legend():
    views = [view(ball(Kind.ARM, [0, 0, 1])), view(ball(Kind.CURRENT_GOAL, [0, 0, 1]))]
    figure = draw_scene(views, title="both stops")
    assert len(figure.axes) == 2
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [Kind.ARM.label, Kind.CURRENT_GOAL.label]


def test_what_is_behind_the_camera_is_left_out():
    image = picture(draw_scene([view(ball(Kind.ARM, [8.0, 0.0, 3.0]))], title=""))
    assert share(image, Kind.ARM) == 0.0
