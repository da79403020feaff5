"""Encode estimates of success under error as plain containers and compressed arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcs.errors import StoreFormatError
from tcs.files.compression import compress, decompress, smallest_unsigned
from tcs.placement.tables import SuccessTable
from tcs.placement.tables.success import NO_MEMBER


def encode_success(success: SuccessTable | None) -> dict[str, Any] | None:
    """Return the plain containers that `decode_success` takes; None where there is nothing."""
    if success is None:
        return None
    return {
        "members_plus_one": compress(
            smallest_unsigned(success.members.astype(np.int64) - NO_MEMBER)
        ),
        "success": compress(success.success),
        "low": compress(success.low),
        "high": compress(success.high),
        "samples": compress(smallest_unsigned(success.samples.astype(np.int64))),
    }


def decode_success(encoded: object) -> SuccessTable | None:
    """Return the encoded estimates; None for a file without estimates.

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If they contradict themselves.
    """
    if encoded is None:
        return None
    if not isinstance(encoded, dict):
        raise StoreFormatError("has invalid estimates of success")
    members = decompress(encoded, "members_plus_one", "u", (None, None))
    rows = (len(members),)
    samples = decompress(encoded, "samples", "u", rows)
    for numbers in (members, samples):
        if np.any(numbers >= np.iinfo(np.int32).max):
            raise StoreFormatError("has estimates of success out of range")
    return SuccessTable(
        members=(members.astype(np.int64) + NO_MEMBER).astype(np.int32),
        success=decompress(encoded, "success", "f8", rows),
        low=decompress(encoded, "low", "f8", rows),
        high=decompress(encoded, "high", "f8", rows),
        samples=samples.astype(np.int32),
    )
