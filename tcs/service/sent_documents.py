"""What clients send: task and environment files as text, and large requests and score files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from tcs.errors import (
    DataFileError,
    EnvironmentFileError,
    ServiceError,
    TaskError,
    TcsError,
    UnknownNameError,
    one_line,
)
from tcs.files.documents import Document, checked, mapping_of
from tcs.files.paths import is_path
from tcs.output.words import frame_name, person_text
from tcs.placement.store import ScoreFile, load_scores
from tcs.service.limits import Limits
from tcs.service.responses import FileEntry

if TYPE_CHECKING:
    from tcs.model.scene import EnvironmentFile


class SentDocuments:
    """YAML files that were sent, kept in a folder of the service by the digest of their text."""

    def __init__(self, folder: Path, most: int = Limits().document_bytes) -> None:
        """Keep files in a folder.

        Args:
            folder: The folder.
            most: Most bytes of all files; the oldest are removed first.
        """
        self._folder, self._most = folder, most

    def task(self, text: str) -> Path:
        """Return the path of a task file that was sent.

        Raises:
            ServiceError: If the text is not a mapping in YAML.
        """
        return self._saved("task", text, TaskError)[0]

    def environment(self, text: str) -> Path:
        """Return the path of an environment file that was sent.

        Raises:
            ServiceError: If the text is not a mapping in YAML, is based on another file than an
                environment that ships, or names a model that does not ship.
        """
        path, content = self._saved("environment", text, EnvironmentFileError)
        base = content.get("based_on")
        if isinstance(base, str) and is_path(base):
            raise ServiceError(
                f"sent environment: 'based_on' is '{one_line(base)}'; must be the name of an "
                "environment that ships, e.g. wheelchair."
            )
        for file in _files_of(content):
            if not _is_below(file):
                raise ServiceError(
                    f"sent environment: 'file' is '{one_line(file)}'; must name a model file that "
                    "ships, relative to the data folder."
                )
        return path

    def made(self, environment: EnvironmentFile) -> Path:
        """Return the path of a file with an environment that was made here."""
        from tcs.model.scene.changes import environment_text

        text = environment_text(environment)
        digest = hashlib.sha256(text.encode()).hexdigest()
        path = self._folder / f"changed-environment-{digest[:16]}.yaml"
        path.write_text(text, encoding="utf-8")
        self._make_space()
        return path

    @contextmanager
    def kept_if_used(self, request: Any) -> Iterator[None]:
        """Remove the documents of a request that fails, and the oldest beyond the limit."""
        texts = {what: getattr(request, f"{what}_yaml", None) for what in ("task", "environment")}
        new = [self._path(what, text) for what, text in texts.items() if text is not None]
        new = [path for path in new if not path.exists()]
        try:
            yield
        except BaseException:
            for path in new:
                path.unlink(missing_ok=True)
            raise
        self._make_space()

    def _make_space(self) -> None:
        """Remove the oldest documents until the others are within the limit."""
        found = [(path.stat().st_mtime, path) for path in self._folder.glob("*.yaml")]
        left = sum(path.stat().st_size for _, path in found)
        for _, path in sorted(found):
            if left <= self._most:
                return
            left -= path.stat().st_size
            path.unlink()

    def without_folder(self, error: TcsError) -> TcsError:
        """Return an error with the names of sent files instead of their paths."""
        if isinstance(error, UnknownNameError):
            where = self._shortened(error.where)
            return UnknownNameError(error.what, error.name, error.known, where=where)
        message = self._shortened(str(error))
        return error if message == str(error) else ServiceError(message)

    def _shortened(self, message: str) -> str:
        return message.replace(f"{self._folder}/", "")

    def _path(self, what: str, text: str) -> Path:
        digest = hashlib.sha256(text.encode()).hexdigest()
        return self._folder / f"sent-{what}-{digest[:16]}.yaml"

    def _saved(
        self, what: str, text: str, error: type[DataFileError]
    ) -> tuple[Path, Mapping[str, Any]]:
        """Save a text in YAML; return its path and what it contains."""
        content = mapping_of(text, f"sent {what}", error, known=("name", "title"))
        path = self._path(what, text)
        path.write_text(text, encoding="utf-8")
        return path, content


def _files_of(value: Any) -> Iterator[str]:
    """Yield every text under a key `file`, however deep."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            if key == "file" and isinstance(entry, str):
                yield entry
            yield from _files_of(entry)
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for entry in value:
            yield from _files_of(entry)


def _is_below(file: str) -> bool:
    """Return whether a path stays below the folder that it starts from.

    >>> _is_below("models/bed.sdf"), _is_below("/etc/passwd"), _is_below("a/../../b")
    (True, False, False)
    """
    path = PurePosixPath(file)
    return not (path.is_absolute() or ".." in path.parts or file.startswith("~") or "\\" in file)


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
