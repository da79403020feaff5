"""A recorded run, played back in Meshcat or written as one page that plays by itself."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatAnimation
from pydrake.math import RigidTransform
from scipy.spatial.transform import Rotation

from tcs.errors import DataFileError
from tcs.output.view.export import overlay
from tcs.output.view.teleop.panel import (
    COLOURS,
    LINES,
    Panel,
    Readout,
    bar,
    bar_properties,
    mode_line,
    readout,
    state_facts,
)
from tcs.output.view.teleop.robot_display import TOOL, RobotDisplay, draw_course, draw_path, pose_of
from tcs.teleop import Arm, Mode, Settings
from tcs.teleop.experiment.trial import GOAL_RADIUS
from tcs.teleop.runs.run import NO_GROUP, Run

FloatArray = NDArray[np.float64]
PLACE, SPEED = "time [s]", "speed"
PLAY, AGAIN = "play or hold (space)", "from the start (X)"
_RATE = 25
"""Pictures in a second of the page."""
_MOST_PICTURES = 3000
"""Of a page: a longer run gets fewer in a second, so that the page stays below 10 MB."""
_PICTURE = 0.03
"""From picture to picture of the playback [s]."""


@dataclass(frozen=True, eq=False)
class RunView:
    """What there is to see of a run."""

    arm: Arm
    run: Run

    def __post_init__(self) -> None:
        """Check that the run is one of this arm.

        Raises:
            DataFileError: If its joints have other names.
        """
        if self.run.joint_names != self.arm.joints:
            raise DataFileError(
                f"its joints are {', '.join(self.run.joint_names)}, but those of robot "
                f"'{self.arm.name}' are {', '.join(self.arm.joints)}. Name its robot with --robot."
            )

    @property
    def course(self) -> tuple[FloatArray, FloatArray] | None:
        """Start and end of the line that was to be followed [m], if the run names them."""
        found = []
        for name in ("line_start", "line_end"):
            try:
                place = np.array(self.run.metadata.get(name), dtype=np.float64)
            except (TypeError, ValueError):
                return None
            if place.shape != (3,) or not np.isfinite(place).all():
                return None
            found.append(place)
        start, end = found
        return (start, end) if (start != end).any() else None

    def draw(self, meshcat: Meshcat) -> None:
        """Draw the way of the tool, and the line that was to be followed."""
        draw_path(meshcat, self.run.position)
        if self.course is not None:
            draw_course(meshcat, *self.course, GOAL_RADIUS)

    @property
    def length(self) -> float:
        """How long it lasts [s]."""
        return float(self.run.time[-1] - self.run.time[0])

    def sample(self, seconds: float) -> int:
        """Return the number of the last sample at or before a time from the start [s]."""
        # Times were rounded when they were written; a millionth of a second is far below a step.
        at = np.searchsorted(self.run.time, self.run.time[0] + seconds + 1e-6, side="right")
        return int(np.clip(at - 1, 0, len(self.run) - 1))

    def tool(self, i: int) -> RigidTransform:
        """Return X_BT at a sample."""
        R = Rotation.from_quat(self.run.quaternion[i], scalar_first=True).as_matrix()
        return pose_of(R, self.run.position[i])

    def readout(self, i: int) -> Readout:
        """Return what the panel shows at a sample."""
        run = self.run
        mode, number = str(run.mode[i]), int(run.group[i])
        groups = Settings().groups
        known = mode == Mode.NULL_SPACE and number != NO_GROUP and number < len(groups)
        line = mode_line(mode, groups[number] if known else None, number, bool(run.clutch[i]))
        limits, singular = run.limits[i].astype(np.int8), bool(run.singular[i])
        facts = state_facts(limits, singular)
        if run.stopped[i]:
            facts = f"stopped; {facts}" if facts else "stopped"
        return readout(self.arm, run.joints[i], limits, singular, line, facts)


class Replay:
    """A film in a Meshcat, with a slider for its time."""

    def __init__(self, meshcat: Meshcat, stage: RobotDisplay, film: RunView) -> None:
        """Show the first sample, and play on from there.

        Args:
            meshcat: An empty one.
            stage: The robot.
            film: The run.
        """
        self._meshcat, self._stage, self.film = meshcat, stage, film
        stage.set_up(meshcat, film.run.position[0], target=False)
        film.draw(meshcat)
        self._panel = Panel(meshcat, film.arm)
        meshcat.AddButton(PLAY, "Space")
        meshcat.AddButton(AGAIN, "KeyX")
        # A hundredth of a second is one sample at the paper's rate.
        meshcat.AddSlider(PLACE, 0.0, max(film.length, 0.01), 0.01, 0.0)
        meshcat.AddSlider(SPEED, 0.1, 4.0, 0.1, 1.0)
        self._clicks = {PLAY: 0, AGAIN: 0}
        self._slider = 0.0
        self.place, self.playing = 0.0, True
        self.show()

    def advance(self, seconds: float) -> None:
        """Do what was asked for, and play on for so long [s] by the clock."""
        asked = self._meshcat.GetSliderValue(PLACE)
        # Where it was put is rounded to the slider's step.
        if abs(asked - self._slider) > 1e-9:
            self.place, self.playing = asked, False
        for name, before in self._clicks.items():
            self._clicks[name] = self._meshcat.GetButtonClicks(name)
            pressed = self._clicks[name] - before
            if name == AGAIN and pressed:
                self.place, self.playing = 0.0, True
            elif name == PLAY and pressed % 2:
                ended = self.place >= self.film.length
                self.place = 0.0 if ended else self.place
                self.playing = ended or not self.playing
        if self.playing:
            self.place += seconds * self._meshcat.GetSliderValue(SPEED)
            if self.place >= self.film.length:
                self.place, self.playing = self.film.length, False
        self._slider = self._meshcat.SetSliderValue(PLACE, self.place)
        self.show()

    def show(self) -> None:
        """Show the sample of this time."""
        i = self.film.sample(self.place)
        for path, pose in self._stage.poses(self.film.run.joints[i]).items():
            self._meshcat.SetTransform(path, pose)
        self._meshcat.SetTransform(TOOL, self.film.tool(i))
        self._panel.show(self.film.readout(i))

    def run(self, duration: float | None = None) -> None:
        """Play for so long [s], or until interrupted."""
        begun = before = time.monotonic()
        while duration is None or before - begun < duration:
            time.sleep(_PICTURE)
            now = time.monotonic()
            self.advance(now - before)
            before = now


def replay_page(
    meshcat: Meshcat, stage: RobotDisplay, film: RunView, *, title: str, notes: Sequence[str] = ()
) -> str:
    """Return one page that plays the run without a server.

    Args:
        meshcat: An empty one.
        stage: The robot.
        film: The run.
        title: First line, for a person.
        notes: Further lines.
    """
    rate = min(_RATE, _MOST_PICTURES / max(film.length, 1e-9))
    count = math.ceil(film.length * rate) + 1
    samples = [film.sample(number / rate) for number in range(count)]
    stage.set_up(meshcat, film.run.position[0], target=False, compact=True)
    film.draw(meshcat)
    panel = Panel(meshcat, film.arm)
    readouts = [film.readout(i) for i in samples]
    panel.show(readouts[0])
    shots = [{**stage.poses(film.run.joints[i]), TOOL: film.tool(i)} for i in samples]
    for path, pose in shots[0].items():
        meshcat.SetTransform(path, pose)
    animation = MeshcatAnimation(rate)
    for path in shots[0]:
        poses = [shot[path].GetAsMatrix34() for shot in shots]
        for at in _keys([pose.tobytes() for pose in poses]):
            animation.SetTransform(at, path, shots[at][path])
    _play_bars(animation, film.arm, readouts)
    _play_lines(animation, panel, readouts)
    meshcat.SetAnimation(animation)
    text = overlay(title, notes)
    return str(meshcat.StaticHtml()).replace("</body>", f"{text}\n</body>", 1)


def _play_bars(animation: MeshcatAnimation, arm: Arm, readouts: list[Readout]) -> None:
    """Let the bars go along, and change colour."""
    for i, bounded in enumerate(arm.bounded):
        shares = [one.shares[i] for one in readouts]
        for at in _keys(shares):
            for path, name, value in bar_properties(i, shares[at], bool(bounded)):
                animation.SetProperty(at, path, name, value)
        states = [one.states[i] for one in readouts]
        for state in COLOURS:
            _play_visible(animation, f"{bar(i)}/{state}", [one == state for one in states])


def _play_lines(animation: MeshcatAnimation, panel: Panel, readouts: list[Readout]) -> None:
    """Let the lines of text change."""
    for line in LINES:
        said = [getattr(one, line) for one in readouts]
        for text in dict.fromkeys(said):
            path = panel.text(line, text)
            if path:
                _play_visible(animation, path, [one == text for one in said])


def _play_visible(animation: MeshcatAnimation, path: str, shown: list[bool]) -> None:
    """Show and hide a thing; what is or is not there does not fade in between."""
    for at, visible in enumerate(shown):
        if at in (0, len(shown) - 1) or visible != shown[at - 1]:
            animation.SetProperty(at, path, "visible", visible)


def _keys(values: Sequence[object]) -> list[int]:
    """Return where a value is needed so that the browser's straight lines between meet them all.

    >>> _keys([1, 1, 1, 2, 3, 3, 3])
    [0, 2, 3, 4, 6]
    """
    last = len(values) - 1
    return [
        i
        for i, value in enumerate(values)
        if i in (0, last) or value != values[i - 1] or value != values[i + 1]
    ]
