"""The live viewer: Meshcat shows the state, and its sliders and buttons change it."""

from __future__ import annotations

import logging
import secrets
import sys
import threading
import time
import webbrowser
from collections.abc import Callable

from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.math import RigidTransform

from tcs.errors import OutputError
from tcs.output.view.controls import KEYS, Controls, ViewState
from tcs.output.view.floor import floor_map
from tcs.output.view.scene_objects import SceneObjects, Snapshot, arrow_path, draw_floor
from tcs.output.view.scene_page import ScenePage
from tcs.output.view.viewed_set import ViewedSet
from tcs.placement.tables import Reason

_PAUSE = 0.01
"""Interval of polling the controls [s]: short against the 0.1 s that a change may take."""
_OPENED: list[Meshcat] = []
"""Every Meshcat that the main thread opened and that may be in use. Drake ends the process when a
Meshcat is deleted by another thread than made it, as the garbage collector may do."""
_UNUSED = 3
"""Number of references to a Meshcat that only `_OPENED` holds, while they are counted: the list,
the variable of the loop and the argument."""


def open_meshcat(port: int | None = None, *, hidden: bool = False) -> Meshcat:
    """Return an empty Meshcat that only this machine can open.

    Any page in a browser of this machine can open its socket, which asks for no origin.

    Args:
        port: Its port; by default the first free one from 7000 on.
        hidden: Whether it listens where only who knows the address finds it: at any port of any of
            16 million loopback addresses, where the system has them (Linux).

    Raises:
        OutputError: If the port is not free.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if is_main:
        _delete_unused()
    # The caller prints the address.
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.WARNING)
    host = "localhost"
    if hidden:
        port = 0
        if sys.platform == "linux":
            host = f"127.{'.'.join(str(1 + secrets.randbelow(254)) for _ in range(3))}"
    try:
        meshcat = Meshcat(MeshcatParams(host=host, port=port, show_stats_plot=False))
    except RuntimeError as error:
        where = "a port from 7000 to 7099" if port is None else f"port {port}"
        raise OutputError(f"the viewer cannot listen at {where}. Give a free one.") from error
    finally:
        log.setLevel(level)
    if is_main:
        _OPENED.append(meshcat)
    return meshcat


def _delete_unused() -> None:
    """Delete what `open_meshcat` opened in the main thread and nothing else refers to."""
    _OPENED[:] = [one for one in _OPENED if sys.getrefcount(one) > _UNUSED]


def stay_open(
    page: ScenePage,
    run: Callable[[], None],
    *,
    browser: bool,
    on_note: Callable[[str], None],
) -> None:
    """Tell the address of a viewer, open a browser if wanted, and run it until it ends or Ctrl-C.

    Args:
        page: The page of the viewer.
        run: Runs it.
        browser: Whether to open a browser.
        on_note: Called with the address, and with a note when Ctrl-C closes the viewer.
    """
    begun = time.perf_counter()
    on_note(f"open {page.url} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(page.url)
    try:
        run()
    except KeyboardInterrupt:
        on_note(f"closed after {time.perf_counter() - begun:.0f} s.")
    finally:
        page.close()


def wait(duration: float | None) -> None:
    """Wait for a duration [s], or for ever, so that Ctrl-C is noticed."""
    begun = time.perf_counter()
    while duration is None or time.perf_counter() - begun < duration:
        time.sleep(0.1)


class Viewer:
    """A set of a score file, shown in a Meshcat."""

    def __init__(
        self,
        meshcat: Meshcat,
        objects: SceneObjects,
        viewed: ViewedSet,
        report: Callable[[str], None],
    ) -> None:
        """Show the first member of the set, and add the controls.

        Args:
            meshcat: An empty Meshcat.
            objects: The objects of the scene.
            viewed: The scores and the set.
            report: Called with a line of text for each state that is shown.
        """
        self._meshcat, self._objects, self._viewed, self._report = meshcat, objects, viewed, report
        self._controls = Controls(viewed)
        arrows = ((g, reason) for g in range(viewed.goals) for reason in Reason)
        objects.set_up(meshcat, arrows)
        self._floor: tuple[int, int, str] | None = None
        self._shown: Snapshot | None = None
        self._state = self._controls.first()
        values = self._controls.values(self._state)
        for slider in self._controls.sliders:
            place = values[slider.name]
            meshcat.AddSlider(slider.name, slider.low, slider.high, slider.tick, place)
        for name, key in KEYS.items():
            meshcat.AddButton(name, key)
        self._clicks = dict.fromkeys(KEYS, 0)
        self._show()

    @property
    def state(self) -> ViewState:
        """The present state."""
        return self._state

    def update(self) -> bool:
        """Apply the changes of the controls since the last call; return whether there were any."""
        state = self._state
        before = self._controls.values(state)
        for name, value in before.items():
            now = self._meshcat.GetSliderValue(name)
            if self._controls.values(self._controls.moved(state, name, now))[name] != value:
                state = self._controls.moved(state, name, now)
        for name in KEYS:
            clicks = self._meshcat.GetButtonClicks(name)
            for _ in range(clicks - self._clicks[name]):
                state = self._controls.clicked(state, name)
            self._clicks[name] = clicks
        if state == self._state:
            return False
        self._state = state
        for name, value in self._controls.values(state).items():
            # Setting a slider that is being dragged would interrupt the drag.
            if abs(self._meshcat.GetSliderValue(name) - value) > 1e-6:
                self._meshcat.SetSliderValue(name, value)
        self._show()
        return True

    def run(self, duration: float | None = None) -> None:
        """Follow the controls for a duration [s], or until interrupted."""
        end = None if duration is None else time.monotonic() + duration
        while end is None or time.monotonic() < end:
            if not self.update():
                time.sleep(_PAUSE)

    def _show(self) -> None:
        state, controls = self._state, self._controls
        index, environment = controls.index(state), controls.environment_state(state)
        after = self._objects.snapshot(index, state.goal)
        show_change(self._meshcat, self._shown, after)
        self._shown = after
        floor = (environment, state.goal if state.colouring == "reason" else 0, state.colouring)
        if floor != self._floor:
            draw_floor(self._meshcat, floor_map(self._viewed, *floor))
            self._floor = floor
        line = self._viewed.result(index).line(state.goal)
        self._report(f"{controls.heading(state)}: {line}")


def show_change(meshcat: Meshcat, before: Snapshot | None, after: Snapshot) -> None:
    """Update the poses that differ and the arrows whose colours differ."""
    for path, pose in after.poses.items():
        if before is None or (before.poses[path] != pose).any():
            meshcat.SetTransform(path, RigidTransform(pose))
    visible = before.arrows if before is not None else frozenset()
    for arrow in sorted(after.arrows - visible):
        meshcat.SetProperty(arrow_path(arrow), "visible", True)
    for arrow in sorted(visible - after.arrows):
        meshcat.SetProperty(arrow_path(arrow), "visible", False)
