"""The driven arm in Drake's Meshcat: live, played back, and as a page to pass on."""

from __future__ import annotations

from tcs.output.view.teleop.live import LivePage
from tcs.output.view.teleop.replay import Replay, RunView, replay_page
from tcs.output.view.teleop.robot_display import RobotDisplay
from tcs.output.view.teleop.start import start_posture
from tcs.teleop.runs.recorder import Recorder

__all__ = [
    "LivePage",
    "Recorder",
    "Replay",
    "RobotDisplay",
    "RunView",
    "replay_page",
    "start_posture",
]
