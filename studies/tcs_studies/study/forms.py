"""Questionnaires as plain values: their questions, and the check of answers.

A form is filled in on a page or read from a file; both give the same answers, by question. The
wording of scales is that of `tcs_studies.experiment.questionnaires`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from tcs.errors import DataFileError, one_line
from tcs_studies.experiment.questionnaires import LAAN_ITEMS, TLX_DIMENSIONS

Answer = int | str
Answers = Mapping[str, Answer]
MOST_CHARACTERS = 2000
"""Greatest length of a text."""
COMMENTS = "comments"
"""Key of the text at the end of a form."""


@dataclass(frozen=True, slots=True)
class Choice:
    """A question with one answer out of several."""

    key: str
    text: str
    options: tuple[tuple[Answer, str], ...]
    """Values, and their labels."""
    ends: tuple[str, str] | None = None
    """Labels of the first and the last option of a rating scale."""
    required: bool = True
    help: str = ""

    def parse(self, raw: object) -> Answer:
        """Return the value of an option.

        Raises:
            ValueError: If it is not one of the options; with what is allowed.
        """
        for value, _ in self.options:
            if not isinstance(raw, bool) and str(raw) == str(value):
                return value
        values = [str(value) for value, _ in self.options]
        allowed = ", ".join(values)
        if all(isinstance(value, int) for value, _ in self.options):
            allowed = f"{values[0]} to {values[-1]}"
        raise ValueError(f"must be {allowed}")


@dataclass(frozen=True, slots=True)
class Count:
    """A question whose answer is a whole number."""

    key: str
    text: str
    low: int
    high: int
    required: bool = True
    help: str = ""

    def parse(self, raw: object) -> Answer:
        """Return the number.

        Raises:
            ValueError: If it is not a whole number in the range.
        """
        text = "" if isinstance(raw, bool) else str(raw).strip()
        # Ten digits are more than any limit, and fewer than Python's for the length of a number.
        if text.isascii() and text.isdigit() and len(text) <= 10:
            value = int(text)
            if self.low <= value <= self.high:
                return value
        raise ValueError(f"must be a whole number from {self.low} to {self.high}")


@dataclass(frozen=True, slots=True)
class FreeText:
    """A question with a text as its answer."""

    key: str
    text: str
    lines: int = 3
    required: bool = False
    help: str = ""

    def parse(self, raw: object) -> Answer:
        """Return the text without surrounding white space.

        Raises:
            ValueError: If it is no text, or too long.
        """
        if not isinstance(raw, str):
            raise ValueError("must be a text")
        # Browsers end lines with CR LF; other control codes are no text.
        kept = "\n".join(raw.splitlines()).strip()
        kept = "".join(c if c.isprintable() or c == "\n" else " " for c in kept)
        if len(kept) > MOST_CHARACTERS:
            raise ValueError(f"has {len(kept):,} characters; must be {MOST_CHARACTERS:,} at most")
        return kept


Question = Choice | Count | FreeText


@dataclass(frozen=True, slots=True)
class Form:
    """A questionnaire."""

    title: str
    lead: str
    """What the questions are about, in one or two sentences."""
    questions: tuple[Question, ...]

    def faults(self, raw: Mapping[str, object]) -> dict[str, str]:
        """Return what is wrong with answers, by question; empty if nothing is."""
        found: dict[str, str] = {}
        for question in self.questions:
            value = raw.get(question.key)
            if value is None or value == "":
                if question.required:
                    found[question.key] = "is not answered"
                continue
            try:
                question.parse(value)
            except ValueError as error:
                found[question.key] = f"is '{one_line(str(value), 40)}'; {error}"
        known = [question.key for question in self.questions]
        for key in raw:
            if key not in known:
                listed = ", ".join(known)
                found[str(key)] = f"is not a question of this form; these are: {listed}"
        return found

    def checked(self, raw: Mapping[str, object], where: str) -> dict[str, Answer]:
        """Return valid answers in the order of the questions, without empty ones.

        Args:
            raw: Answers by question, as texts of a page or values of a file.
            where: Name of the form in messages.

        Raises:
            DataFileError: If an answer is missing or invalid.
        """
        for key, fault in self.faults(raw).items():
            raise DataFileError(f"{where}: '{one_line(key)}' {fault}.")
        answers = {
            question.key: question.parse(raw[question.key])
            for question in self.questions
            if raw.get(question.key) not in (None, "")
        }
        return {key: value for key, value in answers.items() if value != ""}


_DIMENSION_TEXTS = {
    "mental demand": "How much thinking, deciding, remembering or watching did it take?",
    "physical demand": "How much physical activity, such as pushing or turning, did it take?",
    "temporal demand": "How much time pressure did you feel?",
    "performance": "How well did you do what was required?",
    "effort": "How hard did you have to work, mentally and physically, for that result?",
    "frustration": "How insecure, discouraged, irritated or stressed did you feel?",
}
_LOW_HIGH = ("very low", "very high")
_STEPS = 20
PAIR = " or "
"""Between the two dimensions in the key of a pair."""


def background_form() -> Form:
    """Return the questions at the beginning; each may be left open."""
    experience = ("none", "some", "much")
    return Form(
        "About you",
        "You may leave any of these questions open. No name is stored.",
        (
            Count("age", "Your age in years", 16, 120, required=False),
            FreeText("gender", "Your gender, in your own words", lines=1),
            Choice(
                "experience",
                "Your experience with teleoperated robots",
                tuple((one, one) for one in experience),
                required=False,
            ),
        ),
    )


def laan_form(condition: str) -> Form:
    """Return van der Laan's questionnaire about a condition.

    Args:
        condition: Its title.

    Source:
        Null-space paper, van der Laan questionnaire: nine scales with five boxes, and comments.
    """
    items = tuple(
        Choice(
            f"{left} - {right}",
            f"{left} – {right}",
            tuple((tick, str(tick)) for tick in range(1, 6)),
            ends=(left, right),
        )
        for left, right in LAAN_ITEMS
    )
    return Form(
        "Acceptance",
        f"Your judgement of moving the arm with: {condition}. Mark one box in every line; the "
        "nearer it is to a word, the better the word fits.",
        (*items, FreeText(COMMENTS, "Comments on this controller, if you have any")),
    )


def tlx_ratings_form(condition: str) -> Form:
    """Return the six ratings of NASA-TLX about a condition.

    Args:
        condition: Its title.
    """
    ratings = tuple(
        Choice(
            name,
            name.capitalize(),
            tuple((step, str(step)) for step in range(_STEPS + 1)),
            ends=("perfect", "failure") if name == "performance" else _LOW_HIGH,
            help=_DIMENSION_TEXTS[name],
        )
        for name in TLX_DIMENSIONS
    )
    return Form(
        "Workload: ratings",
        f"The task with: {condition}. Mark one number from 0 to {_STEPS} on each scale.",
        ratings,
    )


def tlx_pairs_form(condition: str, order: Sequence[int] = ()) -> Form:
    """Return the 15 pairs of dimensions of NASA-TLX about a condition.

    Args:
        condition: Its title.
        order: Order of the pairs, a permutation of 0 to 14; empty for that of the dimensions.
    """
    pairs = list(combinations(TLX_DIMENSIONS, 2))
    return Form(
        "Workload: comparisons",
        f"The task with: {condition}. In each pair, choose what contributed more to the workload.",
        tuple(
            Choice(
                PAIR.join(pairs[i]),
                f"{pairs[i][0].capitalize()} or {pairs[i][1]}?",
                tuple((name, name) for name in pairs[i]),
            )
            for i in order or range(len(pairs))
        ),
    )


def difficulty_form(condition: str) -> Form:
    """Return the thesis's statement on the difficulty, about a condition.

    Args:
        condition: Its title.

    Source:
        ITCM thesis, section III.C.4: agreement to a statement. In Appendix J participants may give
        any positive number, without a scale; here there are five steps.
    """
    labels = ("strongly disagree", "disagree", "neither", "agree", "strongly agree")
    return Form(
        "Difficulty",
        f"The task with: {condition}.",
        (
            Choice(
                "difficulty",
                "“It was difficult to execute the task.”",
                tuple(enumerate(labels, start=1)),
            ),
            FreeText(COMMENTS, "What made it easy or difficult?"),
        ),
    )


def preference_form(conditions: Mapping[str, str]) -> Form:
    """Return the question for the preferred condition, at the end.

    Args:
        conditions: Titles of the conditions by name, in the participant's order.

    Source:
        Null-space paper, section II.C.5: one question, without ties.
    """
    options = tuple(
        (name, f"{title} (number {place})")
        for place, (name, title) in enumerate(conditions.items(), start=1)
    )
    return Form(
        "Preference",
        "You have completed all trials.",
        (
            Choice("preferred", "Which one do you prefer for this task?", options),
            FreeText(COMMENTS, "Why?"),
        ),
    )


def laan_ticks(answers: Answers) -> list[int]:
    """Return the nine ticks of van der Laan's questionnaire, 1 to 5."""
    return [int(answers[f"{left} - {right}"]) for left, right in LAAN_ITEMS]


def tlx_weights(answers: Answers) -> dict[str, int]:
    """Return how often each dimension of NASA-TLX was chosen in its pairs."""
    chosen = list(answers.values())
    return {name: chosen.count(name) for name in TLX_DIMENSIONS}
