"""Results of a study: the measures of all trials and the scores of all questionnaires."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tcs.errors import DataFileError
from tcs.files.reading import read_bytes
from tcs.kernel.arrays import FloatArray
from tcs.teleop.runs.run_files import MAX_BYTES, load_run
from tcs_studies.experiment.comparison import Comparison
from tcs_studies.experiment.questionnaires import van_der_laan, weighted_workload
from tcs_studies.experiment.trial import MEASURES, TrialMeasures, sampled_path
from tcs_studies.experiment.within_subject import LEARNING
from tcs_studies.study.forms import Answer, laan_ticks, tlx_weights
from tcs_studies.study.participants import ParticipantFile, load_participants
from tcs_studies.study.steps import (
    BACKGROUND,
    DIFFICULTY,
    LAAN,
    PREFERENCE,
    RATINGS,
    WEIGHTS,
    Step,
    steps_of,
)
from tcs_studies.study.study_file import Study
from tcs_studies.study.trials import attempt_of, is_scripted, trial_measures

OnProgress = Callable[[int, int], None]
SCORES = ("usefulness", "satisfaction", "workload", "difficulty")
"""Scores of the questionnaires after a condition."""


@dataclass(frozen=True, eq=False)
class TrialResult:
    """A trial that counts, or one of training."""

    participant: str
    step: Step
    place: int
    """Position of the condition in the participant's order, from 1."""
    measures: TrialMeasures
    path: FloatArray
    """Path of the tool [m], shape (k, 3)."""
    is_scripted: bool
    """Whether the operator was scripted, in a rehearsal of the study."""


@dataclass(frozen=True, eq=False)
class StudyResults:
    """What the tables and pictures of a study are made from."""

    study: Study
    participants: tuple[ParticipantFile, ...]
    """All participants, also those that are left out."""
    included: tuple[ParticipantFile, ...]
    """Participants with a record in every step who were not dropped."""
    trials: tuple[TrialResult, ...]
    """Trials of the included participants that have a run."""
    comparison: Comparison
    """Values by measure and condition, in the order of `included`."""
    notes: tuple[str, ...]
    """What is left out or missing, one sentence each."""

    def form_answers(self, participant: ParticipantFile, key: str) -> dict[str, Answer]:
        """Return the answers of a form; empty if it was not filled in."""
        record = participant.steps.get(key)
        return {} if record is None or record.answers is None else dict(record.answers)

    def preferred(self) -> Counter[str]:
        """Return how many of the included participants prefer each condition."""
        answers = (self.form_answers(one, PREFERENCE) for one in self.included)
        return Counter(str(one["preferred"]) for one in answers if one)

    def ages(self) -> FloatArray:
        """Return the ages of the included participants that gave it [years]."""
        answers = (self.form_answers(one, BACKGROUND) for one in self.included)
        return np.array([one["age"] for one in answers if "age" in one], dtype=np.float64)


def study_results(study: Study, *, on_progress: OnProgress | None = None) -> StudyResults:
    """Return the results of a study: those of all participants with a record in every step.

    Args:
        study: The study.
        on_progress: Called with the numbers of participants read and in total.

    Raises:
        DataFileError: If the file of a participant is invalid, or no participant is complete.
    """
    participants = load_participants(study)
    included = [one for one in participants if one.is_active and not one.open_steps(study)]
    notes = _left_out(study, participants)
    if not included:
        reason = " ".join(notes) or "It has no participants."
        raise DataFileError(f"study '{study.folder}': no complete participant to report. {reason}")
    trials: list[TrialResult] = []
    for number, participant in enumerate(included, start=1):
        found, faults = _trials(study, participant)
        trials += found
        notes += faults
        if on_progress is not None:
            on_progress(number, len(included))
    notes += _balance(study, included)
    scripted = any(one.is_scripted for one in trials)
    operators = f"{len(included)} participants" if len(included) > 1 else "1 participant"
    if scripted:
        operators += ", with runs of scripted operators"
        notes.append(_scripted(trials))
    comparison = Comparison(
        titles=study.titles,
        values=_values(study, included, trials),
        operators=operators,
        learning=_learning(study, included, trials),
        training=study.plan.training,
    )
    return StudyResults(
        study, tuple(participants), tuple(included), tuple(trials), comparison, tuple(notes)
    )


def _left_out(study: Study, participants: Sequence[ParticipantFile]) -> list[str]:
    """Return who is left out, and why."""
    notes = []
    for one in participants:
        total = len(steps_of(study, one.order))
        open_steps = len(one.open_steps(study))
        if not one.is_active:
            notes.append(f"{one.participant} was dropped and is left out: {one.dropped}.")
        elif open_steps:
            notes.append(
                f"{one.participant} is left out: {total - open_steps} of {total} steps are "
                "recorded."
            )
    return notes


def _trials(study: Study, participant: ParticipantFile) -> tuple[list[TrialResult], list[str]]:
    """Return the trials of a participant, and what is missing."""
    found, notes = [], []
    for step in steps_of(study, participant.order):
        record, where = participant.steps[step.key], f"{participant.participant}, {step.key}"
        if record.missing is not None:
            notes.append(f"{where} is missing: {record.missing}.")
        if record.run is None:
            continue
        path = study.folder / record.run
        try:
            content = read_bytes(path, f"run '{path}'", DataFileError, limit=MAX_BYTES)
            if hashlib.sha256(content).hexdigest() != record.sha256:
                raise DataFileError(f"run '{path}' is not the file that was recorded")
            run = load_run(path)
            measures = trial_measures(study, run)
        except DataFileError as error:
            notes.append(f"{where} is missing: {str(error).rstrip('.')}.")
            continue
        attempt = attempt_of(run, study.course, study.plan.time_limit)
        place = participant.order.index(step.condition or "") + 1
        found.append(
            TrialResult(
                participant.participant, step, place, measures, sampled_path(attempt),
                is_scripted(run),
            )
        )  # fmt: skip
    return found, notes


def _balance(study: Study, included: Sequence[ParticipantFile]) -> list[str]:
    """Return a note if the orders of the conditions are not equally frequent."""
    used = Counter(" - ".join(one.order) for one in included)
    possible = len({*used}) if len(study.conditions) > 2 else 2
    if len({*used.values()}) == 1 and len(used) == possible:
        return []
    listed = ", ".join(f"{order}: {count}" for order, count in sorted(used.items()))
    return [f"Orders of the conditions are not equally frequent: {listed}."]


def _scripted(trials: Sequence[TrialResult]) -> str:
    names = ", ".join(sorted({one.participant for one in trials if one.is_scripted}))
    return f"Runs of scripted operators, not people, are those of: {names}."


def _values(
    study: Study, included: Sequence[ParticipantFile], trials: Sequence[TrialResult]
) -> dict[str, dict[str, FloatArray]]:
    """Return the value of each participant by measure and condition; NaN where there is none."""
    values: dict[str, dict[str, FloatArray]] = {}
    for name in MEASURES:
        values[name] = {}
        for condition in study.conditions:
            column = []
            for one in included:
                counted = [
                    getattr(trial.measures, name)
                    for trial in trials
                    if trial.participant == one.participant
                    and trial.step.condition == condition
                    and not trial.step.training
                ]
                column.append(np.mean(counted) if counted else np.nan)
            values[name][condition] = np.array(column)
    scores = [questionnaire_scores(study, one) for one in included]
    taken = {
        "usefulness": LAAN in study.plan.questionnaires,
        "satisfaction": LAAN in study.plan.questionnaires,
        "workload": "nasa-tlx" in study.plan.questionnaires,
        "difficulty": DIFFICULTY in study.plan.questionnaires,
    }
    for name in SCORES:
        if taken[name]:
            values[name] = {
                condition: np.array([one.get((condition, name), np.nan) for one in scores])
                for condition in study.conditions
            }
    return values


def questionnaire_scores(
    study: Study, participant: ParticipantFile
) -> dict[tuple[str, str], float]:
    """Return the scores of a participant's questionnaires by condition and name of `SCORES`."""
    scores: dict[tuple[str, str], float] = {}

    def answers(condition: str, form: str) -> Mapping[str, Answer] | None:
        record = participant.steps.get(f"{condition}/{form}")
        return None if record is None else record.answers

    for condition in participant.order:
        laan = answers(condition, LAAN)
        if laan is not None:
            acceptance = van_der_laan(laan_ticks(laan))
            scores[condition, "usefulness"] = acceptance.usefulness
            scores[condition, "satisfaction"] = acceptance.satisfaction
        is_once = study.plan.tlx_weights == "once"
        weighed = answers(participant.order[0] if is_once else condition, WEIGHTS)
        ratings = answers(condition, RATINGS)
        if ratings is not None and weighed is not None:
            rated = {name: int(value) for name, value in ratings.items()}
            scores[condition, "workload"] = weighted_workload(rated, tlx_weights(weighed))
        difficulty = answers(condition, DIFFICULTY)
        if difficulty is not None:
            scores[condition, "difficulty"] = float(difficulty["difficulty"])
    return scores


def _learning(
    study: Study, included: Sequence[ParticipantFile], trials: Sequence[TrialResult]
) -> dict[str, dict[str, FloatArray]]:
    """Return the measures of `LEARNING` of each trial, training first."""
    rows = {one.participant: row for row, one in enumerate(included)}
    plan = study.plan
    found: dict[str, dict[str, FloatArray]] = {}
    for name in LEARNING:
        found[name] = {
            condition: np.full((len(included), plan.training + plan.trials), np.nan)
            for condition in study.conditions
        }
        for trial in trials:
            step = trial.step
            column = step.number - 1 + (0 if step.training else plan.training)
            table = found[name][step.condition or ""]
            table[rows[trial.participant], column] = getattr(trial.measures, name)
    return found
