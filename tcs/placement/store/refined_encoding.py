"""Encode refined sets as plain containers and compressed arrays, and decode them."""

from __future__ import annotations

from typing import Any

import numpy as np

from tcs.errors import StoreFormatError
from tcs.files.compression import compress, decompress, smallest_unsigned
from tcs.placement.tables import RefinedSuccess, RefinedTable
from tcs.placement.tables.success import NO_MEMBER


def encode_refined(refined: RefinedTable | None) -> dict[str, Any] | None:
    """Return the plain containers that `decode_refined` takes; None where there is nothing."""
    if refined is None:
        return None
    return {
        "origin_plus_one": compress(smallest_unsigned(refined.origin.astype(np.int64) - NO_MEMBER)),
        "values": compress(refined.values),
        "reached": compress(refined.reached.astype(np.uint8)),
        "dexterity": compress(refined.dexterity),
        "arm_joints": compress(refined.arm_joints),
        **({} if refined.hand is None else {"hand": compress(refined.hand)}),
        "objective": compress(refined.objective),
        "success": None if refined.success is None else _encode_success(refined.success),
    }


def decode_refined(encoded: object, weights: np.ndarray[Any, Any]) -> RefinedTable | None:
    """Return the encoded refined sets; None for a file without them.

    Args:
        encoded: What `encode_refined` returned.
        weights: Weights of the goals, sum 1, shape (G,).

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If the arrays contradict each other.
    """
    if encoded is None:
        return None
    if not isinstance(encoded, dict):
        raise StoreFormatError("has invalid refined sets")
    origin = decompress(encoded, "origin_plus_one", "u", (None, None))
    if np.any(origin >= np.iinfo(np.int32).max):
        raise StoreFormatError("has refined sets out of range")
    shape = (*origin.shape, weights.size)
    return RefinedTable(
        origin=(origin.astype(np.int64) + NO_MEMBER).astype(np.int32),
        values=decompress(encoded, "values", "f8", (*origin.shape, None)),
        reached=decompress(encoded, "reached", "u1", shape).astype(np.bool_),
        dexterity=decompress(encoded, "dexterity", "f4", shape),
        arm_joints=decompress(encoded, "arm_joints", "f4", (*shape, 7)),
        objective=decompress(encoded, "objective", "f8", origin.shape[:1]),
        weights=weights,
        success=_decode_success(encoded.get("success"), origin.shape[:1]),
        hand=decompress(encoded, "hand", "u1", shape) if "hand" in encoded else None,
    )


def _encode_success(success: RefinedSuccess) -> dict[str, Any]:
    """Return the plain containers that `_decode_success` takes."""
    arrays = {"mean": success.mean, "low": success.low, "high": success.high}
    return {**{name: compress(array) for name, array in arrays.items()}, "samples": success.samples}


def _decode_success(encoded: object, shape: tuple[int, ...]) -> RefinedSuccess | None:
    """Return the encoded success of refined sets; None without one."""
    if encoded is None:
        return None
    if not isinstance(encoded, dict) or type(encoded.get("samples")) is not int:
        raise StoreFormatError("has an invalid success of its refined sets")
    mean, low, high = (decompress(encoded, name, "f8", shape) for name in ("mean", "low", "high"))
    return RefinedSuccess(mean=mean, low=low, high=high, samples=encoded["samples"])
