"""Answers in a file: those of a form on paper, or of another program."""

from __future__ import annotations

from pathlib import Path

from tcs.errors import DataFileError
from tcs.files.documents import read_mapping
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.steps import steps_of


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
