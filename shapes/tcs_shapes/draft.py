"""Draft a robot file from a URDF: arm, torso, posture, primitives and disabled pairs."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from tcs.errors import OutputError, RobotError, UnknownNameError
from tcs.files.writing import check_writable, scratch_folder, whole_file
from tcs.files.xml_documents import read_xml
from tcs.model.robots.loading import check_robot
from tcs.model.robots.primitives import Primitive, write_primitives
from tcs.model.robots.robot_file import (
    ExtraFrame,
    Mount,
    RobotFile,
)
from tcs.model.robots.tool_frame import hand_axes, tool_place
from tcs.model.robots.urdf import Joint, Urdf, read_urdf
from tcs.model.robots.urdf.model import SurfacesOf
from tcs.model.robots.urdf.packages import resolve_uri
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs_shapes.arm_joints import nearest_joints
from tcs_shapes.blocked import Blocked, blocked_at_boxes, blocked_by_shapes
from tcs_shapes.bodies import fit_robot
from tcs_shapes.clearance import SurfaceDistance, carried_surfaces
from tcs_shapes.disabled_pairs import propose_disabled_pairs
from tcs_shapes.doubts import doubts
from tcs_shapes.self_collision import DRAWS, free_posture
from tcs_shapes.tightening import tightened

_VERTICAL = 0.99
"""Cosine to the vertical above which a prismatic joint counts as torso joint."""

_ALLOWED = 0.01
"""Fraction of free postures that shapes may block before those of the bodies concerned are made
tighter."""
_LEFT = 0.5
"""Fraction of those postures that pairs of bodies may block which are left as they are."""
_SPLITS = 12
"""Shapes of such a body that may be split in two."""
_HEADER = """\
# Drafted by `tcs robot new`; review these choices:
{remarks}
"""
_ON_FLOOR = 0.02
"""Bodies that reach down to this height [m] stand on the floor."""
_ABOVE = 0.1
"""Height of the lowest surface above the root from which on the robot seems to hover [m]."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A robot file drafted from a URDF, to be reviewed by the user.

    Attributes:
        robot: Content of the file; its URDF is an absolute path or a `package://` address.
        primitives: The collision primitives.
        remarks: The choices made, one line each.
    """

    robot: RobotFile
    primitives: tuple[Primitive, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class DraftOptions:
    """How a robot file is drafted.

    Attributes:
        base: Link at or beyond which the arm starts; None is the root.
        coarse: Whether a few shapes on each link do, which protrude farther.
        collision_meshes: Whether the collision geometry of a link, if there is any, is its whole
            surface.
        ignore: Links that nothing is checked against.
        packages: Folders in which packages that the URDF names are searched for first.
        jobs: Number of processes that fit shapes, tighten them and compare pairs of bodies.
    """

    base: str | None = None
    coarse: bool = False
    collision_meshes: bool = False
    ignore: tuple[str, ...] = ()
    packages: tuple[str, ...] = ()
    jobs: int = 1


USUAL = DraftOptions()
"""The arm nearest the tool, its visual and collision geometry enclosed closely."""


def draft_robot(
    urdf: str | Path,
    tool: str,
    options: DraftOptions = USUAL,
    *,
    name: str | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Draft:
    """Return a robot file for a URDF.

    The arm consists of the joints nearest the tool that `nearest_joints` takes. The torso is a
    vertical prismatic joint between root and arm. Every other joint is at 0 if its range includes
    0, else in the middle of its range, and so is a joint of the hand whose range ends at 0.
    `fit_robot` gives the primitives and `propose_disabled_pairs` the pairs that need no check. If
    the hand does not point along x of the tool, a frame with the axes that goals need is added.

    Args:
        urdf: Path of the URDF, or its `package://` address.
        tool: T, the link that moves to the goals.
        options: Arm, and closeness of the primitives.
        name: Name of the robot; None is the file name of the URDF.
        on_progress: Called with the number of steps done and of all: bodies to fit, and tests.

    Raises:
        UnknownNameError: If tool, base or a link to ignore is not a link of the URDF.
        RobotError: If the URDF or a mesh cannot be used, the base does not carry the tool, or no
            arm that is supported leads to it.
    """
    path = Path(os.path.realpath(resolve_uri(str(urdf), Path(), options.packages)))
    model = read_urdf(path, options.packages)
    arm, arm_base, torso = _arm(model, tool, options.base)
    for link in options.ignore:
        if link not in model.links:
            where = f"URDF '{path}', links to ignore"
            raise UnknownNameError("link", link, model.links, where=where)
    surfaces: SurfacesOf = "collision" if options.collision_meshes else "all"
    model = model.with_surfaces(of=surfaces, ignored=options.ignore)
    model.require_surfaces()
    if not body_triangles(model):
        raise RobotError(
            f"URDF '{path}': no link has a visual or collision geometry, so there is nothing to "
            "check for collisions. Add geometry to its links."
        )
    address = str(urdf) if str(urdf).startswith("package://") else str(path)
    posture, gripper = _positions(model, arm, torso)
    # The search for disabled pairs reads the primitives from their file.
    with scratch_folder() as folder:
        shapes = folder / "primitives.csv"
        write_primitives(shapes, ())
        robot = RobotFile(
            name=name or path.stem,
            title=f"{path.stem}, tool {tool}",
            urdf=address,
            surfaces=surfaces,
            ignored_links=options.ignore,
            packages=options.packages,
            root_body=model.root,
            arm_base=arm_base,
            arm_joints=tuple(joint.name for joint in arm),
            tool_frame=tool,
            torso_joint=torso.name if torso else None,
            limits="soft" if any(joint.soft != joint.hard for joint in arm) else "hard",
            posture="drafted" if posture else None,
            postures={"drafted": posture} if posture else {},
            gripper="drafted" if gripper else None,
            grippers={"drafted": gripper} if gripper else {},
            primitives=str(shapes),
            source=_source(path, address),
        )
        robot = robot.model_copy(update={"standing_bodies": standing_bodies(robot)})
        check_robot(robot, where=f"robot drafted from '{path}'")
        robot, floor = on_floor(robot)
        steps = _Steps(on_progress)
        fits = fit_robot(robot, steps.bodies, coarse=options.coarse, jobs=options.jobs)
        primitives = tuple(shape for found in fits for shape in found.fit.primitives)
        write_primitives(shapes, primitives)
        pairs = propose_disabled_pairs(robot, jobs=options.jobs)
        robot = robot.model_copy(update={"disabled_groups": pairs})
        steps.test_done()
        rest = free_posture(robot)
        robot = robot.model_copy(update={"rest": rest or {}})
        robot, axes = with_goal_axes(robot)
        place, doubtful = tool_place(robot), doubts(robot)
        carried = carried_surfaces(robot)
        found = _blocked(robot, carried, steps)
        if not options.coarse and max(by.fraction for by in found) > _ALLOWED:
            splits = _to_tighten(model, primitives, found)
            primitives = tightened(robot, primitives, splits, jobs=options.jobs)
            write_primitives(shapes, primitives)
            steps.repeat(len(found))
            # Others than those that chose the bodies.
            found = _blocked(robot, carried, steps, seed=1)
        blocked, at_boxes = found
    worst = max(fits, key=lambda found: found.fit.excess)
    remarks = [
        *(f"doubtful: {line}" for line in doubtful),
        *_joint_remarks(model, robot, arm, tool),
        f"tool: {axes}{'' if place is None else f'; {place.text}'}",
        *(
            []
            if rest is not None
            else [f"rest: all of {DRAWS} postures of the arm are in self-collision"]
        ),
        f"primitives: {len(primitives)}; those of '{worst.body}' exceed its hull most, "
        f"{worst.fit.excess:.2f} times",
        f"self-collision: {blocked.text()}",
        f"obstacles: {at_boxes.text()}",
        *_left_out(options),
        "posture: check that the gripper is open and a second arm out of the way",
        f"root: {floor}",
    ]
    return Draft(robot=robot, primitives=primitives, remarks=tuple(remarks))


def _blocked(
    robot: RobotFile, surfaces: SurfaceDistance, steps: _Steps, seed: int = 0
) -> tuple[Blocked, Blocked]:
    """Return what the shapes block by self-collision and at boxes although surfaces are free."""
    blocked = blocked_by_shapes(robot, seed=seed, surfaces=surfaces)
    steps.test_done()
    at_boxes = blocked_at_boxes(robot, seed=seed, surfaces=surfaces)
    steps.test_done()
    return blocked, at_boxes


def _to_tighten(
    model: Urdf, shapes: Iterable[Primitive], found: Iterable[Blocked]
) -> dict[str, int]:
    """Return how many shapes to split of the bodies with meshes that block most postures."""
    blocking = {body for by in found for pair in by.worst(_LEFT * _ALLOWED) for body in pair}
    return {
        shape.body: _SPLITS
        for shape in shapes
        if shape.body in blocking and any(g.mesh for g in model.links[shape.body])
    }


class _Steps:
    """Progress over bodies to fit and the tests that follow."""

    TESTS = 3

    def __init__(self, on_progress: Callable[[int, int], None] | None) -> None:
        self._report = on_progress
        self._done = self._total = 0

    def bodies(self, done: int, total: int) -> None:
        """Report bodies fitted."""
        self._done, self._total = done, total + self.TESTS
        self._tell()

    def test_done(self) -> None:
        """Report one more test."""
        self._done += 1
        self._tell()

    def repeat(self, tests: int) -> None:
        """Add tests that are done again."""
        self._total += tests

    def _tell(self) -> None:
        if self._report is not None:
            self._report(self._done, self._total)


def _kinds(arm: list[Joint]) -> str:
    """Return the type of an arm's joints as a word before their name, empty if they differ."""
    return "" if any(joint.type == "prismatic" for joint in arm) else "revolute "


def _joint_remarks(model: Urdf, robot: RobotFile, arm: list[Joint], tool: str) -> list[str]:
    """Return which joints are the arm and the torso, and at which values all others are left."""
    positions = robot.joint_positions()
    led = {j.name for j in model.joints.values() if j.mimic is not None}
    by_value: dict[str, list[str]] = {}
    for name, value in positions.items():
        if name in model.joints and name not in led:
            by_value.setdefault(f"{value:g}", []).append(name)
    left = "; ".join(f"at {value}: {', '.join(names)}" for value, names in by_value.items())
    locked = [f"{j.name} at {j.locked:g}" for j in model.joints.values() if j.locked is not None]
    torso = robot.torso_joint
    return [
        f"arm: the {len(arm)} {_kinds(arm)}joints nearest '{tool}', from '{robot.arm_base}' on: "
        f"{', '.join(joint.name for joint in arm)}",
        f"torso: {f'{torso!r}' if torso else 'no vertical prismatic joint below the arm'}",
        f"left as they are [rad or m]: {left or 'no other joint'}",
        *([f"fixed, because their limits are one value: {', '.join(locked)}"] if locked else []),
    ]


def _left_out(options: DraftOptions) -> list[str]:
    """Return remarks on surfaces that the primitives need not enclose."""
    remarks = []
    if options.collision_meshes:
        remarks.append(
            "surfaces: the collision meshes; parts of the visual meshes may protrude unchecked"
        )
    if options.ignore:
        remarks.append(f"ignored: nothing is checked against {', '.join(options.ignore)}")
    return remarks


def _arm(model: Urdf, tool: str, base: str | None) -> tuple[list[Joint], str, Joint | None]:
    """Return the joints of the arm, the link that carries the first one, and the torso joint."""
    where = f"URDF '{model.path}'"
    for what, link in (("tool frame", tool), ("base", base)):
        if link is not None and link not in model.links:
            raise UnknownNameError("link", link, model.links, where=f"{where}, {what}")
    chain = model.chain(base or model.root, tool)
    if chain is None:
        raise RobotError(f"{where}: base '{base}' does not carry tool frame '{tool}'.")
    movable = [joint for joint in chain if joint.is_movable]
    arm = nearest_joints(movable, f"{where}: from '{base or model.root}' to tool frame '{tool}'")
    _check_slides(model, arm, where)
    exact = base is not None and movable == arm
    arm_base = str(base) if exact else arm[0].parent
    return arm, arm_base, _torso(model, arm[0].parent)


def _check_slides(model: Urdf, arm: list[Joint], where: str) -> None:
    """Refuse prismatic joints that follow each other along one direction, as in a telescope."""
    for before, joint in itertools.pairwise(arm):
        if before.type == joint.type == "prismatic":
            first, second = (_axis_in_root(model, j) for j in (before, joint))
            if abs(float(first @ second)) > _VERTICAL:
                raise RobotError(
                    f"{where}: '{before.name}' and '{joint.name}' slide along one direction, as "
                    "the segments of a telescope do, and count as one freedom. Couple them with "
                    "'mimic' in the URDF, and draft it again."
                )


def _axis_in_root(model: Urdf, joint: Joint) -> NDArray[np.float64]:
    R, _ = pose_in_root(model, joint.child, {})
    return np.asarray(R @ np.array(joint.axis) / np.linalg.norm(joint.axis))


def _torso(model: Urdf, arm_base: str) -> Joint | None:
    """Return the vertical prismatic joint of the greatest travel between root and arm, if any."""
    vertical = []
    for joint in model.chain(model.root, arm_base) or ():
        if joint.type != "prismatic" or joint.mimic is not None:
            continue
        if _axis_in_root(model, joint)[2] > _VERTICAL:
            vertical.append(joint)
    return max(vertical, key=lambda joint: joint.soft[1] - joint.soft[0], default=None)


def _positions(
    model: Urdf, arm: list[Joint], torso: Joint | None
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the positions of the other joints, and of those in the hand [rad or m]."""
    held = model.links_moved_by(arm[-1].name)
    posture: dict[str, float] = {}
    gripper: dict[str, float] = {}
    for joint in model.joints.values():
        scored = joint in arm or joint == torso
        if not joint.is_movable or joint.mimic is not None or scored:
            continue
        lower, upper = joint.soft
        of_hand = joint.child in held
        # Zero is where the model was drawn. Fingers are often closed there, at the end of a range.
        at_zero = lower < 0.0 < upper if of_hand else lower <= 0.0 <= upper
        value = 0.0 if at_zero else round((lower + upper) / 2, 6)
        (gripper if of_hand else posture)[joint.name] = value
    return posture, gripper


def _source(path: Path, address: str) -> str:
    """Return the source of the numbers, and what is known about their licence."""
    licence = "no package.xml in a folder above it: look up its licence before passing it on"
    for folder in path.parents:
        package = folder / "package.xml"
        if os.path.isfile(package):
            licence = f"its package is licensed {_licence(package)}; its meshes may not be"
            break
    shown = path.name if address == str(path) else address
    figures = f"Kinematics, limits and meshes: {shown}; {licence}. No mesh is copied."
    return f"{figures} Primitives: fitted to the meshes by `tcs robot new`."


def _licence(package: Path) -> str:
    try:
        found = read_xml(package, f"package '{package}'", RobotError).findtext("license")
    except RobotError:
        found = None
    return f"'{' '.join(found.split())}'" if found else "in terms its package.xml does not name"


def write_draft(draft: Draft, path: Path) -> Path:
    """Write a draft as a YAML file with its primitives in a CSV file beside it; both or neither.

    Args:
        draft: The draft.
        path: The YAML file; it must not exist yet.

    Returns:
        Path of the CSV file.

    Raises:
        OutputError: If one of the files exists or cannot be written.
    """
    shapes = check_free(path)
    content = draft.robot.model_dump(mode="json", exclude_defaults=True)
    content["primitives"] = shapes.name
    if not draft.robot.urdf.startswith("package://"):
        # Relative, so that the folder of both files can be moved.
        content["urdf"] = Path(
            os.path.relpath(draft.robot.urdf, os.path.dirname(os.path.realpath(path)))
        ).as_posix()
    if draft.robot.packages:
        content["packages"] = [
            Path(os.path.relpath(folder, os.path.dirname(os.path.realpath(path)))).as_posix()
            for folder in draft.robot.packages
        ]
    text = _HEADER.format(remarks="\n".join(f"# - {remark}" for remark in draft.remarks))
    text += yaml.safe_dump(
        content, sort_keys=False, width=95, default_flow_style=None, allow_unicode=True
    )
    write_primitives(shapes, draft.primitives)
    try:
        with whole_file(path, "Robot file") as stream:
            stream.write(text.encode())
    except BaseException:
        shapes.unlink()
        raise
    return shapes


def draft_to_files(
    urdf: str | Path,
    tool: str,
    path: Path,
    options: DraftOptions = USUAL,
    *,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Draft a robot file, write it with its primitives, and return a summary as plain containers.

    Args:
        urdf: Path of the URDF, or its `package://` address.
        tool: T, the link that moves to the goals.
        path: The YAML file; it must not exist yet. Its stem is the name of the robot.
        options: Arm, and closeness of the primitives.
        on_progress: Called with the number of steps done and of all.

    Raises:
        OutputError: If one of the files exists or cannot be written.
        UnknownNameError: As `draft_robot`.
        RobotError: As `draft_robot`.
    """
    check_writable(check_free(path))
    draft = draft_robot(urdf, tool, options, name=path.stem, on_progress=on_progress)
    shapes = write_draft(draft, path)
    robot = draft.robot
    return {
        "file": str(path),
        "primitives": str(shapes),
        "arm_base": robot.arm_base,
        "arm_joints": list(robot.arm_joints),
        "torso_joint": robot.torso_joint,
        "tool_frame": robot.tool_frame,
        "disabled_pairs": len(robot.disabled_pairs),
        "remarks": list(draft.remarks),
    }


def check_free(path: Path) -> Path:
    """Return the path of the CSV file for a YAML file, if neither of them exists.

    Raises:
        OutputError: If one exists, or the name of the YAML file does not end in `.yaml`.
    """
    if path.suffix != ".yaml":
        raise OutputError(
            f"robot file '{path}': its name must end in .yaml, which distinguishes a path from the "
            "name of a robot."
        )
    shapes = path.with_name(f"{path.stem}_primitives.csv")
    for file in (path, shapes):
        if os.path.lexists(file):
            raise OutputError(f"'{file}' already exists. Remove it, or name another file.")
    return shapes


def on_floor(robot: RobotFile) -> tuple[RobotFile, str]:
    """Return a robot whose root is on the floor, and what was chosen.

    A root above the lowest surface, such as the pelvis of a humanoid, gets a mount. The arm does
    not count: bolted down, it may reach below its base.
    """
    model, positions = robot.model(), robot.with_mimics(robot.joint_positions())
    arm, lows = model.links_moved_by(robot.arm_joints[0]), [(0.0, model.root)]
    for body, triangles in body_triangles(model).items():
        if body in arm:
            continue
        R, p = pose_in_root(model, body, positions)
        lows.append((float((triangles @ R[2] + p[2]).min()), body))
    lowest, lowest_body = min(lows[1:] or lows)
    if lowest >= -_ON_FLOOR:
        above = f"; its lowest surface, of '{lowest_body}', is {lowest:g} m above it"
        return robot, (
            f"'{model.root}' must be on the floor, z up, x forward"
            f"{above if lowest > _ABOVE else ''}"
        )
    link = "floor_link"
    while link in model.links:
        link += "_"
    height = math.ceil(-lowest * 1e3) / 1e3
    mount = Mount(link=link, xyz=(0.0, 0.0, height))
    change = {"mount": mount, "root_body": link}
    mounted = robot.model_copy(update=change)
    return (
        mounted.model_copy(update={"standing_bodies": standing_bodies(mounted)}),
        f"'{model.root}' is {height:g} m above the lowest surface, that of '{lowest_body}'"
        f"{_moved_there(model, positions, lowest_body)}: '{link}' on the floor carries it; z must "
        "be up, x forward",
    )


def _moved_there(model: Urdf, positions: Mapping[str, float], body: str) -> str:
    """Return which joints carry a body, and at which values, empty if none does."""
    chain = [j.name for j in model.chain(model.root, body) or () if j.is_movable]
    at = [f"{name} at {positions[name]:.3g}" for name in chain if positions[name]]
    return f" with {', '.join(at)}" if at else f" with {', '.join(chain)} at 0" if chain else ""


def with_goal_axes(robot: RobotFile) -> tuple[RobotFile, str]:
    """Return a robot whose tool frame points along its hand, and what was chosen."""
    hand, tool = hand_axes(robot), robot.tool_frame
    if hand is None:
        return robot, f"the shapes of the hand do not show where it points; x of '{tool}' must"
    part = "the fingers point" if hand.fingers else "the last link points"
    if hand.is_forward_x:
        return robot, f"{part} along +x of '{tool}', as goals need"
    taken = {*robot.model().links}
    name = next(
        n for n in (f"{tool}_goal{i or ''}" for i in range(len(taken) + 1)) if n not in taken
    )
    frame = ExtraFrame(name=name, parent=tool, rpy_deg=hand.goal_axes())
    opening = "" if hand.opening is None else " and y in the direction in which they open"
    return (
        robot.model_copy(update={"frames": (frame,), "tool_frame": name}),
        f"{part} along {hand.forward_axis} of '{tool}', and goals need +x: frame '{name}' was "
        f"added with x forward{opening}",
    )


def standing_bodies(robot: RobotFile) -> tuple[str, ...]:
    """Return the bodies that reach down to the floor and that neither arm nor torso moves."""
    model = robot.model()
    first = [robot.arm_joints[0], *([robot.torso_joint] if robot.torso_joint else [])]
    moved = frozenset[str]().union(*map(model.links_moved_by, first))
    positions = robot.with_mimics(robot.joint_positions())
    found = []
    for body, triangles in body_triangles(model).items():
        R, p = pose_in_root(model, body, positions)
        if body not in moved and (triangles @ R.T + p)[..., 2].min() <= _ON_FLOOR:
            found.append(body)
    return tuple(found)
