"""Parameters of a test of which `make test` takes some and `make test-all` every one."""

from __future__ import annotations

from collections.abc import Iterable

import pytest


def some_of(values: Iterable[object], *quick: object) -> list[object]:
    """Return values as parameters of a test; those that are not in `quick` are slow ones."""
    return [value if value in quick else _slow(value) for value in values]


def _slow(value: object) -> object:
    """Return a parameter, or a tuple of several, of a slow test."""
    return pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.slow)
