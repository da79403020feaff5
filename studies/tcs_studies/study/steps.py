"""The steps of a participant: forms and trials, in order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tcs.model.random_streams import named_generator
from tcs_studies.study.forms import (
    Form,
    background_form,
    difficulty_form,
    laan_form,
    preference_form,
    tlx_pairs_form,
    tlx_ratings_form,
)
from tcs_studies.study.study_file import Study

BACKGROUND, PREFERENCE = "background", "preference"
LAAN, RATINGS, WEIGHTS, DIFFICULTY = "van-der-laan", "tlx-ratings", "tlx-pairs", "difficulty"
"""Names of the forms."""
_PAIRS = 15


@dataclass(frozen=True, slots=True)
class Step:
    """One form, or one trial."""

    condition: str | None
    """Name of the condition; None for the forms at the beginning and the end."""
    form: str | None
    """Name of the form; None for a trial."""
    number: int = 0
    """Number of the trial, from 1."""
    training: bool = False
    """Whether the trial is for training."""

    @property
    def key(self) -> str:
        """Key of the step in the file of a participant, e.g. "novel/trial-1"."""
        name = self.form or f"{'training' if self.training else 'trial'}-{self.number}"
        return name if self.condition is None else f"{self.condition}/{name}"


def steps_of(study: Study, order: Sequence[str]) -> tuple[Step, ...]:
    """Return all steps of a participant with an order of the conditions."""
    plan = study.plan
    steps = [Step(None, BACKGROUND)]
    for condition in order:
        steps += [Step(condition, None, i + 1, True) for i in range(plan.training)]
        steps += [Step(condition, None, i + 1) for i in range(plan.trials)]
        if LAAN in plan.questionnaires:
            steps.append(Step(condition, LAAN))
        if "nasa-tlx" in plan.questionnaires:
            steps.append(Step(condition, RATINGS))
            if plan.tlx_weights == "each" or condition == order[0]:
                steps.append(Step(condition, WEIGHTS))
        if DIFFICULTY in plan.questionnaires:
            steps.append(Step(condition, DIFFICULTY))
    return (*steps, Step(None, PREFERENCE))


def form_of(study: Study, participant: str, order: Sequence[str], step: Step) -> Form:
    """Return the form of a step.

    Args:
        study: The study.
        participant: Name of the participant, on which the order of the pairs of NASA-TLX depends.
        order: Order of the conditions.
        step: A step with a form.
    """
    if step.form == BACKGROUND:
        return background_form()
    if step.form == PREFERENCE:
        return preference_form({name: study.titles[name] for name in order})
    assert step.condition is not None
    title = study.titles[step.condition]
    if step.form == WEIGHTS:
        pairs = named_generator(0, f"{participant}/{step.key}").permutation(_PAIRS)
        return tlx_pairs_form(title, [int(i) for i in pairs])
    return {LAAN: laan_form, RATINGS: tlx_ratings_form, DIFFICULTY: difficulty_form}[
        step.form or ""
    ](title)


def step_text(study: Study, order: Sequence[str], step: Step) -> str:
    """Return a step in words, e.g. "trial 1 of 3 with novel controller (condition 2 of 2)"."""
    if step.condition is None:
        return f"questionnaire '{step.form}'"
    place = f"condition {order.index(step.condition) + 1} of {len(order)}"
    title = study.titles[step.condition]
    if step.form is not None:
        return f"questionnaire '{step.form}' on {title} ({place})"
    count = study.plan.training if step.training else study.plan.trials
    name = "training trial" if step.training else "trial"
    return f"{name} {step.number} of {count} with {title} ({place})"
