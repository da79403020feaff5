"""Robots mounted on furniture: where the base is bolted down, and what of the robot is left."""

from __future__ import annotations

from pydantic import Field

from tcs.errors import RobotError
from tcs.files.documents import Document, Placed
from tcs.model.robots import RobotFile

_ADVICE = "Mount an arm: gen3, jaco, ur5, xarm7, or a URDF of your own of the arm alone."


class FurnitureMount(Document):
    """A frame M on furniture, in which the base poses of the grid are given.

    The base moves in the x-y plane of M, e.g. along rails, and with the furniture.
    """

    parent: str = Field(min_length=1)
    """What carries it: "model::link", the name of an obstacle, or "world"."""
    pose: Placed = Placed()
    """Pose of M in the parent's frame."""
    touches: tuple[str, ...] = ()
    """Bodies of the environment that the base may touch, by the names of contacts."""
    on_seat: bool = True
    """Whether M moves with the seat, if the parent is a wheelchair of other sizes or tilted; False
    for a mount on the frame of the wheels."""

    @property
    def furniture(self) -> str:
        """Name of the model or obstacle that carries it."""
        return self.parent.split("::")[0]


def bolted(robot: RobotFile, mount: FurnitureMount) -> RobotFile:
    """Return a robot without the pedestal that its file puts it on; a bolted one is unchanged.

    Args:
        robot: The robot. The link that its `mount` adds remains, at the root link of the URDF.
        mount: Where it is bolted down.

    Raises:
        RobotError: If it has a base of its own that stands on the floor.
    """
    where = f"robot '{robot.name}' on '{mount.furniture}'"
    own = robot.mount
    if own is not None and own.drive is not None:
        raise RobotError(f"{where}: it drives, so it cannot be mounted on furniture. {_ADVICE}")
    pedestal = set[str]()
    if own is not None:
        pedestal = {body.name for body in robot.bodies if body.parent == own.link}
    # An arm alone stands with its first link, which is what is bolted down.
    standing = [name for name in robot.standing_bodies if name not in (*pedestal, robot.arm_base)]
    if standing or robot.torso_joint is not None:
        stands = f"stands on '{standing[0]}'" if standing else "has a torso"
        raise RobotError(f"{where}: it {stands}, so it cannot be mounted on furniture. {_ADVICE}")
    if own is None and not robot.standing_bodies:
        return robot
    groups = tuple(
        group.model_copy(update={"pairs": tuple(p for p in group.pairs if pedestal.isdisjoint(p))})
        for group in robot.disabled_groups
    )
    return robot.model_copy(
        update={
            "title": f"{robot.name} mounted on {mount.furniture}",
            "mount": None if own is None else own.model_copy(update={"xyz": (0.0, 0.0, 0.0)}),
            "bodies": tuple(body for body in robot.bodies if body.name not in pedestal),
            "standing_bodies": (),
            "disabled_groups": groups,
        }
    )
