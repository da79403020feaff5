"""Small random scenes around one arm, with every type of shape and contact of the kernel."""

from __future__ import annotations

import itertools

import numpy as np

from tcs.kernel.analytic.solver import outside_solver
from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, GridArrays, SceneArrays, Shapes
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import joined
from tcs.kernel.sweep import gripper_contacts, score
from tests.kernel.shapes import as_shapes, placed, random_joints, rotation
from tests.reference.kinematics import compose, inverse, link_poses, rot_z

QUARTERS = np.array([0.0, 0.5, 1.0, 1.5]) * np.pi


def along(vector):
    """Return a rotation whose z axis points along `vector`."""
    z = vector / np.linalg.norm(vector)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def arm_shapes(chain):
    """Return a sphere at the shoulder, capsules along the links, and a palm with a finger."""
    upper, fore, tool = chain.p[3], chain.p[4], chain.p[7]
    parts = [
        (2, placed(SPHERE, [0.05, 0, 0], body=2)),
        (3, placed(CAPSULE, [0.04, np.linalg.norm(upper) / 4, 0], along(upper), upper / 2, body=3)),
        (4, placed(CAPSULE, [0.035, np.linalg.norm(fore) / 4, 0], along(fore), fore / 2, body=4)),
        (4, placed(BOX, [0.05, 0.04, 0.03], np.eye(3), fore / 3, body=4)),
        (7, placed(BOX, [0.04, 0.03, 0.04], along(tool), tool * 0.5, body=5)),
        (7, placed(CAPSULE, [0.01, 0.02, 0], along(tool), tool * 0.9, body=6)),
    ]
    shapes = as_shapes([shape for _, shape in parts])
    return shapes._replace(frame=np.array([frame for frame, _ in parts], np.int8))


def body_shapes():
    """Return a fixed base, and a trunk and a head mounted on a torso of two levels."""
    parts = [
        (0, placed(BOX, [0.25, 0.25, 0.15], p=[0, 0, 0.2], body=0)),
        (1, placed(BOX, [0.1, 0.12, 0.3], p=[-0.25, 0, 0.7], body=1)),
        (1, placed(SPHERE, [0.1, 0, 0], p=[-0.2, 0, 1.2], body=7)),
    ]
    shapes = as_shapes([shape for _, shape in parts])
    frame = np.array([frame for frame, _ in parts], np.int8)
    raised = shapes.p + np.where(frame == 1, 0.3, 0.0)[:, None] * [0, 0, 1.0]
    return shapes._replace(
        frame=frame, R=np.repeat(shapes.R, 2, axis=0), p=np.concatenate([shapes.p, raised])
    )


def environment_shapes(rng, number, states):
    """Return boxes, capsules and spheres, some padded, elsewhere in every state; and a floor."""
    parts = [placed(BOX, [3.0, 3.0, 0.05], p=[0, 0, -0.05])]
    for i in range(number):
        shape_type = (BOX, CAPSULE, SPHERE)[i % 3]
        size = rng.uniform(0.03, 0.25, 3) if shape_type == BOX else rng.uniform(0.03, 0.12, 3)
        p = rng.uniform([-1, -1, 0.1], [1, 1, 1.5])
        parts.append(
            placed(shape_type, size, rotation(rng), p, pad=0.02 * (i % 2), body=1 + i // 2)
        )
    shapes = as_shapes(parts)
    moved = [
        shapes.p[0] + (s > 0) * rng.normal(scale=0.1, size=shapes.p[0].shape) for s in range(states)
    ]
    return shapes._replace(R=np.repeat(shapes.R, states, axis=0), p=np.array(moved))


def toy_grid(*, states=2):
    """Return a grid of 3 x 3 base positions, four headings and two torso levels."""
    return GridArrays(
        environment_states=states,
        base_x=np.array([-0.4, 0.0, 0.45]),
        base_y=np.array([-0.35, 0.05, 0.5]),
        base_yaw=QUARTERS,
        torso_levels=2,
    )


def toy_scene(chain, seed, *, obstacles=6, goals=5, states=2):
    """Return a random scene with goals that some base pose of `toy_grid` may reach."""
    rng = np.random.default_rng(seed)
    arm, body, environment = (
        arm_shapes(chain),
        body_shapes(),
        environment_shapes(rng, obstacles, states),
    )
    arm_base_p = np.array([[0.0, 0.1, 0.7], [0.0, 0.1, 1.0]])
    arm_base_R = np.stack([rot_z(0.2), rot_z(0.2)])
    grid = toy_grid(states=states)
    targets = []
    for _ in range(goals):
        X_WB = rot_z(rng.choice(QUARTERS)), np.array([*rng.choice(grid.base_x, 2), 0.0])
        X_BA = arm_base_R[0], arm_base_p[rng.integers(2)]
        X_AT = link_poses(chain, random_joints(rng, chain))[-1]
        targets.append(compose(X_WB, compose(X_BA, X_AT)))
    apart = np.abs(arm.frame[:, None].astype(int) - arm.frame[None]) > 1
    floor = np.zeros(len(environment.type), bool)
    floor[0] = True
    return SceneArrays(
        chain=chain,
        arm_base_R=arm_base_R,
        arm_base_p=arm_base_p,
        arm=arm,
        body=body,
        environment=environment,
        arm_vs_arm=apart,
        # The upper arm starts inside the trunk.
        arm_vs_body=np.repeat(arm.frame[:, None] > 3, len(body.type), axis=1),
        arm_vs_environment=np.ones((len(arm.type), len(environment.type)), bool),
        body_vs_environment=np.repeat(~floor[None], len(body.type), axis=0),
        margin=0.001,
        self_margin=0.001,
        goal_R=np.repeat(np.array([R for R, _ in targets])[None], states, axis=0),
        goal_p=np.array([[p + 0.05 * s for _, p in targets] for s in range(states)]),
    )


def with_obstacle(scene, shape):
    """Return the scene with one more shape in the environment, checked against everything."""
    states = len(scene.environment.p)
    extra = as_shapes([shape])

    def more(mask):
        return np.concatenate([mask, np.ones((len(mask), 1), bool)], axis=1)

    environment = Shapes(
        *(np.concatenate(both) for both in zip(scene.environment[:5], extra[:5], strict=True)),
        R=np.concatenate([scene.environment.R, np.repeat(extra.R, states, axis=0)], axis=1),
        p=np.concatenate([scene.environment.p, np.repeat(extra.p, states, axis=0)], axis=1),
    )
    return scene._replace(
        environment=environment,
        arm_vs_environment=more(scene.arm_vs_environment),
        body_vs_environment=more(scene.body_vs_environment),
    )


def crowded(scene, rng, number):
    """Return a scene with so many small shapes in place of each shape of the robot, around it."""

    def many(shapes):
        rows = np.repeat(np.arange(len(shapes.type)), number)
        types = rng.choice((SPHERE, CAPSULE, BOX), size=len(rows)).astype(np.int8)
        out = rng.uniform(-1, 1, (len(rows), 3)) * np.array([0.12, 0.12, 0.2])
        shapes = Shapes(
            *(column[rows] for column in shapes[:5]), shapes.R[:, rows], shapes.p[:, rows]
        )
        return shapes._replace(
            type=types,
            size=rng.uniform(0.003, 0.03, (len(rows), 3)) * np.array([1.0, 2.0, 3.0]),
            R=np.repeat([[rotation(rng) for _ in rows]], len(shapes.R), axis=0),
            p=shapes.p + out,
        ), rows

    (arm, of_arm), (body, of_body) = many(scene.arm), many(scene.body)
    return scene._replace(
        arm=arm,
        body=body,
        arm_vs_arm=scene.arm_vs_arm[of_arm][:, of_arm],
        arm_vs_body=scene.arm_vs_body[of_arm][:, of_body],
        arm_vs_environment=scene.arm_vs_environment[of_arm],
        body_vs_environment=scene.body_vs_environment[of_body],
    )


def size_of(grid):
    """Return the number of configurations."""
    return grid.size


def scores_of(scene, grid, cuts=None, measure="isotropy", numeric=False):
    """Return the kernel's scores of the whole grid, in one slice or cut at `cuts`.

    Args:
        scene: The scene.
        grid: Its grid.
        cuts: Where to cut.
        measure: Name of the dexterity measure.
        numeric: Whether to solve the arm as if it had no closed form.
    """
    problem = build_problem(scene, measure)
    if numeric:
        problem = problem._replace(arm=outside_solver(scene.chain))
    grippers = gripper_contacts(problem)
    cuts = [0, *(cuts or []), size_of(grid)]
    return joined(
        score(problem, grid_rows(grid, start, stop), grippers)
        for start, stop in itertools.pairwise(cuts)
    )


def goal_in_base(scene, grid, h, goal):
    """Return X_AG at configuration h."""
    s, x, y, yaw, torso = np.unravel_index(h, grid.shape)
    X_WB = rot_z(grid.base_yaw[yaw]), np.array([grid.base_x[x], grid.base_y[y], 0.0])
    X_WA = compose(X_WB, (scene.arm_base_R[torso], scene.arm_base_p[torso]))
    return compose(inverse(X_WA), (scene.goal_R[s, goal], scene.goal_p[s, goal]))
