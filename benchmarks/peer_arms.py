"""Peers that solve the arm alone, without contacts: EAIK, TRAC-IK and pinocchio.

Each is an optional package (`pip install '.[benchmarks]'`) and is imported only when it is used.
All use the arm of the lowered chain: frames, limits and tool are those of the tcs kernel.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from peer_problems import Answer, Pair, start_limits, tries_filled, turned

from tcs.kernel.arrays import Chain, FloatArray

SWEEP = 32
"""Values of the free joint that EAIK solves for: 0.087 rad apart on the PR2."""
TIMEOUT = 0.005
"""Default time limit of TRAC-IK [s], wall time."""
CALLS = (1, 5)
TRACIK_TOLERANCE = 1e-5
"""Default tolerance of TRAC-IK."""
RESTARTS, STEPS = 10, 100
"""Damped least squares: number of random starts, and of steps from each."""
DAMPING = 1e-2
"""Added to J J^T. On a dozen reachable pairs 1e-6 and 1e-3 took 2.0 starts, this took 1.5."""
CONVERGED = 1e-4
"""Norm of the logarithm of the pose error at which it stops: pinocchio's own example."""


class UnfitArmError(Exception):
    """A peer that cannot take this arm, and why."""


class EaikSweep:
    """EAIK (closed-form IK of six joints) at evenly spread values of the first joint."""

    labels = (f"EAIK, sweep of {SWEEP}",)

    def __init__(self, chain: Chain) -> None:
        """Build one six-joint arm for every value of the free joint."""
        from eaik.IK_Homogeneous import HomogeneousRobot

        first, last = start_limits(chain.lower, chain.upper)
        frames = np.array(_zero_poses(chain))
        self._lower, self._upper = chain.lower, chain.upper
        self._arms = [
            HomogeneousRobot(frames, [(0, float(value))])
            for value in np.linspace(first[0], last[0], SWEEP)
        ]
        if not all(arm.hasKnownDecomposition() for arm in self._arms):
            raise UnfitArmError(
                "EAIK knows no closed form of this arm with joint 1 fixed "
                f"({self._arms[0].getKinematicFamily()})"
            )

    def solve(self, pair: Pair, rng: np.random.Generator) -> tuple[Answer, ...]:
        """Return every solution within the limits."""
        begun = time.process_time()
        q = [np.empty((0, 7))]
        for arm in self._arms:
            found = arm.IK(pair.X_AG)
            if found.num_solutions():
                # Least-squares solutions miss the goal.
                q.append(np.asarray(found.Q)[~np.asarray(found.is_LS, dtype=bool)])
        postures = turned(np.concatenate(q), self._lower, self._upper)
        kept = np.all((postures >= self._lower) & (postures <= self._upper), axis=1)
        postures = postures[kept]
        return (Answer(time.process_time() - begun, tuple(postures)),)


class TracIk:
    """TRAC-IK from random starts; in each call it starts again itself until its time is over.

    It runs two solvers on two threads. Its time is the clock's: on a busy machine it finds less.
    """

    labels = tuple(f"TRAC-IK, {n} {'call' if n == 1 else 'calls'}" for n in CALLS)

    def __init__(self, chain: Chain) -> None:
        """Hand the arm over as a URDF."""
        from trac_ik import TracIK

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "arm.urdf"
            path.write_text(urdf(chain), encoding="utf-8")
            self._solver = TracIK("arm_base", "tool", str(path), TIMEOUT, TRACIK_TOLERANCE)
        if self._solver.dof != 7:
            raise UnfitArmError(f"TRAC-IK reads {self._solver.dof} joints, not 7")
        self._starts = start_limits(chain.lower, chain.upper)

    def solve(self, pair: Pair, rng: np.random.Generator) -> tuple[Answer, ...]:
        """Return its solution after each number of CALLS, if any."""
        p, R = pair.X_AG[:3, 3], pair.X_AG[:3, :3]
        answers: list[Answer] = []
        begun = time.process_time()
        for n in range(1, CALLS[-1] + 1):
            q = self._solver.ik(p, R, rng.uniform(*self._starts))
            answer = Answer(time.process_time() - begun, () if q is None else (np.asarray(q),))
            if n in CALLS:
                answers.append(answer)
            if q is not None:
                break
        return tries_filled(answers, answer, len(CALLS))


class PinocchioClik:
    """Closed-loop IK by damped least squares, as in pinocchio's example, with restarts.

    The loop is in Python, as in the example.
    """

    labels = (f"pinocchio CLIK, {RESTARTS} starts",)

    def __init__(self, chain: Chain) -> None:
        """Build the arm as a pinocchio model."""
        import pinocchio

        self._pin = pinocchio
        self._model = pinocchio.Model()
        joint = 0
        for i in range(7):
            X = pinocchio.SE3(chain.R[i], chain.p[i])
            joint = self._model.addJoint(joint, pinocchio.JointModelRZ(), X, f"arm_{i + 1}")
        X = pinocchio.SE3(chain.R[7], chain.p[7])
        frame_type = pinocchio.FrameType.OP_FRAME
        self._tool = self._model.addFrame(pinocchio.Frame("tool", joint, 0, X, frame_type))
        self._data = self._model.createData()
        self._lower, self._upper = chain.lower, chain.upper
        self._starts = start_limits(chain.lower, chain.upper)

    def solve(self, pair: Pair, rng: np.random.Generator) -> tuple[Answer, ...]:
        """Return the first posture it converges to, if any."""
        goal = self._pin.SE3(pair.X_AG)
        begun = time.process_time()
        found = None
        for _ in range(RESTARTS):
            found = self._descend(goal, rng.uniform(*self._starts))
            if found is not None:
                break
        return (Answer(time.process_time() - begun, () if found is None else (found,)),)

    def _descend(self, goal: object, q: FloatArray) -> FloatArray | None:
        pin, model, data, tool = self._pin, self._model, self._data, self._tool
        damping = DAMPING * np.eye(6)
        for _ in range(STEPS):
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, tool)
            X_TG = data.oMf[tool].actInv(goal)
            error = pin.log6(X_TG).vector
            if np.linalg.norm(error) < CONVERGED:
                return q
            J = pin.computeFrameJacobian(model, data, q, tool, pin.ReferenceFrame.LOCAL)
            J = pin.Jlog6(X_TG.inverse()) @ J
            step = J.T @ np.linalg.solve(J @ J.T + damping, error)
            # Clipped at every step, so that the result is within the limits.
            q = np.clip(q + step, self._lower, self._upper)
        return None


def urdf(chain: Chain) -> str:
    """Return the arm as a URDF from link `arm_base` to link `tool`, exact to the last digit."""
    lines = ['<robot name="arm">', '<link name="arm_base"/>']
    parent = "arm_base"
    for i in range(8):
        child = f"link_{i + 1}" if i < 7 else "tool"
        xyz = " ".join(repr(float(v)) for v in chain.p[i])
        rpy = " ".join(repr(v) for v in _roll_pitch_yaw(chain.R[i]))
        joint_type, limit = "fixed", ""
        if i < 7:
            joint_type, limit = "continuous", '<limit effort="1" velocity="1"/>'
            if np.isfinite(chain.lower[i]) and np.isfinite(chain.upper[i]):
                ends = f'lower="{float(chain.lower[i])!r}" upper="{float(chain.upper[i])!r}"'
                joint_type, limit = "revolute", f'<limit effort="1" velocity="1" {ends}/>'
        lines += [
            f'<link name="{child}"/>',
            f'<joint name="{"arm" if i < 7 else "hand"}_{i + 1}" type="{joint_type}">',
            f'<parent link="{parent}"/><child link="{child}"/>',
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/>{limit}</joint>',
        ]
        parent = child
    return "\n".join([*lines, "</robot>"])


def _roll_pitch_yaw(R: FloatArray) -> tuple[float, float, float]:
    """Return the URDF's angles of R = Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    across = float(np.hypot(R[0, 0], R[1, 0]))
    pitch = float(np.arctan2(-R[2, 0], across))
    # At a pitch of 90 deg only the sum of roll and yaw is defined; 1e-9 is rounding.
    if across < 1e-9:
        return float(np.arctan2(-R[1, 2], R[1, 1])), pitch, 0.0
    return float(np.arctan2(R[2, 1], R[2, 2])), pitch, float(np.arctan2(R[1, 0], R[0, 0]))


def _zero_poses(chain: Chain) -> list[FloatArray]:
    """Return the poses of L1..L7 and of the tool in A, all joints at zero, shape (4, 4) each."""
    X, poses = np.eye(4), []
    for R, p in zip(chain.R, chain.p, strict=True):
        F = np.eye(4)
        F[:3, :3], F[:3, 3] = R, p
        X = X @ F
        poses.append(X)
    return poses
