"""What a robot sees of the room, turned into values of its joints."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import Frame

from tcs.errors import SelectionError, UnknownNameError
from tcs.kernel.arrays import FloatArray
from tcs.model.scene.scene import Scene

FARTHEST = 0.05
"""Greatest distance [m], root mean square over the frames seen, that no value of the joints
explains: one standard deviation of the person in Table II of the TCS paper. Farther off, the person
sits or lies in another way than the model can."""
FARTHEST_TURN = math.radians(10.0)
"""The same for the orientation [rad]: two standard deviations of the person's turn in Table II,
which is also what trackers of heads are off by."""

_UNKNOWN_SPREAD = 0.05
"""How far a joint without an error model is taken to be off [m or rad]: as the person is in the
paper's Table II. It matters only where too little is seen to tell joints apart."""
_LEVER = 0.2
"""How much a radian weighs beside metres [m]: what turns is half a head or a trunk across."""
_STEP = 1e-6
"""Step of the central differences [m or rad]: their error is then about 1e-10."""
_ROUNDS = 30
"""Most rounds of Gauss-Newton; five are common."""
_CONVERGED = 1e-11
"""Change of the joints that ends them [multiples of the spread]: below a picometre."""
_RANK = 1e-6
"""Singular values below this share of the largest are zeros that the differences blur."""
_DECIMALS = 9
"""Fitted values are rounded to a nanometre, so that what is seen where it belongs is exactly there
and scores as it did offline."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """How the room is found: joints that are known, and frames that are seen."""

    joints: Mapping[str, float] = field(default_factory=dict)
    """Values of joints of the environment [m or rad]; what is not told is where the environment
    file puts it, unless a frame tells."""
    frames: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Poses in W by body frame ("head") or link ("wheelchair::base_link"): x, y, z [m], and where
    the orientation is seen too a quaternion, qw, qx, qy, qz."""
    setting: Mapping[str, float] = field(default_factory=dict)
    """How the axes of the grid that move the room are set while the frames are seen [m or rad],
    e.g. the height of the bed."""


@dataclass(frozen=True)
class Found:
    """What an observation says of the joints, and how well it fits."""

    joints: dict[str, float]
    """Value of each joint that is known or was fitted [m or rad]."""
    off: float | None
    """Root mean square distance of the frames seen from the fitted scene [m]; None without."""
    turned: float | None
    """Root mean square angle between their orientations [rad]; None where none was seen."""


def find_joints(scene: Scene, observation: Observation, chosen: Iterable[str]) -> Found:
    """Return the values of the joints that explain an observation best.

    Frames are fitted in least squares over the joints that the environment observes or has an
    error model for. Where that leaves a choice, the most likely values are taken: the least in
    standard deviations of the error model.

    Args:
        scene: The scene; its state is left as it was.
        observation: What is known and seen.
        chosen: Joints that are axes of the grid, so the robot sets them and does not find them.

    Raises:
        UnknownNameError: If a joint or frame is not there.
        SelectionError: If a joint is chosen, frames are seen in a room that is set nobody knows
            how, a number is not finite, or what is seen is too far from what the scene can do.
        TcsError: If a joint follows another one, or does not go that far.
    """
    chosen = tuple(chosen)
    for name, value in observation.joints.items():
        if name in chosen:
            raise SelectionError(
                f"Observed '{name}' is an axis of the grid: it is chosen, not found. To choose "
                "among other values of it, score an environment with another grid."
            )
        if not math.isfinite(value):
            raise SelectionError(f"Observed '{name}' is {value}; must be a finite number.")
    before = scene.positions()
    try:
        for name, value in observation.joints.items():
            scene.set_joint(name, value)
        if not observation.frames:
            return Found(dict(observation.joints), None, None)
        _set_as_seen(scene, observation, chosen)
        return _fitted(scene, observation)
    finally:
        scene.restore(before)


def _set_as_seen(scene: Scene, observation: Observation, chosen: tuple[str, ...]) -> None:
    """Set the room as it was when the frames were seen."""
    setting = observation.setting
    for name in setting:
        if name not in chosen:
            raise UnknownNameError("environment axis", name, chosen, where="observation, setting")
    untold = [name for name in chosen if name not in setting]
    if untold:
        raise SelectionError(
            f"Frames are seen ({', '.join(observation.frames)}), but not how "
            f"{', '.join(untold)} was set then; that moves the person too. Tell it as well."
        )
    for name, value in setting.items():
        scene.set_joint(name, value)


def _fitted(scene: Scene, observation: Observation) -> Found:
    """Return the joints at which the frames are nearest to where they are seen."""
    spread = _free_joints(scene, observation.joints)
    seen = [(_frame(scene, name), *_pose(name, at)) for name, at in observation.frames.items()]
    limits = np.array([scene.built.environment_joints.limits(name) for name in spread]).reshape(
        -1, 2
    )
    scale = np.array(list(spread.values()))

    def offsets(z: FloatArray) -> FloatArray:
        for name, value in zip(spread, z * scale, strict=True):
            scene.set_joint(name, float(value))
        return np.concatenate([_offset(scene, *one) for one in seen])

    z = np.zeros(len(spread))
    for _ in range(_ROUNDS if spread else 0):
        r, J = offsets(z), _jacobian(offsets, z, _STEP / scale)
        # Among all that fit, the solution nearest to the origin: the most likely one.
        step = np.linalg.lstsq(J, J @ z - r, rcond=_RANK)[0]
        step = np.clip(step * scale, limits[:, 0] + _STEP, limits[:, 1] - _STEP) / scale
        done = float(np.max(np.abs(step - z), initial=0.0)) < _CONVERGED
        z = step
        if done:
            break
    values = np.round(z * scale, _DECIMALS) + 0.0
    return _judged(scene, observation, seen, dict(zip(spread, values.tolist(), strict=True)))


def _judged(
    scene: Scene,
    observation: Observation,
    seen: list[tuple[Frame, FloatArray, RotationMatrix | None]],
    fitted: dict[str, float],
) -> Found:
    """Return the fit, refusing one that leaves too much unexplained."""
    for name, value in fitted.items():
        scene.set_joint(name, value)
    parts = [_offset(scene, *one) for one in seen]
    off = math.sqrt(float(np.mean([part[:3] @ part[:3] for part in parts])))
    turns = [float(part[3:] @ part[3:]) / _LEVER**2 for part in parts if part.size > 3]
    turned = math.sqrt(float(np.mean(turns))) if turns else None
    listed = ", ".join(observation.frames)
    if off > FARTHEST:
        raise SelectionError(
            f"What is seen ({listed}) is {off:.3f} m from the nearest the scene can be, more than "
            f"{FARTHEST:.2f} m. Check the frames, that they are in the environment frame, and how "
            "the room was set."
        )
    if turned is not None and turned > FARTHEST_TURN:
        raise SelectionError(
            f"What is seen ({listed}) is turned by {math.degrees(turned):.1f} deg from the nearest "
            f"the scene can be, more than {math.degrees(FARTHEST_TURN):.0f} deg. Check the "
            "orientation (qw qx qy qz), or tell the position alone."
        )
    return Found({**observation.joints, **fitted}, off, turned)


def _free_joints(scene: Scene, known: Mapping[str, float]) -> dict[str, float]:
    """Return the joints to fit and how far each is commonly off [m or rad]."""
    environment = scene.spec.environment
    spread = {name: error.standard_deviation for name, error in environment.errors.items()}
    for axis in environment.observed_axes:
        spread.setdefault(axis.name, _UNKNOWN_SPREAD)
    return {name: std for name, std in spread.items() if std > 0.0 and name not in known}


def _frame(scene: Scene, name: str) -> Frame:
    """Return a body frame, or the frame of a link given as "model::link"."""
    if name in scene.built.body_frames:
        return scene.built.body_frames[name]
    plant = scene.built.plant
    model, _, link = name.partition("::")
    if link and plant.HasModelInstanceNamed(model):
        instance = plant.GetModelInstanceByName(model)
        if plant.HasBodyNamed(link, instance):
            return plant.GetBodyByName(link, instance).body_frame()
    where = f"observation, environment '{scene.spec.environment.name}'"
    raise UnknownNameError("frame", name, scene.built.body_frames, where=where)


def _pose(name: str, at: Sequence[float]) -> tuple[FloatArray, RotationMatrix | None]:
    """Return place and orientation of a frame as they are seen."""
    numbers = np.asarray(at, dtype=np.float64)
    if numbers.shape not in ((3,), (7,)) or not np.all(np.isfinite(numbers)):
        raise SelectionError(
            f"Frame '{name}' is seen at {list(at)!r}; must be three finite numbers (x y z, m), or "
            "seven (x y z qw qx qy qz)."
        )
    if numbers.size == 3:
        return numbers, None
    length = float(np.linalg.norm(numbers[3:]))
    # Trackers write four or more digits.
    if abs(length - 1.0) > 1e-3:
        raise SelectionError(
            f"Frame '{name}': its quaternion (qw qx qy qz) has length {length:.4f}; must be 1."
        )
    return numbers[:3], RotationMatrix(Quaternion(numbers[3:] / length))


def _offset(
    scene: Scene, frame: Frame, p_WH: FloatArray, R_WH: RotationMatrix | None
) -> FloatArray:
    """Return where a frame is minus where it is seen: metres, then radians times the lever."""
    X_WH: RigidTransform = frame.CalcPoseInWorld(scene.plant_context)
    away = np.asarray(X_WH.translation() - p_WH)
    if R_WH is None:
        return away
    turn = (X_WH.rotation() @ R_WH.inverse()).ToAngleAxis()
    return np.concatenate([away, _LEVER * turn.angle() * np.asarray(turn.axis())])


def _jacobian(
    function: Callable[[FloatArray], FloatArray], at: FloatArray, steps: FloatArray
) -> FloatArray:
    """Return the derivative of a function by central differences, shape (m, n)."""
    columns = [
        (function(at + step) - function(at - step)) / (2.0 * h)
        for h, step in zip(steps, np.diag(steps), strict=True)
    ]
    return np.stack(columns, axis=1)
