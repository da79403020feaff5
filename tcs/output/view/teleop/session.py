"""A live session: one robot, the page that teleoperates its arm, and the recording of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

import tcs
from tcs.errors import OutputError, TcsError
from tcs.kernel.arrays import FloatArray
from tcs.model.robots import load_robot
from tcs.output.view.live import open_meshcat
from tcs.output.view.teleop.cameras import Cameras
from tcs.output.view.teleop.controls import buttons, sliders
from tcs.output.view.teleop.live import LivePage
from tcs.output.view.teleop.operator_page import OperatorPage, desk_of, operator_html
from tcs.output.view.teleop.page_link import PageLink
from tcs.output.view.teleop.robot_display import RobotDisplay, draw_course
from tcs.output.view.teleop.set_point import joint_sliders
from tcs.output.view.teleop.start import start_posture
from tcs.teleop import Arm, Command, Mode, Settings, Step, load_arm
from tcs.teleop.arm import torso_height_of
from tcs.teleop.control.latency import NO_LATENCY, Latency
from tcs.teleop.control.settings import LimitBehaviour
from tcs.teleop.line import GOAL_RADIUS, Course
from tcs.teleop.runs.recorder import Recorder
from tcs.teleop.runs.run import Run

LiveCondition = Literal["end-effector", "novel", "assisted", "drake", "joint"]
CONDITION_MODES: Mapping[LiveCondition, tuple[Mode, ...]] = {
    "end-effector": (Mode.END_EFFECTOR,),
    "novel": (Mode.END_EFFECTOR, Mode.NULL_SPACE, Mode.POSE),
    "assisted": (Mode.ASSISTED, Mode.NULL_SPACE, Mode.POSE),
    "drake": (Mode.DRAKE, Mode.NULL_SPACE, Mode.POSE),
    "joint": (Mode.JOINT, Mode.END_EFFECTOR),
}
"""Modes between which the operator can switch, by condition."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveOptions:
    """Options of a live session.

    Attributes:
        robot: Name or YAML file of the robot.
        behaviour: Behaviour at a joint limit.
        condition: Key of `CONDITION_MODES`.
        start_deg: Start posture [deg], seven numbers; None to search for one.
        torso_height: Height of the torso joint [m]; None for the middle of its range.
        course: A line to show and its start posture; None for none.
        latency: Latency between the operator and the arm.
        cameras: Whether the page shows pictures of the head and wrist cameras.
        xr: Whether an XR controller can move the tool.
    """

    robot: str
    behaviour: LimitBehaviour = "clamped"
    condition: LiveCondition = "novel"
    start_deg: tuple[float, ...] | None = None
    torso_height: float | None = None
    course: Course | None = None
    latency: Latency = NO_LATENCY
    cameras: bool = False
    xr: bool = False


class LiveSession:
    """A robot whose arm an operator teleoperates in the browser.

    Attributes:
        arm: The arm.
        course: The line to follow and its start posture; None without a line.
        page: The live page.
        url: Address of the page.
        cameras: The camera pictures; None without.
        link: Controls of the page, and the readout that it shows.
    """

    cameras: Cameras | None

    def __init__(
        self,
        options: LiveOptions,
        *,
        port: int | None,
        on_stop: Callable[[str], None],
        record: bool,
        on_step: Callable[[Command, Step], None] | None = None,
    ) -> None:
        """Open the page.

        Args:
            options: Robot, condition and start.
            port: Port of the page; None for the first free one.
            on_stop: Called with the reason whenever the arm stops.
            record: Whether to record a run; with a line it is recorded in any case.
            on_step: Called with each command and step that is recorded.

        Raises:
            OutputError: If the port cannot be used.
            TcsError: If the robot cannot be used, the start posture is out of the joint
                limits.
        """
        self._options = options
        robot = load_robot(options.robot)
        self.arm = load_arm(robot, torso_height=torso_height_of(robot, options.torso_height))
        start = None if options.start_deg is None else _start(self.arm, options.start_deg)
        meshcat = self._meshcat = open_meshcat(hidden=True)
        display = RobotDisplay(self.arm, meshes=True)
        self.course = options.course
        if self.course is not None:
            start = self.course.joints
        if start is None:
            start = start_posture(self.arm, display)
        self._recorder, self._on_step = Recorder(self.arm), on_step
        self._on_stop, self._fault = on_stop, ""
        settings = Settings(limits=options.behaviour)
        controls = sliders()
        if Mode.JOINT in CONDITION_MODES[options.condition]:
            controls |= joint_sliders(self.arm.lower, self.arm.upper)
        self.link = PageLink(buttons(len(settings.groups)), controls)
        self._open_page(start, port, settings)
        self.page = LivePage(
            meshcat,
            display,
            self.arm,
            start,
            settings=settings,
            modes=CONDITION_MODES[options.condition],
            latency=options.latency,
            link=self.link,
            on_stop=on_stop,
            on_step=self._record if record or self.course is not None else None,
            on_show=None if self.cameras is None else self._show_cameras,
        )
        if self.course is not None:
            ends = np.array(self.course.line.start), np.array(self.course.line.end)
            draw_course(meshcat, *ends, GOAL_RADIUS)

    def _open_page(self, start: FloatArray, port: int | None, settings: Settings) -> None:
        """Serve the operator's page, and start its cameras."""
        options = self._options
        desk = desk_of(self.arm, settings.groups, self.link.sliders)
        page = operator_html(desk, cameras=options.cameras, xr=options.xr)
        self.cameras = Cameras(self.arm, start) if options.cameras else None
        pictures = dict if self.cameras is None else self.cameras.pictures
        try:
            self._server = OperatorPage(page, pictures, self.link, self._meshcat, port)
        except OutputError:
            self.close_cameras()
            raise
        self.url = self._server.url

    def _show_cameras(self, joints: FloatArray) -> None:
        """Request pictures of a posture, or report once why there are none."""
        assert self.cameras is not None
        if self.cameras.fault and not self._fault:
            self._fault = self.cameras.fault
            self._on_stop(self._fault)
        self.cameras.show(joints)

    def close(self) -> None:
        """End the camera process and the server of the operator's page."""
        self._server.close()
        self.close_cameras()

    def close_cameras(self) -> None:
        """End the camera process, if there is one."""
        if self.cameras is not None:
            self.cameras.close()

    def begin(self) -> None:
        """Put the arm back to the start, in the first mode, and begin a new run."""
        self.page.restart()
        self._recorder = Recorder(self.arm)

    def _record(self, command: Command, step: Step) -> None:
        self._recorder.add(command, step)
        if self._on_step is not None:
            self._on_step(command, step)

    def run(self) -> Run | None:
        """Return the recorded run; None if no browser was connected."""
        metadata: dict[str, Any] = {
            "tcs": tcs.__version__,
            "robot": self._options.robot,
            "torso_height": self.arm.torso_height,
            "condition": self._options.condition,
            "limits": self._options.behaviour,
            "operator_type": "live",
            **self._options.latency.to_json(),
        }
        if self.course is not None:
            line = self.course.line
            metadata |= {"line_start": list(line.start), "line_end": list(line.end)}
        return self._recorder.run(metadata)


def _start(arm: Arm, degrees: tuple[float, ...]) -> FloatArray:
    """Return a start posture [rad], shape (7,).

    Raises:
        TcsError: If it is out of the joint limits.
    """
    start = arm.checked([math.radians(value) for value in degrees], "start posture")
    outside = arm.limit_violation(start)
    if outside:
        raise TcsError(f"start posture: {outside}. Give another with --start-deg.")
    return start
