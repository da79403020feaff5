"""MotionBenchMaker's planning problems for the Panda, read from the package that carries them.

The source distribution of `vamp-planner` (Apache-2.0) holds seven scenes of a hundred problems
each. It is downloaded from the package index when first asked for and kept in the cache folder;
nothing of it is part of this project. See Chamzas et al., "MotionBenchMaker: A Tool to Generate
and Benchmark Motion Planning Datasets", IEEE Robotics and Automation Letters 7(2), 2022.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial, reduce
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.files.paths import cache_folder
from tcs.model.robots import RobotFile, load_robot

FloatArray = NDArray[np.float64]

PACKAGE, VERSION = "vamp-planner", "0.6.4"
FINGERS = {"panda_finger_joint1": 0.065}
"""How far each finger is from the middle in the start states of all problems [m]: 25 mm beyond the
limit of the joint."""
_PROBLEMS = "resources/panda/problems.tar.bz2"
_URDF = "resources/panda/panda.urdf"
_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))


@dataclass(frozen=True)
class Obstacle:
    """A shape of a scene S, which is the frame of the robot's first link.

    `size` is the edges of a box, or length and radius of a cylinder along z [m].
    """

    name: str
    kind: str
    size: tuple[float, ...]
    R_SO: FloatArray
    p_SoOo_S: FloatArray


@dataclass(frozen=True)
class Problem:
    """One problem: obstacles, and the joint angles of start and goal, shape (7,) [rad]."""

    scene: str
    number: int
    obstacles: tuple[Obstacle, ...]
    start: FloatArray
    goal: FloatArray


def robot_of_problems() -> RobotFile:
    """Return the Panda with the fingers and the arm's joint limits of the problems.

    Their elbow, joint 4, opens to 5 deg beyond straight and closes to 180 deg; the manufacturer's
    limits, which our file has, are -4 and -176 deg.
    """
    panda = load_robot("panda")
    folder = cache_folder() / "benchmarks"
    urdf = folder / "panda_of_problems.urdf"
    theirs, ours = _file(_URDF).decode(), panda.urdf_path().read_text()
    folder.mkdir(parents=True, exist_ok=True)
    urdf.write_text(reduce(partial(_with_limits_of, theirs), _JOINTS, ours))
    fingers = {"gripper": "problems", "grippers": {"problems": FINGERS}}
    return panda.model_copy(update={"urdf": str(urdf), **fingers})


def _with_limits_of(other: str, urdf: str, joint: str) -> str:
    """Return a URDF with the limits that another one has for a joint."""
    limits = ElementTree.fromstring(other).find(f"joint[@name='{joint}']/limit")
    robot = ElementTree.fromstring(urdf)
    own = robot.find(f"joint[@name='{joint}']/limit")
    if limits is None or own is None:
        raise SystemExit(f"planning_problems: no limits of {joint}")
    own.attrib.update({end: limits.attrib[end] for end in ("lower", "upper")})
    return ElementTree.tostring(robot, encoding="unicode")


def planning_problems() -> list[Problem]:
    """Return the 700 problems, by scene and number."""
    files = dict(_yaml_files(_file(_PROBLEMS)))
    requests = sorted(name for name in files if "/request" in name)
    return [_problem(name, files) for name in requests]


def _file(name: str) -> bytes:
    """Return the content of a file of the source distribution."""
    with tarfile.open(_distribution()) as distribution:
        member = next((m for m in distribution if m.name.endswith(f"/{name}")), None)
        content = distribution.extractfile(member) if member else None
        if content is None:
            raise SystemExit(f"planning_problems: {name} is not a file of {PACKAGE}")
        return content.read()


def _distribution() -> Path:
    """Return the path of the source distribution, downloaded if it is not in the cache yet."""
    folder = cache_folder() / "benchmarks"
    kept = folder / f"{PACKAGE.replace('-', '_')}-{VERSION}.tar.gz"
    if kept.exists():
        return kept
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as unfinished:
        command = (
            f"pip download -q --no-deps --no-build-isolation --no-binary :all: -d {unfinished}"
        )
        subprocess.run(
            [sys.executable, "-m", *command.split(), f"{PACKAGE}=={VERSION}"], check=True
        )
        Path(unfinished, kept.name).rename(kept)
    return kept


def _yaml_files(packed: bytes) -> Iterator[tuple[str, Mapping]]:
    """Yield name and content of the YAML files of an archive."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        for member in archive:
            content = archive.extractfile(member)
            if member.name.endswith(".yaml") and content is not None:
                yield member.name, yaml.load(content, loader)


def _problem(name: str, files: Mapping[str, Mapping]) -> Problem:
    request, scene = files[name], files[name.replace("/request", "/scene")]
    state = request["start_state"]["joint_state"]
    start = dict(zip(state["name"], state["position"], strict=True))
    goal = {
        one["joint_name"]: one["position"]
        for one in request["goal_constraints"][0]["joint_constraints"]
    }
    folder, file = name.split("/")[-2:]
    return Problem(
        folder.removesuffix("_panda"),
        int(file.removeprefix("request").removesuffix(".yaml")),
        tuple(_obstacle(found) for found in scene["world"]["collision_objects"]),
        np.array([start[joint] for joint in _JOINTS]),
        np.array([goal[joint] for joint in _JOINTS]),
    )


def _obstacle(found: Mapping) -> Obstacle:
    (shape,), (pose,) = found["primitives"], found["primitive_poses"]
    return Obstacle(
        found["id"],
        shape["type"],
        tuple(map(float, shape["dimensions"])),
        Rotation.from_quat(pose["orientation"]).as_matrix(),
        np.array(pose["position"], float),
    )
