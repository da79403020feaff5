"""Whether a robot file and its URDF fit together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Joint, Urdf


def check_robot(robot: RobotFile, where: str) -> None:
    """Refuse a robot file that its URDF contradicts.

    Args:
        robot: The robot.
        where: What to call the file in a message.

    Raises:
        UnknownNameError: If it names a link, joint or frame that is not there.
        RobotError: If the arm is no chain of seven turning joints from its base to the tool, a
            posture breaks hard limits, or a name of its own is taken.
    """
    model = robot.model()
    links = _all_links(robot, model, where)
    _check_links(robot, links, model, where)
    _check_arm(robot, model, where)
    if robot.torso_joint is not None:
        torso = model.joint(robot.torso_joint, f"{where}, torso_joint")
        if torso.type != "prismatic":
            raise RobotError(
                f"{where}, torso_joint: '{torso.name}' is {torso.type}, but must be prismatic."
            )
    _check_rest(robot, model, f"{where}, rest")
    for field, choices in (("postures", robot.postures), ("grippers", robot.grippers)):
        for name, positions in choices.items():
            _check_positions(robot, model, positions, f"{where}, {field}.{name}")


def _all_links(robot: RobotFile, model: Urdf, where: str) -> Mapping[str, str]:
    """Return the parent of every link, extra frame and extra body."""
    parents = {link: "" for link in model.links}
    parents |= {joint.child: joint.parent for joint in model.joints.values()}
    extras = (*robot.frames, *robot.bodies)
    for extra in extras:
        if extra.name in parents:
            raise RobotError(
                f"{where}, frame or body '{extra.name}': this name is taken. Choose another."
            )
        parents[extra.name] = extra.parent
    for extra in extras:
        at = f"{where}, frame or body '{extra.name}', parent"
        _check_known(extra.parent, parents, at)
    for extra in extras:
        # One extra may hang on another: a tool, and a frame at its tip.
        link = extra.name
        for _ in extras:
            link = link if link in model.links else parents[link]
        if link not in model.links:
            raise RobotError(f"{where}, frame or body '{extra.name}': it hangs on itself.")
    return parents


def _check_links(robot: RobotFile, links: Mapping[str, str], model: Urdf, where: str) -> None:
    for field, name in (
        ("root_body", robot.root_body),
        ("arm_base", robot.arm_base),
        ("tool_frame", robot.tool_frame),
        *(("standing_bodies", body) for body in robot.standing_bodies),
        *(("disabled_groups", body) for pair in robot.disabled_pairs for body in pair),
        *((f"primitives '{robot.primitives}'", shape.body) for shape in robot.load_primitives()),
    ):
        _check_known(name, links, f"{where}, {field}")
    if robot.root_body != model.root:
        raise RobotError(
            f"{where}, root_body: '{robot.root_body}' is carried by another link, but must be the "
            f"root of the URDF, '{model.root}'."
        )
    for first, second in robot.disabled_pairs:
        if first == second:
            raise RobotError(f"{where}, disabled_groups: '{first}' is paired with itself.")


def _check_arm(robot: RobotFile, model: Urdf, where: str) -> None:
    """Refuse an arm that is no chain of seven turning joints from arm base to tool."""
    at = f"{where}, arm_joints"
    for name in robot.arm_joints:
        joint = model.joint(name, at)
        if joint.type not in ("revolute", "continuous"):
            raise RobotError(f"{at}: '{name}' is {joint.type}, but must be revolute or continuous.")
    extras = {extra.name: extra.parent for extra in (*robot.frames, *robot.bodies)}
    tip = robot.tool_frame
    while tip in extras:
        tip = extras[tip]
    chain = model.chain(robot.arm_base, tip)
    moving = [] if chain is None else [joint.name for joint in chain if joint.is_movable]
    if tuple(moving) != robot.arm_joints:
        found = ", ".join(moving) if chain is not None else "no chain at all"
        raise RobotError(
            f"{at}: from '{robot.arm_base}' to '{robot.tool_frame}' the URDF has {found}, "
            f"but the file says {', '.join(robot.arm_joints)}."
        )


def _check_positions(
    robot: RobotFile, model: Urdf, positions: Mapping[str, float], where: str
) -> None:
    """Refuse positions of unknown, scored or fixed joints, or outside hard limits."""
    for name, value in positions.items():
        joint = model.joint(name, where)
        if name in robot.arm_joints or name == robot.torso_joint:
            raise RobotError(f"{where}: '{name}' is scored, so a posture cannot hold it.")
        if not joint.is_movable:
            raise RobotError(f"{where}: '{name}' is fixed and has no position.")
        _check_within(joint, value, where)


def _check_rest(robot: RobotFile, model: Urdf, where: str) -> None:
    """Refuse a place of rest that names another joint than the arm's, or breaks hard limits."""
    for name, value in robot.rest.items():
        if name not in robot.arm_joints:
            raise UnknownNameError("joint of the arm", name, robot.arm_joints, where=where)
        _check_within(model.joints[name], value, where)


def _check_within(joint: Joint, value: float, where: str) -> None:
    lower, upper = joint.hard
    if not lower <= value <= upper:
        raise RobotError(
            f"{where}: '{joint.name}' is {value:g}, but must be in [{lower:g}, {upper:g}]."
        )


def _check_known(name: str, known: Iterable[str], where: str) -> None:
    known = tuple(known)
    if name not in known:
        raise UnknownNameError("link or frame", name, known, where=where)
