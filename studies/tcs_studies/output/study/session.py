"""A participant's session: each step in turn, by the live page, run files, pages or answers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tcs.errors import DataFileError, TcsError
from tcs.teleop.runs.run_files import load_run
from tcs_studies.experiment.trial import TrialMeasures
from tcs_studies.output.study.server import FormServer
from tcs_studies.output.words import trial_words
from tcs_studies.study.participants import (
    ParticipantFile,
    exclusive_session,
    load_participant,
    load_participants,
    new_participant,
    participant_names,
    withdraw,
)
from tcs_studies.study.recording import StudyRecording, load_answers
from tcs_studies.study.steps import Step
from tcs_studies.study.study_file import Study, load_study

if TYPE_CHECKING:
    from tcs_studies.output.study.trial_session import TrialSession

Report = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """Records that need neither the live page nor a form in the browser."""

    runs: tuple[Path, ...] = ()
    """Run files of the next trials."""
    answers: Path | None = None
    """File with answers."""

    @property
    def is_empty(self) -> bool:
        """Whether trials are driven and forms are filled in here."""
        return not self.runs and self.answers is None


@dataclass(frozen=True, slots=True, kw_only=True)
class Screen:
    """How pages are opened and announced.

    Attributes:
        show: Called with the address of each page that is opened.
        note: Called with lines that are not results.
        port: Port of the first page; None for free ones.
        duration: Longest wait for a trial or a form [s]; None to wait until interrupted.
    """

    show: Report
    note: Report
    port: int | None = None
    duration: float | None = None


@contextmanager
def open_session(
    folder: Path, name: str | None, *, new: bool, given: Given, report: Report
) -> Iterator[StudySession]:
    """Open the session of a participant, which no other process can open meanwhile.

    A participant who is new is withdrawn if the session is refused before anything is recorded.

    Args:
        folder: Folder of the study.
        name: Name of the participant; None for the unfinished one, or a new one if there is none.
        new: Whether to add a participant.
        given: Run files and answers.
        report: Called with lines that are results.

    Raises:
        DataFileError: If a file of the study is invalid, or several participants are unfinished.
        UnknownNameError: If there is no participant of that name.
        OutputError: If the participant is recorded by another process.
    """
    study = load_study(folder)
    before = participant_names(study)
    participant = _participant(study, name, new=new)
    with exclusive_session(study, participant.participant):
        # Another process may have recorded steps until now.
        present = load_participant(study, participant.participant)
        session = StudySession(StudyRecording(study, present), given, report)
        try:
            yield session
        except TcsError:
            if session.is_untouched and session.name not in before:
                withdraw(study, session.name)
            raise
        finally:
            session.close()


def _participant(study: Study, name: str | None, *, new: bool) -> ParticipantFile:
    """Return the participant of a session.

    Raises:
        DataFileError: If no name is given, and several participants are unfinished.
        UnknownNameError: If there is no participant of that name.
    """
    if new:
        return new_participant(study, name)
    if name is not None:
        return load_participant(study, name)
    unfinished = [
        one for one in load_participants(study) if one.is_active and one.open_steps(study)
    ]
    if len(unfinished) > 1:
        names = ", ".join(one.participant for one in unfinished)
        raise DataFileError(
            f"unfinished participants: {names}. Name one with --participant, or begin another one "
            "with --new."
        )
    return unfinished[0] if unfinished else new_participant(study)


class StudySession:
    """Session of one participant."""

    def __init__(self, recording: StudyRecording, given: Given, report: Report) -> None:
        """Prepare a session.

        Args:
            recording: The records of the participant.
            given: Run files and answers.
            report: Called with lines that are results.
        """
        self._recording, self._given, self._report = recording, given, report
        self._forms: FormServer | None = None
        self._trials: tuple[str, TrialSession] | None = None

    @property
    def name(self) -> str:
        """Name of the participant."""
        return self._recording.participant.participant

    @property
    def is_untouched(self) -> bool:
        """Whether nothing has been recorded of the participant."""
        participant = self._recording.participant
        return participant.is_active and not participant.steps

    def close(self) -> None:
        """Stop the server of the forms, and that of the live page."""
        self._close_trials()
        if self._forms is not None:
            self._forms.finish()
            self._forms.close()
            self._forms = None

    def drop(self, reason: str) -> None:
        """Leave the participant out of the results."""
        self._recording.drop(reason)
        self._report(f"{self.name}: dropped. The records stay; `tcs study report` leaves them out.")

    def skip(self, reason: str) -> None:
        """Record that there will be nothing for the next step."""
        step = self._recording.skip(reason)
        self._report(f"{self.name}: {self._recording.text(step)}: missing, {reason}.")
        self._report_next()

    def record(self, screen: Screen) -> None:
        """Record step by step, until all are recorded or one needs what is not given.

        Raises:
            DataFileError: If a given file is invalid, or does not belong to the step that is due.
            OutputError: If a file cannot be written, or a port cannot be used.
        """
        recording, given = self._recording, self._given
        order = ", ".join(recording.study.titles[one] for one in recording.participant.order)
        self._report(f"{self.name}: {order}")
        answers = None if given.answers is None else load_answers(recording, given.answers)
        for path in given.runs:
            # Refused before a page is opened.
            load_run(path)
        runs = deque(given.runs)
        while (step := recording.next_step) is not None:
            if step.form is None and runs:
                self._report_trial(step, recording.attach_run(runs.popleft()))
            elif step.form is None:
                if not given.is_empty or not self._drive(step, screen):
                    break
            elif answers is not None:
                if step.key not in answers:
                    break
                recording.save_answers(step, answers[step.key])
                self._report(f"{recording.text(step)}: saved")
            elif not self._fill_in(step, screen):
                break
        if runs:
            # Raises: no trial is due.
            recording.attach_run(runs.popleft())
        self._report_next()

    def _drive(self, step: Step, screen: Screen) -> bool:
        """Record a trial in the live page; return whether there is one."""
        from tcs_studies.output.study.trial_session import TrialSession

        study, condition = self._recording.study, step.condition or ""
        if not self._is_driven_here(step):
            return False
        if self._trials is None or self._trials[0] != condition:
            # The page of the condition before is closed first: its port is free again.
            self._close_trials()
            session = TrialSession(study, condition, port=screen.port, on_stop=screen.note)
            self._trials = condition, session
            screen.show(session.url)
        screen.note(
            f"{self._recording.text(step)}: move the tool from the green to the red sphere."
        )
        run = self._trials[1].run(screen.duration)
        if run is None:
            screen.note("the trial did not end before the time was over, and is not recorded.")
            return False
        self._report_trial(step, self._recording.record_run(run))
        return True

    def _close_trials(self) -> None:
        if self._trials is not None:
            self._trials[1].close()
        self._trials = None

    def _fill_in(self, step: Step, screen: Screen) -> bool:
        """Wait until a form is filled in; return whether it is."""
        if self._forms is None:
            live = self._given.is_empty
            port = None if live and self._trials is not None else screen.port
            self._forms = FormServer(self._recording, port=port, refresh=live)
            screen.show(self._forms.url)
        screen.note(f"{self._recording.text(step)}: due on the page {self._forms.url}")
        if not self._forms.wait(step, screen.duration):
            screen.note("the questionnaire was not filled in before the time was over.")
            return False
        record = self._recording.participant.steps[step.key]
        self._report(f"{self._recording.text(step)}: {len(record.answers or {})} answers saved")
        return True

    def _report_trial(self, step: Step, measures: TrialMeasures) -> None:
        time_limit = self._recording.study.plan.time_limit
        self._report(f"{self._recording.text(step)}: {trial_words(measures, time_limit)}")

    def _is_driven_here(self, step: Step) -> bool:
        return self._recording.study.condition(step.condition or "").limits is not None

    def _report_next(self) -> None:
        done, total = self._recording.progress()
        step = self._recording.next_step
        if step is None:
            self._report(f"{self.name}: all {total} steps are recorded")
            return
        text = self._recording.text(step)
        if step.form is None and not self._is_driven_here(step):
            text += "; give its run file with --run"
        self._report(f"{self.name}: {done} of {total} steps; next: {text}")
