import dataclasses

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from tcs.kernel.arrays import BOX, SPHERE
from tcs.output.draw import Category, ScenePanel, Solid, draw_scene, primitive_corners


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    monkeypatch.setattr("tcs.output.draw.camera.SIZE", (240, 200))


def sphere(category, at, radius=0.3):
    return Solid.placed(category, primitive_corners(SPHERE, (radius, 0.0, 0.0)), np.eye(3), at)


# Seen from +x, the picture is 1.6 m high where they are.
SUBJECT = np.array([[0.0, 0.0, 0.2], [0.0, 0.0, 1.8]])


def view(*solids, azimuths=(0.0,), subject=SUBJECT):
    return ScenePanel(solids, subject, azimuths, "caption")


def picture(figure, panel=0):
    return np.asarray(figure.axes[panel].images[0].get_array())


def share(image, category):
    """Return the fraction of the pixels with the hue of a category."""
    colour = np.array(to_rgb(category.colour))
    wanted = colour / np.linalg.norm(colour)
    hue = image / np.maximum(np.linalg.norm(image, axis=-1, keepdims=True), 1e-9)
    return float(np.mean(hue @ wanted > 0.9995))


def test_nearer_solids_hide_others():
    # The camera looks from +x.
    near, far = [1.0, 0.0, 1.3], [-1.0, 0.0, 0.6]
    for categories in ((Category.ARM, Category.PERSON), (Category.PERSON, Category.ARM)):
        image = picture(
            draw_scene(
                [view(sphere(categories[0], near), sphere(categories[1], far, 0.1))], title=""
            )
        )
        assert share(image, categories[0]) > 0.01
        assert share(image, categories[1]) == 0.0


def test_intersecting_solids_are_both_visible():
    both = (sphere(Category.ARM, [0.0, -0.1, 1.0]), sphere(Category.PERSON, [0.0, 0.1, 1.0]))
    image = picture(draw_scene([view(*both)], title=""))
    arm, person = share(image, Category.ARM), share(image, Category.PERSON)
    # The views are mirror images except for the light.
    assert arm == pytest.approx(person, rel=0.15)
    assert arm > 0.01


@pytest.mark.parametrize("order", [(0.0, np.pi), (np.pi, 0.0)])
def test_the_side_that_shows_the_goals_is_used(order):
    wall = primitive_corners(BOX, (0.05, 2.0, 2.0))
    solids = (
        Solid.placed(Category.FURNITURE, wall, np.eye(3), [1.0, 0.0, 2.0]),
        sphere(Category.GOAL, [0.0, 0.0, 1.0], 0.2),
    )
    # From +x the wall hides the robot.
    image = picture(draw_scene([view(*solids, azimuths=order)], title=""))
    assert share(image, Category.GOAL) > 0.002


@pytest.mark.parametrize("azimuth", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("subject", ["high", "wide"])
def test_the_picture_is_as_close_as_its_subject_allows(azimuth, subject):
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    ends = {"high": [[0, 0, 0.1], [0, 0, 1.9]], "wide": [1.3 * across, -1.3 * across]}[subject]
    solids = [sphere(Category.ARM, end, 0.1) for end in ends]
    points = np.concatenate([solid.corners for solid in solids])
    image = picture(draw_scene([view(*solids, azimuths=(azimuth,), subject=points)], title=""))
    hit = np.abs(image - np.array(to_rgb(Category.ARM.colour))).max(axis=-1) < 0.5
    blue = hit & (image[..., 2] > image[..., 0] + 0.1)
    rows, columns = np.flatnonzero(blue.any(axis=1)), np.flatnonzero(blue.any(axis=0))
    found = rows if subject == "high" else columns
    size = image.shape[0 if subject == "high" else 1]
    # 94 % of the picture, in the middle; the outline takes a pixel at each end.
    assert np.ptp(found) + 1 == pytest.approx(0.94 * size, abs=4)
    assert found.min() + found.max() == pytest.approx(size - 1, abs=4)


def test_the_other_side_of_the_subject_is_in_the_picture_too():
    corners = np.array(np.meshgrid([-1.0, 1.0], [-0.7, 0.7], [0.0, 1.5])).reshape(3, -1).T
    marks = [sphere(Category.CURRENT_GOAL, corner, 0.06) for corner in corners]
    for azimuth in np.linspace(0.0, 2 * np.pi, 7):
        points = np.concatenate([mark.corners for mark in marks])
        image = picture(draw_scene([view(*marks, azimuths=(azimuth,), subject=points)], title=""))
        red = np.array(to_rgb(Category.CURRENT_GOAL.colour))
        assert np.all(np.abs(image[[0, -1]] - red).max(axis=-1) > 0.2)
        assert np.all(np.abs(image[:, [0, -1]] - red).max(axis=-1) > 0.2)


def test_no_edge_within_a_surface_that_two_solids_share():
    corners = primitive_corners(BOX, (0.3, 0.3, 0.3))
    turned = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    # The same cube twice with different triangles: rounding decides which is nearer in a pixel.
    cubes = [Solid.placed(Category.ARM, corners, R, [0, 0, 1]) for R in (turned, turned @ quarter)]
    one, both = (picture(draw_scene([view(*some)], title="")) for some in (cubes[:1], cubes))
    # Within a face: away from where it ends, and from the floor.
    from scipy.ndimage import maximum_filter, minimum_filter

    spread = maximum_filter(one, (7, 7, 1)) - minimum_filter(one, (7, 7, 1))
    within = (spread.max(axis=-1) < 0.01) & (one[..., 2] > one[..., 0] + 0.1)
    assert within.sum() > 500
    np.testing.assert_allclose(both[within], one[within], atol=0.02)


def test_goals_have_the_colour_of_the_legend():
    image = picture(draw_scene([view(sphere(Category.GOAL, [0.0, 0.0, 1.0]))], title=""))
    middle = image[image.shape[0] // 2, image.shape[1] // 2]
    np.testing.assert_allclose(middle, to_rgb(Category.GOAL.colour), atol=1e-6)


def test_one_panel_for_each_view_and_a_legend():
    views = [view(sphere(Category.ARM, [0, 0, 1])), view(sphere(Category.CURRENT_GOAL, [0, 0, 1]))]
    figure = draw_scene(views, title="both stops")
    assert len(figure.axes) == 2
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [Category.ARM.label, Category.CURRENT_GOAL.label]


@pytest.mark.parametrize("title", ["", "A title"])
@pytest.mark.parametrize("lines", [1, 3, 5])
def test_captions_are_not_cut_off(title, lines, monkeypatch):
    monkeypatch.setattr("tcs.output.draw.camera.SIZE", (300, 260))  # of the proportions of pictures
    one = view(sphere(Category.ARM, [0, 0, 1]))
    long = dataclasses.replace(one, caption="\n".join(["stop 1: serves one goal"] * lines))
    figure = draw_scene([long, one], title=title)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for axes in figure.axes:
        assert axes.title.get_window_extent(canvas.get_renderer()).y1 < figure.bbox.y1


def test_solids_behind_the_camera_are_left_out():
    image = picture(draw_scene([view(sphere(Category.ARM, [18.0, 0.0, 7.0]))], title=""))
    assert share(image, Category.ARM) == 0.0


WALL = primitive_corners(BOX, (0.05, 2.0, 1.2))


def walls(*angles, distance=1.5, height=1.2):
    """Walls around the origin, each at an angle [rad]."""
    for angle in angles:
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        yield Solid.placed(Category.FURNITURE, WALL, R, [distance * c, distance * s, height])


@pytest.mark.parametrize("azimuths", [(0.0,), (0.5, -2.2), (0.8, 2.4, -0.8, -2.4)])
def test_walls_do_not_hide_what_is_inside(azimuths):
    inside = (sphere(Category.PERSON, [0.0, -0.4, 1.0]), sphere(Category.ARM, [0.0, 0.4, 1.0]))
    around = walls(0.0, np.pi / 2, np.pi, -np.pi / 2)
    open_figure = draw_scene([view(*inside, azimuths=azimuths)], title="")
    figure = draw_scene([view(*inside, *around, azimuths=azimuths)], title="")
    for category in (Category.PERSON, Category.ARM):
        expected = share(picture(open_figure), category)
        assert expected > 0.01
        assert share(picture(figure), category) == pytest.approx(expected, rel=0.1)
    assert "left out" in figure.axes[0].get_title()
    assert "left out" not in open_figure.axes[0].get_title()


def test_the_wall_behind_stays():
    person = sphere(Category.PERSON, [0.0, 0.0, 1.0])
    image = picture(draw_scene([view(person, *walls(0.0, np.pi))], title=""))
    assert share(image, Category.FURNITURE) > 0.1


def test_a_side_without_a_wall_is_preferred():
    inside = (
        sphere(Category.PERSON, [0.0, 0.0, 1.0]),
        sphere(Category.GOAL, [0.25, 0.0, 1.0], 0.15),
    )
    # The goal is on the side of the wall.
    figure = draw_scene([view(*inside, *walls(0.0), azimuths=(0.0, np.pi / 2))], title="")
    assert share(picture(figure), Category.PERSON) > 0.01
    assert "left out" not in figure.axes[0].get_title()


def test_low_furniture_is_never_left_out():
    low = Solid.placed(Category.FURNITURE, WALL * [1.0, 1.0, 0.6], np.eye(3), [0.6, 0.0, 0.72])
    figure = draw_scene([view(sphere(Category.PERSON, [0.0, 0.0, 0.5]), low)], title="")
    assert share(picture(figure), Category.FURNITURE) > 0.1
    assert "left out" not in figure.axes[0].get_title()
