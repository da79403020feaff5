"""One participant's session: the next step, and its record, saved as soon as there is one."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from threading import Lock

from tcs.errors import DataFileError
from tcs.files.documents import read_mapping
from tcs.files.reading import read_bytes
from tcs.files.writing import make_folder, whole_file
from tcs.teleop.runs.run import Run
from tcs.teleop.runs.run_files import MAX_BYTES, load_run, save_run
from tcs_studies.experiment.trial import TrialMeasures
from tcs_studies.study.forms import Form
from tcs_studies.study.participants import (
    ParticipantFile,
    StepRecord,
    answers_record,
    checked_reason,
    load_participants,
    now,
    save_participant,
    with_record,
)
from tcs_studies.study.steps import Step, form_of, step_text, steps_of
from tcs_studies.study.study_file import RUNS, Study
from tcs_studies.study.trials import check_run, trial_measures


class StudyRecording:
    """Recorder of the steps of a participant; every record is on the disk when a method returns.

    Attributes:
        study: The study.
    """

    def __init__(self, study: Study, participant: ParticipantFile) -> None:
        """Continue a participant after the last record.

        Args:
            study: The study.
            participant: The participant, as on the disk.

        Raises:
            DataFileError: If the participant was dropped.
        """
        if not participant.is_active:
            raise DataFileError(
                f"participant '{participant.participant}' was dropped: {participant.dropped}."
            )
        self.study = study
        self._participant = participant
        # Pages are filled in on other threads.
        self._lock = Lock()

    @property
    def participant(self) -> ParticipantFile:
        """The participant with all records."""
        return self._participant

    @property
    def next_step(self) -> Step | None:
        """The first step without a record; None after the last one."""
        return next(iter(self._participant.open_steps(self.study)), None)

    def progress(self) -> tuple[int, int]:
        """Return the numbers of recorded steps and of all steps."""
        total = len(steps_of(self.study, self._participant.order))
        return total - len(self._participant.open_steps(self.study)), total

    def text(self, step: Step) -> str:
        """Return a step in words."""
        return step_text(self.study, self._participant.order, step)

    def form(self, step: Step) -> Form:
        """Return the form of a step."""
        one = self._participant
        return form_of(self.study, one.participant, one.order, step)

    def attach_run(self, path: Path) -> TrialMeasures:
        """Record a run file as the next trial: check it, and copy it into the study.

        Args:
            path: A run that `tcs teleop --line --save` wrote.

        Returns:
            The measures of the trial.

        Raises:
            DataFileError: If the next step is not a trial, the file cannot be read, it is not a run
                of that trial, or it is the run of another trial.
            OutputError: If a file cannot be written.
        """
        step = self._next_trial()
        run = load_run(path)
        check_run(self.study, step, run, f"run '{path}'")
        content = read_bytes(path, f"run '{path}'", DataFileError, limit=MAX_BYTES)
        self._refuse_copies(hashlib.sha256(content).hexdigest(), path)
        name = self._run_name(step, path.suffix)
        with whole_file(self._run_path(name), "Run") as stream:
            stream.write(content)
        self._record_run(step, name, content)
        return trial_measures(self.study, run)

    def record_run(self, run: Run) -> TrialMeasures:
        """Record a run as the next trial.

        Args:
            run: A run that was just driven.

        Returns:
            The measures of the trial.

        Raises:
            DataFileError: If the next step is not a trial, or the run is not of that trial.
            OutputError: If a file cannot be written.
        """
        step = self._next_trial()
        check_run(self.study, step, run, "the run")
        name = self._run_name(step, ".csv")
        path = self._run_path(name)
        save_run(path, run)
        content = read_bytes(path, f"run '{path}'", DataFileError, limit=MAX_BYTES)
        self._record_run(step, name, content)
        return trial_measures(self.study, run)

    def save_answers(self, step: Step, raw: Mapping[str, object]) -> bool:
        """Record the answers of a form.

        Args:
            step: The step with the form.
            raw: Answers by question.

        Returns:
            Whether they were recorded; False if the form has a record, which is kept.

        Raises:
            DataFileError: If an answer is missing or invalid, or an earlier step has no record.
            OutputError: If the file cannot be written.
        """
        with self._lock:
            if step.key in self._participant.steps:
                return False
            if step != self.next_step:
                raise DataFileError(f"step '{step.key}' is not the next one of the participant.")
            answers = self.form(step).checked(raw, f"questionnaire '{step.key}'")
            self._save(step, answers_record(answers))
            return True

    def skip(self, reason: str) -> Step:
        """Record that there will be nothing for the next step, and return the step.

        Raises:
            DataFileError: If all steps are recorded, or the reason is blank or too long.
            OutputError: If the file cannot be written.
        """
        step = self.next_step
        if step is None:
            raise DataFileError(f"participant '{self._participant.participant}' has no step left.")
        self._save(step, StepRecord(recorded=now(), missing=checked_reason(reason)))
        return step

    def drop(self, reason: str) -> None:
        """Leave the participant out of the results; the records stay.

        Raises:
            DataFileError: If the reason is blank or too long.
            OutputError: If the file cannot be written.
        """
        dropped = self._participant.model_copy(update={"dropped": checked_reason(reason)})
        save_participant(self.study, dropped)
        self._participant = dropped

    def _next_trial(self) -> Step:
        step = self.next_step
        if step is None or step.form is not None:
            due = "nothing: all steps are recorded" if step is None else self.text(step)
            raise DataFileError(
                f"participant '{self._participant.participant}': no trial is due. Next: {due}."
            )
        return step

    def _run_name(self, step: Step, suffix: str) -> str:
        key = step.key.replace("/", "-")
        return f"{RUNS}/{self._participant.participant}-{key}{suffix}"

    def _run_path(self, name: str) -> Path:
        make_folder(self.study.folder / RUNS)
        return self.study.folder / name

    def _record_run(self, step: Step, name: str, content: bytes) -> None:
        digest = hashlib.sha256(content).hexdigest()
        self._save(step, StepRecord(recorded=now(), run=name, sha256=digest))

    def _refuse_copies(self, digest: str, path: Path) -> None:
        """Refuse a run file that is the run of another trial.

        Raises:
            DataFileError: If it is.
        """
        for other in load_participants(self.study):
            for key, record in other.steps.items():
                if record.sha256 == digest:
                    raise DataFileError(
                        f"run '{path}' is already that of {other.participant}, {key}. Give the run "
                        "of the next trial."
                    )

    def _save(self, step: Step, record: StepRecord) -> None:
        changed = with_record(self._participant, step.key, record)
        save_participant(self.study, changed)
        self._participant = changed


def load_answers(recording: StudyRecording, path: Path) -> dict[str, dict[str, object]]:
    """Return the answers of a participant's forms in a YAML or JSON file.

    The file maps the key of each form, such as `novel/van-der-laan`, to its answers by question.

    Args:
        recording: The session of the participant.
        path: The file.

    Returns:
        Answers by key of the form, valid for the forms of the participant.

    Raises:
        DataFileError: If the file cannot be read, or a form or an answer in it is invalid.
    """
    where = f"answers '{path}'"
    order = recording.participant.order
    forms = {one.key: one for one in steps_of(recording.study, order) if one.form is not None}
    content = read_mapping(path, where, DataFileError, known=forms)
    for key, answers in content.items():
        if key not in forms:
            raise DataFileError(
                f"{where}: '{key}' is not a questionnaire of "
                f"'{recording.participant.participant}'. These are: {', '.join(forms)}."
            )
        if not isinstance(answers, dict):
            raise DataFileError(f"{where}, '{key}': must map questions to answers.")
        recording.form(forms[key]).checked(answers, f"{where}, '{key}'")
    return content
