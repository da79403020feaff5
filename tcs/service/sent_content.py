"""What clients send, read in a process of its own: large requests and score files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tcs.errors import DataFileError
from tcs.files.documents import Document, checked
from tcs.output.words import frame_name, person_text
from tcs.placement.store import ScoreFile, load_scores
from tcs.service.responses import FileEntry


def request_of(model: type[Document], content: bytes) -> Any:
    """Return a checked request.

    Args:
        model: Model of its fields.
        content: A JSON object.

    Raises:
        DataFileError: If it is not one, or a field is not of its form.
        UnknownNameError: If a field is unknown.
    """
    try:
        fields = json.loads(content)
    except (ValueError, RecursionError) as error:
        why = "too deep" if isinstance(error, RecursionError) else str(error)
        raise DataFileError(f"request is not valid JSON: {why}.") from None
    if not isinstance(fields, dict):
        raise DataFileError("request must be a JSON object.")
    return checked(fields, model, "request", DataFileError)


def entry_of_file(path: Path, digest: str, most: int) -> FileEntry:
    """Return what a score file is of, after reading it.

    Args:
        path: The file.
        digest: Digest of its content.
        most: Most bytes that its arrays may take once they are decoded.

    Raises:
        StoreError: If it is not a score file, or takes more memory.
    """
    file = load_scores(path, most)
    # Scores are decoded when they are needed: here for the first time, where memory is limited.
    for table in file.tables:
        table.read_scores()
    return entry_of(file, digest, path.stat().st_size)


def entry_of(file: ScoreFile, digest: str, size: int) -> FileEntry:
    """Return what a score file is of."""
    names = {
        key: str(getattr(file, key).get("name", file.metadata[key]))
        for key in ("task", "environment", "robot")
    }
    person = [person_text(file.metadata["person"])] if "person" in file.metadata else []
    return FileEntry(
        file=digest,
        bytes=size,
        **names,
        title=" · ".join(
            [*(frame_name(name) for name in names.values()), *file.hand_names, *person]
        ),
        goals=file.nominal.sets.weights.size,
        configurations=file.configurations.size,
        settings=[
            f"{axis.name}_deg" if axis.unit == "deg" else axis.name
            for axis in file.configurations.environment_axes
        ],
        body_frames=list(file.body_frames),
    )
