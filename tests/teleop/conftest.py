"""Arms that several tests use."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.teleop import load_arm


@pytest.fixture(scope="session")
def iiwa():
    """The arm of the KUKA LBR iiwa 7."""
    return load_arm("iiwa7")


@pytest.fixture
def ready():
    """A posture of the iiwa in the middle of its workspace, elbow up [rad]."""
    return np.array([0.0, 0.6, 0.0, -1.4, 0.0, 1.0, 0.0])
