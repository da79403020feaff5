"""Reports: pages of text, tables and pictures about what was scored and how well it holds up."""

from __future__ import annotations
