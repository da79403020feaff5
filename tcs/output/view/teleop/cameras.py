"""Camera pictures beside the driving page, rendered by a process of their own.

Rendering takes longer than a control period and would hold Python's lock; in another process, at a
lower priority, it does not slow the control loop down.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection

import numpy as np
from numpy.typing import NDArray

from tcs.teleop import Arm

FloatArray = NDArray[np.float64]
RATE = 5.0
"""Greatest number of pictures of each camera in a second."""
NO_EGL = (
    "no camera pictures: they need EGL, which Mesa provides (apt install libegl1 libegl-mesa0). "
    "Driving continues without them."
)
_NICENESS = 5
"""Lower priority of the rendering process."""
_PATIENCE = 3.0
"""Longest wait for the process to end [s]."""


class Cameras:
    """The cameras of a robot and their last pictures."""

    def __init__(self, arm: Arm, joints: FloatArray, rate: float = RATE) -> None:
        """Start the rendering process; pictures arrive some seconds later.

        Args:
            arm: The arm.
            joints: Joint positions at the start [rad], shape (7,).
            rate: Greatest number of pictures of each camera in a second.
        """
        context = multiprocessing.get_context("spawn")
        self._pipe, far_end = context.Pipe()
        self._process = context.Process(
            target=_render, args=(far_end, arm, np.array(joints), 1.0 / rate), daemon=True
        )
        self._process.start()
        far_end.close()
        self._pictures: Mapping[str, bytes] = {}
        self._waits, self._closed = False, False
        self._sent: FloatArray | None = None
        self.fault = ""
        """Why there are no pictures; empty if there are."""
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def show(self, joints: FloatArray) -> None:
        """Request pictures of a posture, if the process waits for one; return at once.

        Args:
            joints: Joint positions [rad], shape (7,).
        """
        if not self._waits or (self._sent is not None and np.array_equal(joints, self._sent)):
            return
        self._waits, self._sent = False, np.array(joints)
        try:
            self._pipe.send(self._sent)
        except OSError:
            self.fault = self.fault or NO_EGL

    def pictures(self) -> Mapping[str, bytes]:
        """Return the last picture of each camera as JPEG, by name; empty before the first."""
        return self._pictures

    def close(self) -> None:
        """End the process."""
        self._closed = True
        self._process.terminate()
        self._process.join(_PATIENCE)
        self._thread.join(_PATIENCE)
        self._pipe.close()

    def _receive(self) -> None:
        """Keep the pictures that arrive, until the process ends."""
        try:
            while True:
                self._pictures = self._pipe.recv()
                self._waits = True
        except (EOFError, OSError):
            # A process that finds no EGL is ended by the graphics library.
            self.fault = "" if self._closed else NO_EGL


def _render(pipe: Connection, arm: Arm, joints: FloatArray, interval: float) -> None:
    """Send pictures of the postures that arrive, until the other end is closed."""
    # Ctrl-C goes to every process of the terminal; the control loop ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICENESS)
    from tcs.output.view.teleop.camera_pictures import CameraRenderer

    try:
        renderer = CameraRenderer(arm, joints)
        while True:
            begun = time.monotonic()
            pipe.send(renderer.pictures(joints))
            time.sleep(max(0.0, begun + interval - time.monotonic()))
            joints = pipe.recv()
    except (EOFError, OSError):
        return
