"""The driven arm in Drake's Meshcat: live, played back, and as a page to pass on."""

from __future__ import annotations

from tcs.view.teleop.live import LivePage
from tcs.view.teleop.recorder import Recorder
from tcs.view.teleop.replay import Film, Replay, replay_page
from tcs.view.teleop.stage import Stage
from tcs.view.teleop.start import start_posture

__all__ = ["Film", "LivePage", "Recorder", "Replay", "Stage", "replay_page", "start_posture"]
