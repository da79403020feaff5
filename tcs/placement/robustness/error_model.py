"""How far off the environment may be: which joints, how distributed, and random draws of it."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError, TcsError
from tcs.files.documents import Document, read_document
from tcs.model.scene import ErrorDistribution, Scene

Offsets = Mapping[str, NDArray[np.float64]]
"""For each joint by how much it is off in each sample [m or rad], shapes (samples,)."""

MAX_SAMPLES = 1_000_000
"""More samples than this are a mistake: the mean would be known to a thousandth of a percent."""
MAX_SEED = 2**63 - 1
"""Greatest seed."""


class ErrorFile(Document):
    """A file of errors of the user's own."""

    title: str = ""
    source: str = ""
    errors: Mapping[str, ErrorDistribution]
    """For each joint how far off it may be."""


@dataclass(frozen=True)
class ErrorModel:
    """Independent errors on joints of an environment, as in Table II of the TCS paper."""

    errors: Mapping[str, ErrorDistribution]
    """For each joint how far off it may be; the others are where they are believed to be."""
    source: str
    """Where the figures come from."""

    @classmethod
    def of(
        cls, scene: Scene, errors: str | Path | Mapping[str, ErrorDistribution] | None = None
    ) -> ErrorModel:
        """Return the errors of a scene.

        Args:
            scene: The scene whose joints they are.
            errors: The path of a file, or the errors themselves, in place of the environment's.

        Raises:
            DataFileError: If the file cannot be used, or an error is not in its joint's unit.
            UnknownNameError: If there is no such joint, or no such key in the file.
        """
        environment = scene.spec.environment
        if errors is None:
            where, source = f"environment '{environment.name}', field 'errors'", environment.source
            errors = environment.errors
        elif isinstance(errors, Mapping):
            where = source = "errors given"
        else:
            where = f"error file '{errors}'"
            read = read_document(Path(errors), ErrorFile, where, DataFileError)
            source, errors = read.source or str(errors), read.errors
        for name, error in errors.items():
            scene.built.environment_joints.check_error(name, error, where=where)
        return cls(dict(errors), source)

    def draw(self, samples: int, seed: int, *, stream: str = "") -> Offsets:
        """Return random errors of every joint.

        Each joint has a stream of its own, started by the seed and the joint's name: adding a
        joint changes no other joint's errors, and a hundred samples are the first hundred of a
        thousand.

        Args:
            samples: How many.
            seed: Where the streams start; the same seed gives the same numbers.
            stream: Another text gives independent numbers.

        Raises:
            TcsError: If there are no samples or too many, the seed is none, or no joint is off.
        """
        check_draws(samples, seed)
        if not self.errors:
            raise TcsError(
                "No joint is said to be off, so there is nothing to try. Name joints in an error "
                "file (--errors), or in the environment file under 'errors'."
            )
        return {
            name: error.draw(named_generator(seed, f"{stream}/{name}"), samples)
            for name, error in self.errors.items()
        }

    def to_json(self) -> dict[str, dict[str, float | str]]:
        """Return the errors as an error file holds them."""
        return {
            name: error.model_dump(mode="json", exclude_none=True)
            for name, error in self.errors.items()
        }


def named_generator(seed: int, name: str) -> np.random.Generator:
    """Return the stream of random numbers of that name: PCG64, independent of other names'.

    Args:
        seed: From 0.
        name: Any text.
    """
    key = name.encode()
    # The checksum keeps names of other lengths apart in every 32-bit word of the key.
    words = (zlib.crc32(key), len(key), *key)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=words)))


def check_draws(samples: int, seed: int) -> None:
    """Refuse a number of samples, or a seed, that is none.

    Raises:
        TcsError: If one is out of range.
    """
    if samples % 1 or not 1 <= samples <= MAX_SAMPLES:
        raise TcsError(f"samples is {samples}; must be a whole number, 1 to {MAX_SAMPLES:,}.")
    if seed % 1 or not 0 <= seed <= MAX_SEED:
        raise TcsError(f"seed is {seed}; must be a whole number from 0 to {MAX_SEED}.")
