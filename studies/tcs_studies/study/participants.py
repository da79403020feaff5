"""Files of participants: one JSON document each, written whole after every step."""

from __future__ import annotations

import fcntl
import json
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, StrictInt, StringConstraints, model_validator

from tcs.errors import DataFileError, OutputError, UnknownNameError, one_line
from tcs.files.documents import MAX_BYTES, Document, checked
from tcs.files.reading import read_text
from tcs.files.writing import make_folder, whole_file
from tcs_studies.experiment.order import counterbalanced_orders
from tcs_studies.study.forms import Answer
from tcs_studies.study.steps import Step, form_of, steps_of
from tcs_studies.study.study_file import PARTICIPANTS, RUNS, Study

VERSION = 1
"""Version of the keys of the file of a participant."""
ParticipantName = Annotated[
    str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=40)
]
_LONGEST_REASON = 500
Reason = Annotated[str, StringConstraints(min_length=1, max_length=_LONGEST_REASON)]


class StepRecord(Document):
    """What was recorded in a step: a run, answers, or why there is neither."""

    recorded: str
    """Time of the record, UTC."""
    run: str | None = None
    """Path of the run file in the folder of the study."""
    sha256: str | None = None
    """Checksum of the run file."""
    answers: dict[str, StrictInt | str] | None = None
    """Answers by question."""
    missing: Reason | None = None
    """Reason for which there is no run and no answers."""

    @model_validator(mode="after")
    def _one_of(self) -> StepRecord:
        given = [name for name in ("run", "answers", "missing") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError("must have one of run, answers and missing")
        return self


class ParticipantFile(Document):
    """Content of the file of a participant."""

    format: Literal["tcs participant"]
    format_version: Literal[1]
    participant: ParticipantName
    order: list[str]
    """Names of the conditions in the order in which this participant has them."""
    created: str
    """Time of the creation, UTC."""
    dropped: Reason | None = None
    """Reason for which the participant is left out of the results."""
    steps: dict[str, StepRecord] = Field(default_factory=dict)
    """Records by `Step.key`."""

    def open_steps(self, study: Study) -> list[Step]:
        """Return the steps without a record, in order."""
        return [one for one in steps_of(study, self.order) if one.key not in self.steps]

    @property
    def is_active(self) -> bool:
        """Whether the participant was not dropped."""
        return self.dropped is None


def now() -> str:
    """Return the time in UTC to the second, as ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def checked_reason(text: str) -> str:
    """Return the reason of a missing step or a dropped participant, on one line.

    Raises:
        DataFileError: If it is blank or too long.
    """
    reason = one_line(text, _LONGEST_REASON + 1)
    if not 1 <= len(reason) <= _LONGEST_REASON:
        raise DataFileError(
            f"the reason has {len(text):,} characters; must be 1 to {_LONGEST_REASON}, not blank."
        )
    return reason


def participant_path(study: Study, name: str) -> Path:
    """Return the path of the file of a participant."""
    return study.folder / PARTICIPANTS / f"{name}.json"


def save_participant(study: Study, participant: ParticipantFile) -> None:
    """Write the file of a participant, completely or not at all.

    Raises:
        OutputError: If the file cannot be written.
    """
    content = participant.model_dump(mode="json", exclude_none=True)
    make_folder(study.folder / PARTICIPANTS)
    with whole_file(participant_path(study, participant.participant), "Participant") as stream:
        stream.write(json.dumps(content, indent=1, ensure_ascii=False).encode() + b"\n")


def load_participant(study: Study, name: str) -> ParticipantFile:
    """Return a participant of a study.

    Raises:
        UnknownNameError: If the study has no participant of that name.
        DataFileError: If the file cannot be read, or does not fit the plan of the study.
    """
    known = participant_names(study)
    if name not in known:
        raise UnknownNameError("participant", name, known, where=f"study '{study.folder}'")
    path = participant_path(study, name)
    where = f"participant '{path}'"
    text = read_text(path, where, DataFileError, limit=MAX_BYTES)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise DataFileError(f"{where} is not valid JSON: {reason}.") from None
    if not isinstance(content, dict):
        raise DataFileError(f"{where} must be a JSON object.")
    participant = checked(content, ParticipantFile, where, DataFileError)
    if participant.participant != name:
        raise DataFileError(f"{where} is of participant '{participant.participant}'.")
    _check_plan(study, participant, where)
    return participant


def _check_plan(study: Study, participant: ParticipantFile, where: str) -> None:
    """Check that the records are of steps of the study, with valid answers.

    Raises:
        DataFileError: If the order or a step does not fit, or an answer is invalid.
    """
    order = participant.order
    if sorted(order) != sorted(study.conditions):
        raise DataFileError(
            f"{where}: its order is {', '.join(order)}, but the study has the conditions "
            f"{', '.join(study.conditions)}. Was study.yaml changed?"
        )
    steps = {step.key: step for step in steps_of(study, order)}
    for key, record in participant.steps.items():
        if key not in steps:
            raise DataFileError(
                f"{where}: '{key}' is not a step of the study. Was study.yaml changed?"
            )
        step = steps[key]
        if record.run is not None and (step.form is not None or not _is_inside(record.run)):
            raise DataFileError(f"{where}, step '{key}': 'run' must be a file below runs/.")
        if record.answers is not None:
            if step.form is None:
                raise DataFileError(f"{where}, step '{key}': a trial has no answers.")
            form_of(study, participant.participant, order, step).checked(
                record.answers, f"{where}, step '{key}'"
            )


def _is_inside(run: str) -> bool:
    parts = Path(run).parts
    return len(parts) == 2 and parts[0] == "runs" and ".." not in parts


def participant_names(study: Study) -> list[str]:
    """Return the names of all participants, sorted."""
    return sorted(path.stem for path in (study.folder / PARTICIPANTS).glob("*.json"))


def load_participants(study: Study) -> list[ParticipantFile]:
    """Return all participants of a study, sorted by their names."""
    return [load_participant(study, name) for name in participant_names(study)]


def new_participant(study: Study, name: str | None = None) -> ParticipantFile:
    """Add a participant to a study, and return the new file.

    The order is the first of those that the fewest participants have who were not dropped. Without
    dropped participants they therefore take all orders in turn, and who replaces a dropped one
    takes that order.

    Args:
        study: The study.
        name: Name of the participant; None for the next of "P01", "P02", ...

    Raises:
        DataFileError: If the name is invalid, or that of another participant.
        OutputError: If the file cannot be written.
    """
    present = load_participants(study)
    taken = {one.participant.lower() for one in present}
    if name is None:
        number = next(n for n in range(1, len(taken) + 2) if f"p{n:02d}" not in taken)
        name = f"P{number:02d}"
    elif name.lower() in taken:
        raise DataFileError(f"study '{study.folder}' has a participant '{name}' already.")
    orders: tuple[tuple[str, ...], ...] = counterbalanced_orders(study.conditions)
    used = Counter(tuple(one.order) for one in present if one.is_active)
    order = min(orders, key=lambda one: used[one])
    content = {
        "format": "tcs participant",
        "format_version": VERSION,
        "participant": name,
        "order": list(order),
        "created": now(),
    }
    participant = checked(content, ParticipantFile, f"participant '{name}'", DataFileError)
    save_participant(study, participant)
    return participant


def withdraw(study: Study, name: str) -> None:
    """Remove a participant of whom nothing is recorded, so that the name is free again."""
    participant_path(study, name).unlink(missing_ok=True)
    _lock_path(study, name).unlink(missing_ok=True)
    for folder in (PARTICIPANTS, RUNS):
        with suppress(OSError):
            # Files of others may be in the folder.
            (study.folder / folder).rmdir()


def with_record(participant: ParticipantFile, key: str, record: StepRecord) -> ParticipantFile:
    """Return a participant with the record of one more step."""
    return participant.model_copy(update={"steps": {**participant.steps, key: record}})


def answers_record(answers: dict[str, Answer]) -> StepRecord:
    """Return the record of a form."""
    return StepRecord(recorded=now(), answers=answers)


@contextmanager
def exclusive_session(study: Study, name: str) -> Iterator[None]:
    """Prevent two sessions of the same participant at the same time.

    The lock ends with the process, however it ends.

    Raises:
        OutputError: If another process records this participant, or the folder cannot be written.
    """
    path = _lock_path(study, name)
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise OutputError(f"'{path}' cannot be written: {error.strerror}.") from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise OutputError(
                f"participant '{name}' is being recorded by another process. End that one first."
            ) from None
        yield
    finally:
        os.close(handle)


def _lock_path(study: Study, name: str) -> Path:
    return study.folder / PARTICIPANTS / f".{name}.lock"
