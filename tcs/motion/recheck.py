"""Re-check of curves with Drake, at most a millimetre of the fastest point's motion apart."""

from __future__ import annotations

import itertools

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.scene import FRAMES, MotionScene
from tcs.model.scene import NeighbourList, Scene
from tcs.motion.cubics import extremes
from tcs.motion.curves import Curve, in_chain
from tcs.motion.keep_out import scene_with_keep_out, spec_with_keep_out
from tcs.motion.motion_plan import Segment
from tcs.motion.stops import Stop
from tcs.motion.timing import Timed

LARGEST_STEP = 0.001
"""Greatest motion of any point of the arm between two checked postures [m]."""
CLEARANCE_ROUNDING = 2e-6
"""Tolerance of a clearance measured by Drake [m]: its distance between boxes is accurate to
1e-6 m."""
LIMIT_ROUNDING = 1e-9
"""How far beyond a joint limit sums of a cubic's coefficients may round [rad]."""
COARSE = 24
"""Parts of a piece of which the motion of the arm is measured."""


class StopCheck:
    """The re-check of the motions of one stop, whose live scenes it sets up."""

    def __init__(self, stop: Stop, before: StopCheck | None = None) -> None:
        """Set up the live scenes.

        Args:
            stop: The stop to which its live scene is set.
            before: The check of another stop of the same scene, which is not used any more: its
                scene with virtual walls serves again where they are in the same place.
        """
        self.stop = stop
        self._lines = self._paths = NeighbourList(stop.scene)
        if stop.job.task.keep_out:
            self._paths = _with_walls(stop, None if before is None else before._paths)

    def false_pieces(self, segment: Segment) -> int:
        """Return how many pieces of a segment Drake refutes."""
        neighbours = self._paths if segment.type == "move" else self._lines
        return false_pieces(neighbours, self.stop.motion, segment.curve)


def _with_walls(stop: Stop, known: NeighbourList | None) -> NeighbourList:
    """Return the neighbours in a stop's scene with virtual walls: the known ones if they serve."""
    job, scene = stop.job, stop.scene
    if known is not None and known.scene.spec == spec_with_keep_out(job, scene):
        known.scene.restore(scene.positions())
        return known
    return NeighbourList(scene_with_keep_out(job, scene))


def false_pieces(neighbours: NeighbourList, motion: MotionScene, curve: Curve) -> int:
    """Return how many pieces of a curve Drake finds in contact or beyond joint limits.

    Args:
        neighbours: Those of the live scene, at the stop; the arm is moved.
        motion: The same scene, for the motion of its shapes.
        curve: A curve of the scored arm.
    """
    curve = curve.in_chain()
    return sum(
        not (
            _is_within_limits(neighbours.scene, curve, piece)
            and _is_free(neighbours, curve.points(piece, dense_fractions(motion, curve, piece)))
        )
        for piece in range(curve.pieces)
    )


def _is_within_limits(scene: Scene, curve: Curve, piece: int) -> bool:
    both = slice(piece, piece + 2)
    found = extremes(Timed(curve.knots[both], curve.q[both], curve.dq[both]))
    lower, upper = (in_chain(limits) for limits in scene.arm_limits)
    return bool(
        np.all(found.least >= lower - LIMIT_ROUNDING)
        and np.all(found.greatest <= upper + LIMIT_ROUNDING)
    )


def _is_free(neighbours: NeighbourList, postures: FloatArray) -> bool:
    scene = neighbours.scene
    for q in postures:
        scene.set_arm(q)
        for first, second, distance in neighbours.violations():
            if distance < scene.required_clearance(first, second) - CLEARANCE_ROUNDING:
                return False
    return True


def dense_fractions(motion: MotionScene, curve: Curve, piece: int) -> FloatArray:
    """Return fractions of a piece at most LARGEST_STEP of motion apart, its ends included."""
    coarse = np.linspace(0.0, 1.0, COARSE + 1)
    points = shape_corners(motion, curve.points(piece, coarse))
    moved = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1)
    # 5 % for the curvature of the points' paths and uneven speed along a part.
    travelled = np.concatenate([[0.0], np.cumsum(1.05 * moved)])
    parts = max(int(np.ceil(travelled[-1] / LARGEST_STEP)), 1)
    inner = np.interp(np.linspace(0.0, travelled[-1], parts + 1)[1:-1], travelled, coarse)
    return np.concatenate([[0.0], inner, [1.0]])


def shape_corners(motion: MotionScene, q: FloatArray) -> FloatArray:
    """Return the corners of cubes about the arm's shapes in A [m], shape (n, points, 3).

    Args:
        motion: The scene.
        q: Postures [rad], shape (n, 7).
    """
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) / np.sqrt(3.0)
    R, p = np.repeat(np.eye(3)[None], len(q), axis=0), np.zeros((len(q), 3))
    corners = []

    def add(link: int, origin: FloatArray) -> None:
        shapes = motion.shapes.links[motion.shapes.link_frame == link]
        # Column 1 is the radius of the bounding sphere, columns 2 to 4 are sizes.
        local = (shapes[:, None, 5:8] + shapes[:, None, 1:2] * signs).reshape(-1, 3)
        corners.append(origin[:, None] + local @ R.transpose(0, 2, 1))

    for joint, slide in enumerate(motion.chain.slides):
        p = p + R @ motion.chain.p[joint, :3]
        R = R @ motion.chain.R[joint]
        if slide > 0.0:
            along = slide * q[:, joint, None] * R[:, :, 2]
            for n, (coupled, part) in enumerate(motion.chain.coupled):
                if coupled == joint:
                    add(FRAMES + n, p + part * along)
            p = p + along
        else:
            c, s = np.cos(q[:, joint]), np.sin(q[:, joint])
            turn = np.zeros((len(q), 3, 3))
            turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
            turn[:, 2, 2] = 1.0
            R = R @ turn
        add(joint + 1, p)
    return np.concatenate(corners, axis=1)
