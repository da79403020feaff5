"""Paths between joint angles of the Panda: time, success and length, beside OMPL's and roboplan's.

Usage: python benchmarks/planning.py [--limit 100] [--compared 4] [--seeds 50] [--seed 0]

The problems are MotionBenchMaker's (`planning_problems`), with the fingers as wide open as there.
A cylinder becomes the prism of twelve sides around it, of six boxes. A problem is refused where
start or goal is beyond a joint limit, or in contact with itself or an obstacle; the pairs that do
so are counted. Between arm and obstacles CLEARANCE is kept in place of the margin of scoring: there
is no person, and the peers keep none. Times are those of the processor, one core, without preparing
the scene and the memory of the planner, which is used again from query to query. What the peers
plan with is said in `planning_peers`.
"""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from planning_peers import Roboplan, length, ompl_path
from planning_problems import Obstacle, Problem, planning_problems, robot_of_problems
from scipy.spatial.transform import Rotation
from table import cell, header, parser, row, save

from tcs.kernel.arrays import BOX, SceneArrays, Shapes
from tcs.kernel.motion.box_trees import grouped
from tcs.kernel.motion.connect import connect
from tcs.kernel.motion.edges import NO_PAIR, posture_contact
from tcs.kernel.motion.never_in_contact import needed_pairs
from tcs.kernel.motion.scene import (
    MotionScene,
    MotionWorkspace,
    motion_scene,
    new_motion_workspace,
    with_pairs,
)
from tcs.kernel.motion.search_trees import Trees, new_trees, random_state
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import single_row
from tcs.model.scene import LoweredScene
from tcs.motion.paths import SHORTCUTS
from tcs.placement.scoring import load_job

FloatArray = NDArray[np.float64]
SIDES = 12
"""Sides of the prism around a cylinder, an even number."""
CLEARANCE = 1e-4
"""Distance that the arm keeps from obstacles [m]; the kernel compares with positive ones."""
AGAIN = 10.0
"""Time after which a problem counts as unsolvable [s]."""
MOST_ITERATIONS = 100_000
"""Number of random postures to grow towards: scenes without a task may be narrower than those of
`tcs plan`."""


def main() -> None:
    """Plan every problem, and some of them with the peers too."""
    command_line = parser(__doc__)
    command_line.add_argument("--limit", type=int, default=100, help="problems of each scene")
    command_line.add_argument(
        "--compared", type=int, default=4, help="problems of each scene for peers and all seeds"
    )
    command_line.add_argument("--seeds", type=int, default=50, help="seeds of the best length")
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header("ompl", "roboplan")
    row("seed", str(options.seed))
    bench, roboplan = Bench(), Roboplan()
    refusals, tallies = Counter[str](), defaultdict[str, list[Found]](list)
    total = Counter[str]()
    for problem in planning_problems():
        if total[problem.scene] == options.limit:
            continue
        total[problem.scene] += 1
        query = bench.query(problem)
        reason = query.refusal(bench)
        if reason:
            refusals[reason] += 1
            continue
        if not tallies:
            # The first query loads or compiles the planner.
            query.planned(options.seed)
        compared = len(tallies[problem.scene]) < options.compared
        tallies[problem.scene].append(
            query.found(
                options.seed, options.seeds if compared else 0, roboplan if compared else None
            )
        )
    tallies["all"] = [found for scene in list(tallies) for found in tallies[scene]]
    total["all"] = total.total()
    for scene, found in tallies.items():
        report(scene, total[scene], found)
    for reason, count in refusals.most_common():
        cell("refused", reason, "problems", str(count))
        row(f"refused: {reason}", str(count))
    save(options)


@dataclass(frozen=True)
class Found:
    """Results of one problem."""

    milliseconds: float
    length: float
    """Length of the path [rad], nan if none was found."""
    solved_again: bool
    """Whether other random numbers found a path where the first did not."""
    best: float
    """Least length of all seeds [rad], nan if they were not tried."""
    ompl: tuple[float, float]
    roboplan: tuple[float, float]
    """Time [ms] and length [rad] of the peers, nan where they were not tried, inf where they found
    nothing."""


class Bench:
    """The Panda without an environment."""

    def __init__(self) -> None:
        """Lower the robot in a scene of one configuration."""
        job = load_job("feeding", "wheelchair", robot_of_problems(), paper=True)
        self.robot = job.spec.robot
        self.lowered: LoweredScene = job.lowered(job.scene())
        self.trees: Trees = new_trees(0)
        """Memory of the planner, of all queries."""
        self.needed: NDArray[np.bool_] | None = None
        """Which pairs of the robot's own shapes may touch, known from the first problem on."""

    def query(self, problem: Problem) -> Query:
        """Return a problem, prepared for planning."""
        arrays = self._arrays(problem.obstacles)
        scene = motion_scene(build_problem(arrays), single_row())
        own = scene.shapes.body[scene.pairs.members[:, 1]] >= len(problem.obstacles)
        needed = np.ones(len(scene.pairs.members), np.bool_)
        if self.needed is None:
            self.needed = needed_pairs(scene, own)[own]
        needed[own] = self.needed
        return Query(problem, grouped(with_pairs(scene, needed)), self.trees)

    def _arrays(self, obstacles: tuple[Obstacle, ...]) -> SceneArrays:
        arrays = self.lowered.arrays
        R_BA, p_BA = arrays.arm_base_R[0], arrays.arm_base_p[0]
        boxes = [box for number, one in enumerate(obstacles) for box in _boxes(one, number)]
        number = len(boxes)
        R = np.array([R_BA @ R_SO for _, R_SO, _, _ in boxes])
        p = np.array([R_BA @ p_SO + p_BA for _, _, p_SO, _ in boxes])
        environment = Shapes(
            type=np.full(number, BOX, np.int8),
            size=np.array([size for size, _, _, _ in boxes]),
            pad=np.zeros(number),
            body=np.array([body for _, _, _, body in boxes], np.int16),
            frame=np.zeros(number, np.int8),
            R=R[None],
            p=p[None],
        )
        return arrays._replace(
            margin=CLEARANCE,
            environment=environment,
            arm_vs_environment=np.ones((len(arrays.arm.type), number), np.bool_),
            body_vs_environment=np.zeros((len(arrays.body.type), number), np.bool_),
            goal_R=arrays.goal_R[:1],
            goal_p=arrays.goal_p[:1],
        )


def _boxes(
    obstacle: Obstacle, number: int
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray, int]]:
    """Yield the boxes of an obstacle."""
    if obstacle.kind == "box":
        yield np.array(obstacle.size) / 2.0, obstacle.R_SO, obstacle.p_SoOo_S, number
        return
    length, radius = obstacle.size
    half = np.array([radius, radius * np.tan(np.pi / SIDES), length / 2.0])
    for side in range(SIDES // 2):
        turned = Rotation.from_euler("z", 2.0 * np.pi * side / SIDES).as_matrix()
        yield half, obstacle.R_SO @ turned, obstacle.p_SoOo_S, number


class Query:
    """One problem, prepared."""

    def __init__(self, problem: Problem, scene: MotionScene, trees: Trees) -> None:
        """Take the memory of the planner, and memory for the scene."""
        self.problem, self.scene, self.trees = problem, scene, trees
        self.work: MotionWorkspace = new_motion_workspace(scene)

    def refusal(self, bench: Bench) -> str:
        """Return what excludes start or goal, "" if nothing does."""
        scene = self.scene
        for end in (self.problem.start, self.problem.goal):
            if np.any(end < scene.limits.lower) or np.any(end > scene.limits.upper):
                beyond = np.flatnonzero((end < scene.limits.lower) | (end > scene.limits.upper))
                return f"range of {bench.robot.arm_joints[beyond[0]]}"
            pair = posture_contact(scene, self.work, end)
            if pair != NO_PAIR:
                return " / ".join(self._body(bench, int(i)) for i in scene.pairs.members[pair, :2])
        return ""

    def _body(self, bench: Bench, shape: int) -> str:
        """Return the name of the body of a shape."""
        number, obstacles = int(self.scene.shapes.body[shape]), self._environment_bodies
        return "obstacle" if number < obstacles else bench.lowered.robot_bodies[number - obstacles]

    @property
    def _environment_bodies(self) -> int:
        return len(self.problem.obstacles)

    def found(self, seed: int, seeds: int, roboplan: Roboplan | None) -> Found:
        """Return the results of one seed and the best of several.

        With roboplan's scene, also those of the peers.
        """
        begun = time.process_time()
        radians = self.planned(seed)
        milliseconds = 1e3 * (time.process_time() - begun)
        again, begun = not np.isfinite(radians), time.process_time()
        solved, other = False, seed
        while again and not solved and time.process_time() - begun < AGAIN:
            other += 1
            solved = bool(np.isfinite(self.planned(other)))
        best = min((self.planned(one) for one in range(seed, seed + seeds)), default=np.nan)
        peers = [(np.nan, np.nan)] * 2
        if roboplan:
            limits = self.scene.limits.lower, self.scene.limits.upper
            peers = [
                ompl_path(self.problem, limits, self.is_free, seed),
                roboplan.path(self.problem, seed),
            ]
        return Found(milliseconds, radians, solved, best, *peers)

    def is_free(self, q: FloatArray) -> bool:
        """Return whether a posture touches nothing."""
        return bool(posture_contact(self.scene, self.work, q) == NO_PAIR)

    def planned(self, seed: int) -> float:
        """Return the length of a path [rad], inf if none was found."""
        trees = self.trees
        trees.random[:] = random_state(seed)
        ends = self.problem.start[None], self.problem.goal[None]
        count = connect(self.scene, self.work, trees, *ends, MOST_ITERATIONS, SHORTCUTS)
        return length(trees.path[:count]) if count else np.inf


def report(scene: str, problems: int, found: list[Found]) -> None:
    """Print and record the results of one scene."""
    solved = [one for one in found if np.isfinite(one.length)]
    solvable = len(solved) + sum(one.solved_again for one in found)
    times = np.quantile([one.milliseconds for one in found], [0.5, 0.95, 1.0])
    cells = {
        "not refused": f"{len(found)} of {problems}",
        "solved, of those solvable": f"{len(solved)} of {solvable}",
        "median [ms]": f"{times[0]:.2f}",
        "p95 [ms]": f"{times[1]:.0f}",
        "slowest [ms]": f"{times[2]:.0f}",
        "median length [rad]": f"{np.median([one.length for one in solved]):.2f}",
    }
    compared = [one for one in solved if np.isfinite(one.best)]
    for column, text in cells.items():
        cell("problems", scene, column, text)
    row(scene, ", ".join(f"{column} {text}" for column, text in cells.items()))
    if not compared:
        return
    ratio = np.median([one.length / one.best for one in compared])
    peers = {
        "problems": str(len(compared)),
        "length / best of the seeds": f"{ratio:.2f}",
        "median [ms]": f"{np.median([one.milliseconds for one in compared]):.0f}",
    }
    for name in ("ompl", "roboplan"):
        peers |= beside(name, [(one.length, *getattr(one, name)) for one in compared])
    for column, text in peers.items():
        cell("compared", scene, column, text)
    row(f"{scene}, compared", ", ".join(f"{column} {text}" for column, text in peers.items()))


def beside(name: str, results: list[tuple[float, float, float]]) -> dict[str, str]:
    """Return the cells of a peer.

    Args:
        name: Its name.
        results: Our length [rad], its time [ms] and length [rad], of each problem.
    """
    solved = [one for one in results if np.isfinite(one[2])]
    if not solved:
        return {f"{name}: solved": "0", f"{name}: median [ms]": "-", f"length / {name}'s": "-"}
    return {
        f"{name}: solved": str(len(solved)),
        f"{name}: median [ms]": f"{np.median([one[1] for one in solved]):.0f}",
        f"length / {name}'s": f"{np.median([one[0] / one[2] for one in solved]):.2f}",
    }


if __name__ == "__main__":
    main()
