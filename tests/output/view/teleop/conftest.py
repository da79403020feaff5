from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from tcs.output.view import open_meshcat
from tcs.output.view.teleop import LivePage, RobotDisplay
from tcs.output.view.teleop.controls import Reading, buttons, sliders
from tcs.output.view.teleop.page_link import PageLink
from tcs.output.view.teleop.set_point import JOINT_STEP
from tcs.teleop import Command, Mode, Settings, Teleoperation, load_arm
from tcs.teleop.runs.recorder import run_from_steps

MODES = (Mode.END_EFFECTOR, Mode.NULL_SPACE, Mode.POSE)


@pytest.fixture(scope="session")
def iiwa():
    return load_arm("iiwa7")


@pytest.fixture(scope="session")
def iiwa_display(iiwa):
    return RobotDisplay(iiwa, meshes=False)


@pytest.fixture
def ready():
    """A posture of the iiwa in the middle of its workspace, elbow up [rad]."""
    return np.array([0.0, 0.6, 0.0, -1.4, 0.0, 1.0, 0.0])


@pytest.fixture(scope="module")
def shared_meshcat():
    return open_meshcat()


@pytest.fixture
def meshcat(shared_meshcat):
    yield shared_meshcat
    shared_meshcat.Delete()
    shared_meshcat.Delete("/Cameras/default/rotated/<object>/panel")
    shared_meshcat.DeleteAddedControls()


class Instead:
    """A Meshcat with some functions replaced by those of a test.

    A class defined inside a test is part of a reference cycle with its Meshcat, which any thread
    may collect; Drake ends the process if that is not the thread that created the Meshcat.
    """

    def __init__(self, meshcat, **own):
        self.__dict__.update(own, meshcat=meshcat)

    def __getattr__(self, name):
        return getattr(self.meshcat, name)


@dataclass
class Desk:
    """Controls operated by a test."""

    sliders: dict[str, float] = field(
        default_factory=lambda: {name: value for name, (*_, value) in sliders().items()}
    )
    clicks: dict[str, int] = field(default_factory=lambda: dict.fromkeys(buttons(4), 0))
    pad: object = None
    pose: object = None
    watched: bool = True
    held: frozenset[str] = frozenset()
    silent: bool = False

    def press(self, name, times=1):
        self.clicks[name] += times

    def read(self):
        return Reading(
            dict(self.sliders), dict(self.clicks), self.pad, self.watched, self.pose, self.held,
            self.silent,
        )  # fmt: skip

    def set_slider(self, name, value):
        self.sliders[name] = value = round(value / JOINT_STEP) * JOINT_STEP
        return value

    def zero(self):
        for name in self.sliders:
            if "/s]" in name and "key" not in name:
                self.sliders[name] = 0.0


@pytest.fixture
def desk():
    return Desk()


class Clock:
    """A time that a test sets [s]."""

    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def link(clock):
    return PageLink(buttons(4), sliders(), clock)


@pytest.fixture
def reasons():
    return []


@pytest.fixture
def page(meshcat, iiwa_display, iiwa, ready, reasons, desk, link):
    """A live page with the controls of the desk."""
    found = LivePage(
        meshcat, iiwa_display, iiwa, ready, settings=Settings(), modes=MODES, link=link,
        on_stop=reasons.append,
    )  # fmt: skip
    found.operator.source = desk
    return found


@pytest.fixture(scope="session")
def driven(iiwa):
    """A run of 9 s: down to a limit, a motion of a joint group, and out to a stretched arm."""
    session = Teleoperation(iiwa, [0.0, 0.6, 0.0, -1.4, 0.0, 1.0, 0.0])
    commands = [(Command(linear=(0.0, 0.0, -0.2)), 300)]
    commands += [(Command(mode=Mode.NULL_SPACE, group=0, sign=1), 100)]
    commands += [(Command(mode=Mode.END_EFFECTOR, linear=(0.25, 0.0, 0.1)), 500)]
    rows = [(command, session.step(command)) for command, count in commands for _ in range(count)]
    return run_from_steps(iiwa, rows, {"robot": "iiwa7", "torso_height": 0.0, "condition": "novel"})
