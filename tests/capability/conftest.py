"""TIAGo on an empty floor, and a coarse map of it, made once per session."""

from __future__ import annotations

import pytest

from tcs.capability import MapGrid, Reach, map_from_ik
from tcs.model.robots import load_robot

TORSO_HEIGHT = 0.15


@pytest.fixture(scope="session")
def tiago():
    """The TIAGo robot file."""
    return load_robot("tiago")


@pytest.fixture(scope="session")
def reach(tiago):
    """TIAGo on an empty floor, torso heights 0.05 m apart."""
    return Reach(tiago, torso_height=TORSO_HEIGHT)


@pytest.fixture(scope="session")
def coarse():
    """A grid of 0.1 m and 45 deg, side and top grasps."""
    return MapGrid.of(0.1, 8, "side+top")


@pytest.fixture(scope="session")
def ihcm(tiago, coarse):
    """The IHCM of TIAGo on the coarse grid."""
    return map_from_ik(Reach(tiago, torso_height=TORSO_HEIGHT, step=0.1), coarse)
