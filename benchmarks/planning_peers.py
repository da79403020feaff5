"""The planners beside ours: OMPL on our kernel's posture check, roboplan on its own.

Both run RRT-Connect and then their own shortcutting, and check postures at most STEP apart: neither
proves what lies between. OMPL calls the posture check of our kernel, so it uses the same shapes.
roboplan reads the URDF, the disabled pairs and the collision meshes (convex hulls) of the package
`example-robot-data`, with the fingers fixed as wide open as in the problems.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from planning_problems import FINGERS, Problem

from tcs.model.robots.urdf.packages import resolve_uri

FloatArray = NDArray[np.float64]
SECONDS = 30.0
"""Time that each planner is given [s]."""
STEP = 0.02
"""Greatest distance of the postures that they check [rad]."""
NOTHING = np.inf, np.inf
"""Time and length where no path was found."""


def length(path: FloatArray) -> float:
    """Return the length of a path of postures [rad, norm of the joints]."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def ompl_path(
    problem: Problem,
    limits: tuple[FloatArray, FloatArray],
    is_free: Callable[[FloatArray], bool],
    seed: int,
) -> tuple[float, float]:
    """Return time [ms] and length [rad] of OMPL's path.

    Args:
        problem: Start and goal.
        limits: Least and greatest joint angles [rad], shape (7,) each.
        is_free: Whether a posture, shape (7,), touches nothing.
        seed: Seed of its random numbers.
    """
    import ompl.base
    import ompl.geometric
    import ompl.util

    ompl.util.noOutputHandler()
    ompl.util.RNG.setSeed(seed + 1)
    space = ompl.base.RealVectorStateSpace(7)
    bounds = ompl.base.RealVectorBounds(7)
    for k, (least, greatest) in enumerate(zip(*limits, strict=True)):
        bounds.setLow(k, float(least))
        bounds.setHigh(k, float(greatest))
    space.setBounds(bounds)
    setup = ompl.geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: is_free(np.array([state[k] for k in range(7)])))
    information = setup.getSpaceInformation()
    information.setStateValidityCheckingResolution(STEP / space.getMaximumExtent())
    setup.setPlanner(ompl.geometric.RRTConnect(information))
    start, goal = space.allocState(), space.allocState()
    for k in range(7):
        start[k], goal[k] = float(problem.start[k]), float(problem.goal[k])
    setup.setStartAndGoalStates(start, goal)
    begun = time.process_time()
    if not setup.solve(SECONDS) or not setup.haveExactSolutionPath():
        return NOTHING
    setup.simplifySolution(SECONDS)
    milliseconds = 1e3 * (time.process_time() - begun)
    path = setup.getSolutionPath()
    states = [path.getState(n) for n in range(path.getStateCount())]
    return milliseconds, length(np.array([[state[k] for k in range(7)] for state in states]))


class Roboplan:
    """roboplan's scene of the Panda."""

    GROUP, BASE = "arm", "panda_link0"
    FOLDER = "example-robot-data/robots/panda_description"

    def __init__(self) -> None:
        """Load URDF, disabled pairs and collision meshes."""
        import roboplan.core

        urdf = resolve_uri(f"package://{self.FOLDER}/urdf/panda.urdf", Path())
        folder = urdf.parents[1]
        description = roboplan.core.loadUrdfSceneDescriptionFromXml(
            _urdf_with_fixed_fingers(urdf), [str(folder.parents[2])]
        )
        self.scene = roboplan.core.Scene("panda", description)
        disabled = ElementTree.parse(folder / "srdf" / "panda.srdf").iter("disable_collisions")
        self.scene.setCollisions([(one.get("link1"), one.get("link2")) for one in disabled], False)
        self.scene.allowAdjacentLinkCollisions()
        self.scene.addGroupFromChain(self.GROUP, self.BASE, "panda_link8")

    def path(self, problem: Problem, seed: int) -> tuple[float, float]:
        """Return time [ms] and length [rad] of roboplan's path; it may refuse start or goal."""
        import roboplan.core
        import roboplan.rrt

        options = roboplan.rrt.RRTOptions(
            group_name=self.GROUP,
            max_nodes=1_000_000,
            rrt_connect=True,
            collision_check_step_size=STEP,
            max_planning_time=SECONDS,
        )
        shortcuts = roboplan.core.PathShortcuttingOptions(
            group_name=self.GROUP, max_step_size=STEP, seed=seed
        )
        start, goal = roboplan.core.JointConfiguration(), roboplan.core.JointConfiguration()
        start.positions, goal.positions = problem.start, problem.goal
        with self._obstacles(problem):
            planner = roboplan.rrt.RRT(self.scene, options)
            planner.setRngSeed(seed)
            begun = time.process_time()
            try:
                found = planner.plan(start, goal)
            except RuntimeError:
                return NOTHING
            short = roboplan.core.PathShortcutter(self.scene, shortcuts).shortcut(found)
            milliseconds = 1e3 * (time.process_time() - begun)
        return milliseconds, length(np.array(short.positions))

    @contextmanager
    def _obstacles(self, problem: Problem) -> Iterator[None]:
        import roboplan.core

        names = [f"obstacle_{number}" for number in range(len(problem.obstacles))]
        for name, one in zip(names, problem.obstacles, strict=True):
            pose = np.eye(4, order="F")
            pose[:3, :3], pose[:3, 3] = one.R_SO, one.p_SoOo_S
            where = name, "universe"
            if one.kind == "box":
                box = roboplan.core.Box(*one.size)
                self.scene.addBoxGeometry(*where, box, pose, np.ones(4))
            else:
                cylinder = roboplan.core.Cylinder(one.size[1], one.size[0])
                self.scene.addCylinderGeometry(*where, cylinder, pose, np.ones(4))
        still = [*names, self.BASE]
        pairs = [(first, second) for n, first in enumerate(still) for second in still[:n]]
        self.scene.setCollisions(pairs, False)
        yield
        for name in names:
            self.scene.removeGeometry(name)


def _urdf_with_fixed_fingers(path: Path) -> str:
    """Return a URDF whose fingers are fixed, as far from the middle as in the problems."""
    urdf = ElementTree.parse(path).getroot()
    opening = max(FINGERS.values())
    for joint in urdf.iter("joint"):
        origin, axis = joint.find("origin"), joint.find("axis")
        if joint.get("type") == "prismatic" and origin is not None and axis is not None:
            position = np.array(origin.get("xyz", "").split(), float)
            direction = np.array(axis.get("xyz", "").split(), float)
            # The fingers' joints have the axes of the hand.
            origin.set("xyz", " ".join(map(str, position + opening * direction)))
            joint.set("type", "fixed")
    return ElementTree.tostring(urdf, encoding="unicode")
