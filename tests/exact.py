"""Shipped tasks at exact poses, for tests that are not about what the tasks let free.

`--paper` and `paper=True` score them so too, but without approach.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from tcs.files.paths import data_folder


def exact_content(name: str) -> dict[str, Any]:
    """Return the content of a shipped task file without what is free and further poses."""
    content = yaml.safe_load((data_folder() / "tasks" / "adl" / f"{name}.yaml").read_text())
    for entry in (content, *content["goals"]):
        for key in ("free", "alternatives"):
            entry.pop(key, None)
    return dict(content)


def exact_task(name: str, folder: Path) -> Path:
    """Write a shipped task at exact poses to a folder, and return the path of its file."""
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(exact_content(name)))
    return path
