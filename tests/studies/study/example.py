"""A small study, its runs and answers; the line is given, as its search takes a second."""

from __future__ import annotations

import numpy as np

from tcs.teleop.runs.run import NO_GROUP, Run
from tcs_studies.study.participants import new_participant
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.steps import steps_of
from tcs_studies.study.study_file import StudyFile, create_study

LINE = {
    "start": (0.5, 0.1, 0.7),
    "end": (0.0, 0.3, 0.7),
    "joints": (-0.2, 1.4, 0.4, -1.1, 0.4, 1.5, -1.9),
    "blocking_joint": 4,
}


def small_study(folder, *, names=("end-effector", "novel"), **changes):
    """A study in a folder with one training trial and one trial for each condition."""
    plan = {
        "format_version": 1,
        "title": "Small study",
        "robot": "iiwa7",
        "torso_height": 0.0,
        "line": LINE,
        "conditions": [
            {"name": one, "title": f"{one} control", "limits": "paper"} for one in names
        ],
        "training": 1,
        "trials": 1,
        "participants": 4,
    }
    return create_study(folder, StudyFile.model_validate({**plan, **changes}))


def run_on(study, condition, /, *, seconds=3.0, off=0.01, seed=0, reached=1.0, **metadata):
    """A run along the line of a study, `off` metres beside it, to a fraction of its length."""
    rng = np.random.default_rng(seed)
    n = round(seconds * 50)
    # The first second is before the first command.
    going = np.clip((np.arange(n) - 50) / (n - 51), 0.0, None) * reached
    velocity = (
        np.diff(going, append=going[-1])[:, None]
        * 50
        * (np.subtract(study.line.end, study.line.start))
    )
    # The hand trembles once it moves.
    jitter = rng.normal(scale=1e-3, size=(n, 3)) * (going > 0.0)[:, None]
    above = np.where((going > 0.0) & (going < 0.9), off, 0.0)
    position = study.line.at(going) + above[:, None] * [0, 0, 1]
    joints = np.array(LINE["joints"]) + going[:, None] * 0.1
    rates = np.diff(joints, axis=0, prepend=joints[:1]) * 50
    return Run(
        tuple(f"iiwa_joint_{i}" for i in range(1, 8)),
        time=np.arange(n) / 50.0,
        joints=joints,
        rates=rates,
        position=position,
        quaternion=np.tile([1.0, 0, 0, 0], (n, 1)),
        linear=velocity + jitter,
        angular=np.zeros((n, 3)),
        group=np.full(n, NO_GROUP),
        sign=np.zeros(n, dtype=np.int64),
        clutch=np.zeros(n, dtype=bool),
        mode=np.full(n, "end-effector"),
        limits=np.zeros((n, 7), dtype=np.int64),
        singular=np.zeros(n, dtype=bool),
        stopped=np.zeros(n, dtype=bool),
        metadata={
            "robot": study.plan.robot,
            "condition": condition,
            "limits": "paper",
            "operator_type": "live",
            "line_start": list(study.line.start),
            "line_end": list(study.line.end),
            **metadata,
        },
    )


def answers_to(form, place=0):
    """Answers of a form: the option or number at a place, and no texts."""
    found = {}
    for question in form.questions:
        if hasattr(question, "options"):
            found[question.key] = question.options[place % len(question.options)][0]
        elif hasattr(question, "low"):
            found[question.key] = question.low + place
    return found


def complete(study, place=0, *, omit=()):
    """A participant with all steps, whose answers and errors depend on `place`."""
    recording = StudyRecording(study, new_participant(study))
    for step in steps_of(study, recording.participant.order):
        if step.key in omit:
            recording.skip("omitted")
        elif step.form is None:
            worse = 1 + (step.condition == "end-effector")
            recording.record_run(
                run_on(study, step.condition, off=1e-3 * (place + 5) * worse, seed=place,
                       seconds=2.5 + 0.1 * place * worse)
            )  # fmt: skip
        else:
            recording.save_answers(step, answers_to(recording.form(step), place))
    return recording
