"""Turn estimates of success under error into plain containers and small arrays, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcs.errors import StoreFormatError
from tcs.files.compression import fold, small, unfolded
from tcs.placement.tables import SuccessTable
from tcs.placement.tables.success import NO_MEMBER


def packed_success(success: SuccessTable | None) -> dict[str, Any] | None:
    """Return the plain containers that `unpacked_success` takes; None where there is nothing."""
    if success is None:
        return None
    return {
        "members_plus_one": fold(small(success.members.astype(np.int64) - NO_MEMBER)),
        "success": fold(success.success),
        "low": fold(success.low),
        "high": fold(success.high),
        "samples": fold(small(success.samples.astype(np.int64))),
    }


def unpacked_success(packed: object) -> SuccessTable | None:
    """Return the estimates that were packed; None of a file that has none.

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If they contradict themselves.
    """
    if packed is None:
        return None
    if not isinstance(packed, dict):
        raise StoreFormatError("has estimates of success that are none")
    members = unfolded(packed, "members_plus_one", "u", (None, None))
    rows = (len(members),)
    samples = unfolded(packed, "samples", "u", rows)
    for numbers in (members, samples):
        if np.any(numbers >= np.iinfo(np.int32).max):
            raise StoreFormatError("has estimates of success out of range")
    return SuccessTable(
        members=(members.astype(np.int64) + NO_MEMBER).astype(np.int32),
        success=unfolded(packed, "success", "f8", rows),
        low=unfolded(packed, "low", "f8", rows),
        high=unfolded(packed, "high", "f8", rows),
        samples=samples.astype(np.int32),
    )
