"""The teleoperated arm in Drake's Meshcat.

In: an arm with the commands of keys, sliders and gamepad, or a recorded run. Out: a live page with
the joint panel, a playback, or one self-contained page.
"""

from __future__ import annotations

from tcs.output.view.teleop.live import LivePage
from tcs.output.view.teleop.replay import Replay, RunView
from tcs.output.view.teleop.replay_page import replay_page
from tcs.output.view.teleop.robot_display import RobotDisplay
from tcs.output.view.teleop.start import start_posture

__all__ = ["LivePage", "Replay", "RobotDisplay", "RunView", "replay_page", "start_posture"]
