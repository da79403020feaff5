"""An environment of few configurations, which the PR2 scores in a second."""

from __future__ import annotations

BESIDE = """
based_on: wheelchair
name: beside
title: A few places beside the wheelchair
grid:
  base_x: {unit: m, start: 0.6, step: 0.2, count: 4}
  base_y: {unit: m, start: -0.95, step: 1.7, count: 2}
  base_yaw: {unit: deg, start: 90, step: 90, count: 2}
  torso: {unit: m, start: 0.15, step: 0.15, count: 2}
"""
