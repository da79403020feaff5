"""Observed joints and frames of the environment, and the joint positions that fit them best."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import Frame

from tcs.errors import SelectionError, UnknownNameError
from tcs.files.quantities import POSITION, UNIT_TOLERANCE
from tcs.kernel.arrays import FloatArray
from tcs.model.scene.scene import Scene

MAX_POSITION_ERROR = 0.05
"""Greatest root mean square distance between observed and fitted frames [m]: one standard deviation
of the person in Table II of the TCS paper. Beyond it the person is in a posture that the model
cannot represent."""
MAX_ROTATION_ERROR = math.radians(10.0)
"""Greatest root mean square angle between observed and fitted frames [rad]: two standard deviations
of the person's yaw in Table II, which is also the error of head trackers."""

_DEFAULT_STD = 0.05
"""Standard deviation of a joint without an error model [m or rad]: that of the person in Table II.
It matters only where the frames do not determine all joints."""
_LENGTH_SCALE = 0.2
"""Weight of angles in the residuals [m/rad]: the rotated parts, a head or a trunk, have about this
radius."""
_STEP = 1e-6
"""Step of the central differences [m or rad]: their error is then about 1e-10."""
_MAX_ITERATIONS = 30
"""Greatest number of Gauss-Newton iterations; five are typical."""
_CONVERGED = 1e-11
"""Change of the joints at which the iteration ends [standard deviations]: below a picometre."""
_RANK = 1e-6
"""Singular values below this fraction of the largest are rounding errors of the differences."""
_DECIMALS = 9
"""Fitted values are rounded to a nanometre, so that a frame observed at its nominal pose gives
exactly the offline scores."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """Observed state of the environment: values of joints and poses of frames."""

    joints: Mapping[str, float] = field(default_factory=dict)
    """Values of joints of the environment [m or rad]. All others keep the positions of the
    environment file, unless they are fitted to `frames`."""
    frames: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Poses by body frame ("head") or link ("wheelchair::base_link"): x, y, z [m], followed by a
    quaternion qw, qx, qy, qz where the orientation is observed too. They are in M, the frame of the
    base poses: W without a mount."""
    setting: Mapping[str, float] = field(default_factory=dict)
    """Values of the grid's environment axes at the time the frames were observed [m or rad], e.g.
    the height of the bed."""


@dataclass(frozen=True)
class JointEstimate:
    """Joint positions estimated from an observation, and the residuals of the fit."""

    joints: dict[str, float]
    """Value of each observed or fitted joint [m or rad]."""
    position_error: float | None
    """Root mean square distance between observed and fitted frames [m]; None without frames."""
    rotation_error: float | None
    """Root mean square angle between their orientations [rad]; None where none is observed."""


def estimate_joints(scene: Scene, observation: Observation, chosen: Iterable[str]) -> JointEstimate:
    """Return the joint positions that fit an observation best.

    The frames are fitted by least squares over the joints that are observed axes or have an error
    model. Where they do not determine all of them, the solution is the most likely one: the one of
    least norm in standard deviations of the error model.

    Args:
        scene: The scene; its state is restored.
        observation: Observed joint values and frames.
        chosen: Joints that are axes of the grid, which the robot sets and does not observe.

    Raises:
        UnknownNameError: If there is no such joint or frame.
        SelectionError: If an observed joint is one of `chosen`, frames come without a `setting` of
            all of these, a number is not finite, or the residuals are too large.
        TcsError: If a joint follows another one, or a value exceeds its limits.
    """
    chosen = tuple(chosen)
    for name, value in observation.joints.items():
        if name in chosen:
            raise SelectionError(
                f"Observed '{name}' is an axis of the grid: the robot sets it. To choose among "
                "other values of it, score an environment with another grid."
            )
        if not math.isfinite(value):
            raise SelectionError(f"Observed '{name}' is {value}; must be a finite number.")
    before = scene.positions()
    try:
        for name, value in observation.joints.items():
            scene.set_joint(name, value)
        if not observation.frames:
            return JointEstimate(dict(observation.joints), None, None)
        _apply_setting(scene, observation, chosen)
        return _fitted(scene, observation)
    finally:
        scene.restore(before)


def _apply_setting(scene: Scene, observation: Observation, chosen: tuple[str, ...]) -> None:
    """Set the grid's environment axes as they were when the frames were observed."""
    setting = observation.setting
    for name in setting:
        if name not in chosen:
            raise UnknownNameError("environment axis", name, chosen, where="observation, setting")
    missing = [name for name in chosen if name not in setting]
    if missing:
        raise SelectionError(
            f"Observed frames ({', '.join(observation.frames)}) also depend on "
            f"{', '.join(missing)}. Give the values at the time of the observation as well."
        )
    for name, value in setting.items():
        scene.set_joint(name, value)


def _fitted(scene: Scene, observation: Observation) -> JointEstimate:
    """Return the joint positions at which the frames are nearest to the observed ones."""
    deviations = _free_joints(scene, observation.joints)
    observed = [(_frame(scene, name), *_pose(name, at)) for name, at in observation.frames.items()]
    limits = np.array([scene.built.environment_joints.limits(name) for name in deviations]).reshape(
        -1, 2
    )
    scale = np.array(list(deviations.values()))

    def residuals(z: FloatArray) -> FloatArray:
        for name, value in zip(deviations, z * scale, strict=True):
            scene.set_joint(name, float(value))
        return np.concatenate([_residual(scene, *one) for one in observed])

    z = np.zeros(len(deviations))
    for _ in range(_MAX_ITERATIONS if deviations else 0):
        r, J = residuals(z), _jacobian(residuals, z, _STEP / scale)
        # Of all solutions of the least squares, that of least norm is the most likely.
        step = np.linalg.lstsq(J, J @ z - r, rcond=_RANK)[0]
        step = np.clip(step * scale, limits[:, 0] + _STEP, limits[:, 1] - _STEP) / scale
        done = float(np.max(np.abs(step - z), initial=0.0)) < _CONVERGED
        z = step
        if done:
            break
    values = np.round(z * scale, _DECIMALS) + 0.0
    fitted = dict(zip(deviations, values.tolist(), strict=True))
    return _checked(scene, observation, observed, fitted)


def _checked(
    scene: Scene,
    observation: Observation,
    observed: list[tuple[Frame, FloatArray, RotationMatrix | None]],
    fitted: dict[str, float],
) -> JointEstimate:
    """Return the fit; raise if its residuals are too large."""
    for name, value in fitted.items():
        scene.set_joint(name, value)
    parts = [_residual(scene, *one) for one in observed]
    position_error = math.sqrt(float(np.mean([part[:3] @ part[:3] for part in parts])))
    squares = [float(part[3:] @ part[3:]) / _LENGTH_SCALE**2 for part in parts if part.size > 3]
    rotation_error = math.sqrt(float(np.mean(squares))) if squares else None
    listed = ", ".join(observation.frames)
    if position_error > MAX_POSITION_ERROR:
        raise SelectionError(
            f"Observed frames ({listed}): after the best fit {position_error:.3f} m from the "
            f"scene's, more than {MAX_POSITION_ERROR:.2f} m. Check that they are given in the "
            "environment frame, and the setting of the grid's axes."
        )
    if rotation_error is not None and rotation_error > MAX_ROTATION_ERROR:
        raise SelectionError(
            f"Observed frames ({listed}): after the best fit rotated by "
            f"{math.degrees(rotation_error):.1f} deg from the scene's, more than "
            f"{math.degrees(MAX_ROTATION_ERROR):.0f} deg. Check the orientation (qw qx qy qz), "
            "or give the position alone."
        )
    return JointEstimate({**observation.joints, **fitted}, position_error, rotation_error)


def _free_joints(scene: Scene, known: Mapping[str, float]) -> dict[str, float]:
    """Return the joints to fit and the standard deviation of each [m or rad]."""
    environment = scene.spec.environment
    deviations = {name: error.standard_deviation for name, error in environment.errors.items()}
    for axis in environment.observed_axes:
        deviations.setdefault(axis.name, _DEFAULT_STD)
    return {name: std for name, std in deviations.items() if std > 0.0 and name not in known}


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
    """Return the observed position and orientation of a frame."""
    numbers = np.asarray(at, dtype=np.float64)
    if numbers.shape not in ((3,), (7,)) or not np.all(np.isfinite(numbers)):
        raise SelectionError(
            f"Observed frame '{name}' is {list(at)!r}; must be three finite numbers (x y z, m) or "
            "seven (x y z qw qx qy qz)."
        )
    where = f"Observed frame '{name}': a coordinate"
    POSITION.check(numbers[:3].tolist(), where, SelectionError)
    if numbers.size == 3:
        return numbers, None
    length = float(np.linalg.norm(numbers[3:]))
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise SelectionError(
            f"Observed frame '{name}': its quaternion (qw qx qy qz) has length {length:.4f}; "
            "must be 1."
        )
    return numbers[:3], RotationMatrix(Quaternion(numbers[3:] / length))


def _residual(
    scene: Scene, frame: Frame, p_MH: FloatArray, R_MH: RotationMatrix | None
) -> FloatArray:
    """Return the difference of a frame from the observed one: position, then weighted angle [m]."""
    X_MH: RigidTransform
    (X_MH,) = scene.seen_from_mount([frame.CalcPoseInWorld(scene.plant_context)])
    position = np.asarray(X_MH.translation() - p_MH)
    if R_MH is None:
        return position
    rotation = (X_MH.rotation() @ R_MH.inverse()).ToAngleAxis()
    return np.concatenate(
        [position, _LENGTH_SCALE * rotation.angle() * np.asarray(rotation.axis())]
    )


def _jacobian(
    function: Callable[[FloatArray], FloatArray], at: FloatArray, steps: FloatArray
) -> FloatArray:
    """Return the derivative of a function by central differences, shape (m, n)."""
    columns = [
        (function(at + step) - function(at - step)) / (2.0 * h)
        for h, step in zip(steps, np.diag(steps), strict=True)
    ]
    return np.stack(columns, axis=1)
