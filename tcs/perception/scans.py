"""Scans: the ranges of a scanner at rest, their mean, and CSV files of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tcs.errors import PerceptionError
from tcs.files.reading import read_text
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.perception.scanner import LaserScanner

MAX_BYTES = 50_000_000
"""Most bytes of a file of scans: about a thousand seconds at 10 Hz."""
_OUTLIER = 5.0
"""Ranges of a beam that spread by more than this many standard deviations of the noise come from
an edge or from something that moves."""


@dataclass(frozen=True, eq=False)
class Scans:
    """Scans taken one after the other from one base pose."""

    scanner: LaserScanner
    ranges: FloatArray
    """Range of each beam [m], infinite where nothing is in range, shape (scans, beams)."""

    def __post_init__(self) -> None:
        """Check the ranges; those that the scanner cannot measure become infinite.

        Raises:
            PerceptionError: If there is no scan, or the number of beams differs.
        """
        ranges = np.asarray(self.ranges, dtype=np.float64)
        if ranges.ndim != 2 or not len(ranges) or ranges.shape[1] != self.scanner.beams:
            raise PerceptionError(
                f"scans of shape {ranges.shape}; must be one or more of {self.scanner.beams} "
                "ranges each."
            )
        with np.errstate(invalid="ignore"):
            valid = (ranges >= self.scanner.nearest) & (ranges <= self.scanner.farthest)
        ranges = np.where(valid, ranges, np.inf)
        ranges.flags.writeable = False
        object.__setattr__(self, "ranges", ranges)

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.ranges)

    def mean(self) -> FloatArray:
        """Return the mean range of each beam [m], shape (beams,).

        It is infinite where half of the scans or fewer have a range, and not a number where the
        ranges spread by more than noise.
        """
        valid = np.isfinite(self.ranges)
        count = valid.sum(axis=0)
        total = np.where(valid, self.ranges, 0.0).sum(axis=0)
        mean = total / np.maximum(count, 1)
        spread = np.where(valid, np.abs(self.ranges - mean), 0.0).max(axis=0)
        steady = spread <= _OUTLIER * self.scanner.deviation(mean)
        return np.where(2 * count > len(self), np.where(steady, mean, np.nan), np.inf)


def read_scans(path: Path, scanner: LaserScanner) -> Scans:
    """Return the scans of a CSV file: a line per scan, a range [m] per beam, `inf` without one.

    Raises:
        PerceptionError: If the file cannot be read, or does not fit the scanner.
    """
    where = f"scans '{path}'"
    text = read_text(path, where, PerceptionError, limit=MAX_BYTES)
    rows = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            rows.append([float(word) for word in line.split(",")])
        except ValueError:
            raise PerceptionError(f"{where}, line {number}: must be numbers.") from None
        if len(rows[-1]) != scanner.beams:
            raise PerceptionError(
                f"{where}, line {number}: {len(rows[-1])} ranges, but the scanner has "
                f"{scanner.beams} beams."
            )
    if not rows:
        raise PerceptionError(f"{where} is empty; it must have a line per scan.")
    return Scans(scanner, np.array(rows))


def write_scans(path: Path, scans: Scans) -> None:
    """Write scans to a CSV file, which `read_scans` reads.

    Raises:
        OutputError: If the file cannot be written.
    """
    with whole_file(path, "Scans") as stream:
        np.savetxt(stream, scans.ranges, fmt="%.4f", delimiter=",")
