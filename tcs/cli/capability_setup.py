"""Which robot and which grid a capability map is of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tcs.errors import StoreError, UnknownNameError

if TYPE_CHECKING:
    from tcs.capability import CapabilityMap, MapGrid, Reach


@dataclass(frozen=True, slots=True)
class Setup:
    """Robot and grid that a map is made for."""

    robot: str
    tool: str | None
    lift: float | None
    step: float
    turns: int
    grasps: str
    measure: str
    head: str | None = None

    def reach(self) -> Reach:
        """Return the robot on an empty floor.

        Raises:
            UnknownNameError: If the tool is none of its frames.
        """
        from tcs.capability import Reach
        from tcs.model.robots import load_robot
        from tcs.placement.scoring import data_reference

        robot = load_robot(self.robot)
        found_as = data_reference(self.robot, robot.name)
        if self.tool is not None:
            known = {
                *robot.model().links,
                *(extra.name for extra in (*robot.frames, *robot.bodies)),
            }
            if self.tool not in known:
                raise UnknownNameError(
                    "tool frame", self.tool, known, where=f"robot '{robot.name}'"
                )
            robot = robot.model_copy(update={"tool_frame": self.tool})
        return Reach(
            robot, lift=self.lift, step=self.step, measure=self.measure, found_as=found_as,
            head=self.head,
        )  # fmt: skip

    def grid(self) -> MapGrid:
        """Return the grid."""
        from tcs.capability import MapGrid

        return MapGrid.of(self.step, self.turns, self.grasps)


def robot_of(path: Path, capability: CapabilityMap, asked: str | None) -> str:
    """Return the name or file of a map's robot: the one asked for, or the one it remembers."""
    from tcs.model.robots import robot_names

    if asked is not None:
        return asked
    kept = str(capability.metadata["robot"])
    if kept in robot_names() or Path(kept).is_file():
        return kept
    raise StoreError(
        f"Capability map '{path}' was made for robot '{kept}', which neither ships with tcs nor "
        "lies there as a file. Say where its file is with --robot FILE."
    )
