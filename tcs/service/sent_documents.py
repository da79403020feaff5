"""Task and environment files that are sent as text: the usual checks, and no path is opened."""

from __future__ import annotations

import hashlib
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
from tcs.files.documents import mapping_of
from tcs.files.paths import is_path
from tcs.service.limits import Limits

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
