"""Error model of the environment: distributions of joint errors, samples, displaced joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError, TcsError
from tcs.files.documents import Document, read_document
from tcs.kernel.arrays import FloatArray
from tcs.model.random_streams import check_draws, named_generator
from tcs.model.scene import ErrorDistribution, Scene
from tcs.placement.scoring.job import Job

Offsets = Mapping[str, NDArray[np.float64]]
"""Error of each joint in each sample [m or rad], shapes (samples,)."""


class ErrorFile(Document):
    """User-defined error file."""

    title: str = ""
    source: str = ""
    errors: Mapping[str, ErrorDistribution]
    """Error distribution of each joint."""


@dataclass(frozen=True)
class ErrorModel:
    """Independent errors of joints of an environment, as in Table II of the TCS paper."""

    errors: Mapping[str, ErrorDistribution]
    """Error distribution of each joint; all other joints have no error."""
    source: str
    """Source of the figures."""

    @classmethod
    def of(
        cls, scene: Scene, errors: str | Path | Mapping[str, ErrorDistribution] | None = None
    ) -> ErrorModel:
        """Return the error model of a scene.

        Args:
            scene: The scene with the joints.
            errors: Path of an error file, or errors by joint, in place of those of the
                environment.

        Raises:
            DataFileError: If the file cannot be used, or an error is not in its joint's unit.
            UnknownNameError: If there is no such joint, or no such key in the file.
        """
        environment = scene.spec.environment
        if errors is None:
            where, source = f"environment '{environment.name}', field 'errors'", environment.source
            errors = environment.errors
        elif isinstance(errors, Mapping):
            where = source = "given errors"
        else:
            where = f"error file '{errors}'"
            read = read_document(Path(errors), ErrorFile, where, DataFileError)
            source, errors = read.source or str(errors), read.errors
        for name, error in errors.items():
            scene.built.environment_joints.check_error(name, error, where=where)
        return cls(dict(errors), source)

    def draw(self, samples: int, seed: int, *, stream: str = "") -> Offsets:
        """Return random errors of every joint.

        Each joint has its own random stream, seeded by the seed and the joint's name: adding a
        joint changes no other joint's errors, and a hundred samples are the first hundred of a
        thousand.

        Args:
            samples: Number of samples.
            seed: Seed of the streams; the same seed gives the same numbers.
            stream: Name of the draw; another name gives independent numbers.

        Raises:
            TcsError: If the number of samples or the seed is out of range, or no joint has an
                error.
        """
        check_draws(samples, seed)
        if not self.errors:
            raise TcsError(
                "No joint has an error, so there is nothing to evaluate. Give errors of joints in "
                "an error file (--errors), or in the environment file under 'errors'."
            )
        return {
            name: error.draw(named_generator(seed, f"{stream}/{name}"), samples)
            for name, error in self.errors.items()
        }

    def to_json(self) -> dict[str, dict[str, float | str]]:
        """Return the errors in the form of an error file."""
        return {
            name: error.model_dump(mode="json", exclude_none=True)
            for name, error in self.errors.items()
        }


def displaced(
    job: Job, scene: Scene, nominal: Mapping[str, float], offsets: Offsets
) -> tuple[dict[str, FloatArray], NDArray[np.bool_]]:
    """Return joint positions in each sample, and whether a joint was held at its limit.

    Args:
        job: Robot and environment.
        scene: Its live scene.
        nominal: Positions without error, by joint [m or rad]; other joints are where the
            environment file has them.
        offsets: Errors of the joints, shapes (samples,).
    """
    samples = samples_of(offsets)
    positions = {name: np.full(samples, value) for name, value in nominal.items()}
    limited = np.zeros(samples, dtype=np.bool_)
    for name, error in offsets.items():
        center = nominal.get(name, scene.built.environment_joints.default(name))
        lower, upper = scene.built.environment_joints.limits(name)
        # Rounding may put the last grid value beyond the limit, where it must remain.
        moved = center + np.asarray(error, dtype=np.float64)
        positions[name] = np.clip(moved, min(lower, center), max(upper, center))
        limited |= positions[name] != moved
    return positions, limited


def samples_of(offsets: Offsets) -> int:
    """Return the number of samples.

    Raises:
        TcsError: If the joints have different numbers of samples, or there is no joint.
    """
    sizes = {len(values) for values in offsets.values()}
    if len(sizes) != 1:
        raise TcsError(
            "Errors must be given for at least one joint, with the same number of samples for each."
        )
    return sizes.pop()
