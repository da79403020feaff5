"""Parameters of a test of which `make test` takes some and `make test-all` every one."""

from __future__ import annotations

from collections.abc import Iterable

import pytest


def some_of(values: Iterable[object], *quick: object) -> list[object]:
    """Return values as parameters of a test; those that are not in `quick` are slow ones."""
    return [v if v in quick else pytest.param(v, marks=pytest.mark.slow) for v in values]
