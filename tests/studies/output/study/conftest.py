"""Controls of the live page, pressed by a test."""

from __future__ import annotations

from tests.output.view.teleop.conftest import desk

__all__ = ["desk"]
