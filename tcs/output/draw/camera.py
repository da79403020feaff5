"""The camera of pictures in space: where it is, and the ray of each pixel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.output.draw.solids import FloatArray

IntArray = NDArray[np.int64]

SIZE = (1500, 1300)
"""Width and height of a view in pixels, before two by two are averaged."""
FOCAL = 3.5
"""Focal length over half the image height: at 5 m, a person and a robot fill the image."""
_FILLED = 0.94
"""Fraction of the picture that its subject may take up."""
_NEAREST = 0.5
"""Least distance of the camera from its subject [m]."""
_ELEVATION = np.radians(24.0)


class Camera(NamedTuple):
    """Pose of the camera; its axes are right, up and backward."""

    p: FloatArray
    """Position in the frame of the picture [m], shape (3,)."""
    R: FloatArray
    """Its axes as rows, shape (3, 3)."""


def nearest_camera(subject: FloatArray, azimuth: float) -> Camera:
    """Return the nearest camera pose with the whole subject in the picture.

    Args:
        subject: Points that have to be in the picture [m], shape (n, 3).
        azimuth: Direction from the subject to the camera, about the vertical [rad].
    """
    R = _axes(azimuth)
    right, up, backward = (subject @ R.T).T
    # A point is in the picture if |sideways| <= half * (its distance along the view), and likewise
    # upward: four bounds on the camera's position, each of them active at one point.
    half = np.array([SIZE[0] / SIZE[1], 1.0]) / FOCAL * _FILLED
    place, distance = np.zeros(3), -np.inf
    for axis, along in enumerate((right, up)):
        most = float((along + half[axis] * backward).max())
        least = float((-along + half[axis] * backward).max())
        place[axis] = 0.5 * (most - least)
        distance = max(distance, 0.5 * (most + least) / float(half[axis]))
    place[2] = max(distance, float(backward.max()) + _NEAREST)
    return Camera(place @ R, R)


def pixels_of(camera: Camera, points: FloatArray) -> FloatArray:
    """Return where points before the camera are in a view, as column and row, shape (n, 2).

    Args:
        camera: The camera.
        points: Points in the frame of the picture [m], shape (n, 3).

    >>> camera = nearest_camera(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), 0.0)
    >>> bool(np.allclose(pixels_of(camera, np.array([[0.0, 0.0, 0.5]]))[0, 0], SIZE[0] / 2 - 0.5))
    True
    """
    right, up, backward = ((points - camera.p) @ camera.R.T).T
    along = np.stack([right, -up], axis=1) / -backward[:, None]
    return np.asarray(np.array(SIZE) / 2.0 + along * FOCAL * SIZE[1] / 2.0 - 0.5)


def _axes(azimuth: float) -> FloatArray:
    """Return the camera's axes as rows: right, up, backward."""
    flat = np.cos(_ELEVATION)
    backward = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(_ELEVATION)])
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(backward, right), backward])


def rays(pixels: IntArray) -> FloatArray:
    """Return the directions of pixels in the camera's axes, with backward component -1, (n, 3).

    Args:
        pixels: Row and column of each, shape (n, 2).
    """
    middle = np.array([SIZE[1], SIZE[0]]) / 2.0
    up_right = (pixels + 0.5 - middle) * [-1.0, 1.0] / (FOCAL * middle[0])
    return np.column_stack([up_right[:, 1], up_right[:, 0], np.full(len(pixels), -1.0)])
