"""Playback of a recorded run in Meshcat."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from scipy.spatial.transform import Rotation

from tcs.errors import DataFileError, GridError
from tcs.model.robots import load_robot
from tcs.output.view.teleop.panel import (
    Panel,
    Readout,
    mode_line,
    readout,
    state_facts,
)
from tcs.output.view.teleop.robot_display import TOOL, RobotDisplay, draw_course, draw_path, pose_of
from tcs.teleop import Arm, Mode, Settings, load_arm
from tcs.teleop.arm import torso_height_of
from tcs.teleop.line import GOAL_RADIUS
from tcs.teleop.runs.run import NO_GROUP, SCRIPTED_TYPE, Run
from tcs.teleop.runs.run_files import load_run

FloatArray = NDArray[np.float64]
TIME, SPEED = "time [s]", "speed"
PLAY, RESTART = "play or pause (space)", "from the start (X)"
_FRAME_PERIOD = 0.03
"""Time between two frames of the playback [s]."""


@dataclass(frozen=True, eq=False)
class RunView:
    """A run with its arm."""

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
                f"'{self.arm.name}' are {', '.join(self.arm.joints)}. Give its robot with --robot."
            )

    @property
    def course(self) -> tuple[FloatArray, FloatArray] | None:
        """Start and end of the line to follow [m]; None if the metadata contain none."""
        line = self.run.line
        return None if line is None else (np.array(line.start), np.array(line.end))

    def draw(self, meshcat: Meshcat) -> None:
        """Draw the path of the tool, and the line to follow."""
        draw_path(meshcat, self.run.position)
        if self.course is not None:
            draw_course(meshcat, *self.course, GOAL_RADIUS)

    @property
    def summary(self) -> str:
        """Duration, samples, controller and operator in one line."""
        metadata = self.run.metadata
        words = [f"{self.length:.1f} s, {len(self.run)} samples"]
        words += [f"controller {metadata['condition']}"] if "condition" in metadata else []
        if metadata.get("operator_type") == SCRIPTED_TYPE:
            operator = f"scripted operator {metadata.get('operator', '')}".strip()
            words.append(f"{operator}, not a person")
        return "; ".join(words)

    @property
    def length(self) -> float:
        """Duration [s]."""
        return float(self.run.time[-1] - self.run.time[0])

    def sample(self, seconds: float) -> int:
        """Return the number of the last sample at or before a time from the start [s]."""
        # Times in files are rounded; a millionth of a second is far below a step.
        at = np.searchsorted(self.run.time, self.run.time[0] + seconds + 1e-6, side="right")
        return int(np.clip(at - 1, 0, len(self.run) - 1))

    def tool(self, i: int) -> RigidTransform:
        """Return X_BT at a sample."""
        R = Rotation.from_quat(self.run.quaternion[i], scalar_first=True).as_matrix()
        return pose_of(R, self.run.position[i])

    def readout(self, i: int) -> Readout:
        """Return the content of the panel at a sample."""
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


def load_run_view(path: Path, robot: str | None = None) -> RunView:
    """Return the run in a file with its arm.

    Args:
        path: A file that `save_run` wrote.
        robot: Name or YAML file of the robot; None for the one in the run's metadata.

    Raises:
        DataFileError: If the file cannot be read, its metadata contain no robot, it is a run of
            another robot, or its torso height is out of the range of the robot.
    """
    run = load_run(path)
    named = robot or run.metadata.get("robot")
    if not isinstance(named, str):
        raise DataFileError(f"run '{path}': it names no robot. Give its robot with --robot.")
    height = run.metadata.get("torso_height", 0.0)
    if isinstance(height, bool) or not isinstance(height, int | float):
        raise DataFileError(
            f"run '{path}': its 'torso_height' is {height!r}, but must be a number [m]."
        )
    file = load_robot(named)
    try:
        return RunView(load_arm(file, torso_height=torso_height_of(file, float(height))), run)
    except (GridError, DataFileError, OverflowError) as error:
        raise DataFileError(f"run '{path}': {error}") from None


class Replay:
    """Playback of a run in a Meshcat, with a slider for its time."""

    def __init__(self, meshcat: Meshcat, display: RobotDisplay, view: RunView) -> None:
        """Show the first sample; the playback starts there.

        Args:
            meshcat: An empty Meshcat.
            display: The robot.
            view: The run.
        """
        self._meshcat, self._display, self.view = meshcat, display, view
        display.set_up(meshcat, view.run.position[0], target=False)
        view.draw(meshcat)
        self._panel = Panel(meshcat, view.arm)
        meshcat.AddButton(PLAY, "Space")
        meshcat.AddButton(RESTART, "KeyX")
        # A hundredth of a second is one sample at the paper's rate.
        meshcat.AddSlider(TIME, 0.0, max(view.length, 0.01), 0.01, 0.0)
        meshcat.AddSlider(SPEED, 0.1, 4.0, 0.1, 1.0)
        self._clicks = {PLAY: 0, RESTART: 0}
        self._slider = 0.0
        self.time, self.playing = 0.0, True
        self.show()

    def advance(self, seconds: float) -> None:
        """Apply the changes of the controls, then play for a wall-clock time [s]."""
        requested = self._meshcat.GetSliderValue(TIME)
        # The slider rounds the value that was set to its step.
        if abs(requested - self._slider) > 1e-9:
            self.time, self.playing = requested, False
        for name, before in self._clicks.items():
            self._clicks[name] = self._meshcat.GetButtonClicks(name)
            pressed = self._clicks[name] - before
            if name == RESTART and pressed:
                self.time, self.playing = 0.0, True
            elif name == PLAY and pressed % 2:
                ended = self.time >= self.view.length
                self.time = 0.0 if ended else self.time
                self.playing = ended or not self.playing
        if self.playing:
            self.time += seconds * self._meshcat.GetSliderValue(SPEED)
            if self.time >= self.view.length:
                self.time, self.playing = self.view.length, False
        self._slider = self._meshcat.SetSliderValue(TIME, self.time)
        self.show()

    def show(self) -> None:
        """Show the sample at the present time of the playback."""
        i = self.view.sample(self.time)
        for path, pose in self._display.poses(self.view.run.joints[i]).items():
            self._meshcat.SetTransform(path, pose)
        self._meshcat.SetTransform(TOOL, self.view.tool(i))
        self._panel.show(self.view.readout(i))

    def run(self, duration: float | None = None) -> None:
        """Play for a wall-clock time [s], or until interrupted."""
        begun = before = time.monotonic()
        while duration is None or before - begun < duration:
            time.sleep(_FRAME_PERIOD)
            now = time.monotonic()
            self.advance(now - before)
            before = now
