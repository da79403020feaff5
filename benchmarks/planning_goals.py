"""Goal postures of a planning benchmark that the Panda's meshes allow and its shapes refuse.

Usage: python benchmarks/planning_goals.py [--limit 700]

The goals are the joint angles of MotionBenchMaker's problems for the Panda (`planning_problems`).
Those beyond a joint limit of the URDF are left out. A goal is free if the meshes of the arm keep
the self margin to one another and an environment's default margin to the obstacles of its scene,
measured by Coal. It is refused if a range of the robot file excludes it, or the collision shapes
touch; the pairs that do so are counted. The obstacles are boxes and cylinders as printed; the
fingers are as wide open as in the problems.
"""

from __future__ import annotations

from collections import Counter, defaultdict

import coal
import numpy as np
from planning_problems import Obstacle, Problem, planning_problems, robot_of_problems
from table import header, parser, record, row, save

from shapes import MARGIN, Bodies, Poses, _distance, _geometry, body_poses
from tcs_shapes.self_collision import SelfCollision


def main() -> None:
    """Count the goals of each scene that are free, and those that are refused."""
    command_line = parser(__doc__)
    command_line.add_argument("--limit", type=int, default=700, help="problems, from the first")
    options = command_line.parse_args()
    header("coal")
    problems = planning_problems()[: options.limit]
    goals = Goals(Bodies(robot_of_problems()), problems)
    free, refused, pairs = Counter[str](), Counter[str](), Counter[str]()
    for i, problem in enumerate(problems):
        if not goals.is_free(i):
            continue
        contacts = goals.contacts(i)
        free[problem.scene] += 1
        refused[problem.scene] += bool(contacts)
        pairs.update(contacts)
    rows = [[scene, str(count), str(refused[scene])] for scene, count in free.items()]
    rows.append(["all", str(free.total()), str(refused.total())])
    for scene, found, lost in rows:
        row(f"{scene}: goals refused", f"{lost} of {found}")
    for pair, count in pairs.most_common():
        row(f"refused by {pair}", str(count))
    record("refused", ["scene", "goals free on the meshes", "refused by the shapes"], rows)
    save(options)


class Goals:
    """The robot at the goals of problems, one pose of each body for each goal."""

    def __init__(self, bodies: Bodies, problems: list[Problem]) -> None:
        """Place the bodies; the scene's frame is the robot's first link."""
        self._bodies, self._problems = bodies, problems
        robot = bodies.robot
        rest = robot.with_mimics(robot.joint_positions())
        self._positions = {name: np.full(len(problems), q) for name, q in rest.items()}
        for j, name in enumerate(robot.arm_joints):
            self._positions[name] = np.array([problem.goal[j] for problem in problems])
        self._poses: Poses = body_poses(bodies.model, self._positions, len(problems))
        self._plant = SelfCollision(robot)
        exempt = {frozenset(pair) for pair in robot.disabled_pairs}
        self._pairs = [pair for pair in bodies.pairs() if frozenset(pair) not in exempt]
        self._shapes = defaultdict(list)
        for shape in bodies.shapes:
            self._shapes[shape.body].append((_geometry(shape), shape.rotation, shape.xyz))

    def is_free(self, i: int) -> bool:
        """Return whether the joint limits and the meshes allow goal i."""
        limits = self._bodies.robot.without_ranges.joint_limits()
        arm = self._bodies.robot.arm_joints
        if not all(limits[n][0] <= self._positions[n][i] <= limits[n][1] for n in arm):
            return False
        if not all(self._bodies.are_apart(pair, self._poses, i) for pair in self._pairs):
            return False
        return all(
            self._bodies.is_free_of(body, self._poses, i, *self._placed(obstacle, i))
            for obstacle in self._problems[i].obstacles
            for body in sorted(self._bodies.arm & self._bodies.meshes.keys())
        )

    def contacts(self, i: int) -> set[str]:
        """Return what refuses goal i: ranges and pairs of shapes."""
        robot, at = self._bodies.robot, {n: float(q[i]) for n, q in self._positions.items()}
        limits = robot.joint_limits()
        found = {
            f"range of {name}"
            for name in robot.arm_joints
            if not limits[name][0] <= at[name] <= limits[name][1]
        }
        touching = self._plant.touching(at)
        found |= {" / ".join(pair) for pair in self._pairs if tuple(sorted(pair)) in touching}
        for obstacle in self._problems[i].obstacles:
            shape, X_AO = self._placed(obstacle, i)
            for body, own in self._shapes.items():
                R, p = self._poses[body][0][i], self._poses[body][1][i]
                found |= {
                    f"{body} / {obstacle.kind}"
                    for geometry, turned, xyz in own
                    if _distance(
                        geometry, coal.Transform3s(R @ turned, R @ np.array(xyz) + p), shape, X_AO
                    )
                    < MARGIN
                }
        return found

    def _placed(
        self, obstacle: Obstacle, i: int
    ) -> tuple[coal.CollisionGeometry, coal.Transform3s]:
        """Return an obstacle's shape and its pose in the robot's root A."""
        R_AS, p_ASo = (part[i] for part in self._poses[self._bodies.robot.arm_base])
        pose = coal.Transform3s(R_AS @ obstacle.R_SO, R_AS @ obstacle.p_SoOo_S + p_ASo)
        if obstacle.kind == "box":
            return coal.Box(*obstacle.size), pose
        length, radius = obstacle.size
        return coal.Cylinder(radius, length), pose


if __name__ == "__main__":
    main()
