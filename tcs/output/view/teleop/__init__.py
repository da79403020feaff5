"""The driven arm in Drake's Meshcat: live, played back, and as a page to pass on."""

from __future__ import annotations

from tcs.output.view.teleop.live import LivePage
from tcs.output.view.teleop.recorder import Recorder
from tcs.output.view.teleop.replay import Film, Replay, replay_page
from tcs.output.view.teleop.stage import Stage
from tcs.output.view.teleop.start import start_posture

__all__ = ["Film", "LivePage", "Recorder", "Replay", "Stage", "replay_page", "start_posture"]
