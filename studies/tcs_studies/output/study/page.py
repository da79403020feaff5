"""A form as one HTML page: labels, keyboard, large targets, no script and nothing from elsewhere.

Scales are radio buttons: arrow keys move between their steps, no step is marked beforehand, and the
browser itself reports one that is left open.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from importlib.resources import files

from tcs_studies.study.forms import Choice, Count, Form, FreeText, Question

_ROW = 7
"""Greatest number of boxes of a scale that are not numbered, as on paper."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Filled:
    """Content of the fields of a form, and what is wrong with it."""

    values: Mapping[str, str]
    """Texts by question."""
    faults: Mapping[str, str]
    """Messages by question."""
    message: str = ""
    """What went wrong apart from the answers, such as a full disk."""


EMPTY = Filled(values={}, faults={})


def form_page(form: Form, *, step: str, heading: str, filled: Filled = EMPTY) -> str:
    """Return the page of a form.

    Args:
        form: The form.
        step: Key of the step, which the answers are sent with.
        heading: Participant and progress, above the title.
        filled: Content of the fields.
    """
    questions = "\n".join(
        _question(i, question, filled) for i, question in enumerate(form.questions)
    )
    body = (
        f"{_summary(form, filled)}\n<p class='lead'>{escape(form.lead)}</p>\n"
        f'<form method="post" action="" accept-charset="utf-8">\n'
        f'<input type="hidden" name="step" value="{escape(step)}">\n{questions}\n'
        '<p><button type="submit">Save and continue</button></p>\n</form>'
    )
    return _document(form.title, heading, body)


def text_page(title: str, text: str, *, heading: str = "", refresh: int | None = None) -> str:
    """Return a page without fields.

    Args:
        title: Its title.
        text: One paragraph.
        heading: Participant and progress, above the title.
        refresh: Seconds after which the page is loaded again; None for never.
    """
    return _document(title, heading, f'<p class="lead">{escape(text)}</p>', refresh)


def field_name(number: int) -> str:
    """Return the name of the field of a question, counted from 0."""
    return f"q{number}"


def _document(title: str, heading: str, body: str, refresh: int | None = None) -> str:
    style = files("tcs_studies.output.study").joinpath("form.css").read_text(encoding="utf-8")
    again = "" if refresh is None else f'<meta http-equiv="refresh" content="{refresh}">\n'
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'{again}<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n'
        f"<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        f'<p class="heading">{escape(heading)}</p>\n<h1>{escape(title)}</h1>\n{body}\n'
        "</main>\n</body>\n</html>\n"
    )


def _summary(form: Form, filled: Filled) -> str:
    """Return the list of faults at the top of the page, with links to the questions."""
    items = [
        f'<li><a href="#{field_name(i)}">{escape(one.text)}</a> {escape(filled.faults[one.key])}'
        for i, one in enumerate(form.questions)
        if one.key in filled.faults
    ]
    keys = {one.key for one in form.questions}
    items += [f"<li>{escape(fault)}" for key, fault in filled.faults.items() if key not in keys]
    if filled.message:
        items.insert(0, f"<li>{escape(filled.message)}")
    if not items:
        return ""
    listed = "".join(f"{item}</li>" for item in items)
    return f'<div class="faults" role="alert"><p>Not saved yet:</p><ul>{listed}</ul></div>'


def _question(number: int, question: Question, filled: Filled) -> str:
    name, value = field_name(number), filled.values.get(question.key, "")
    fault = filled.faults.get(question.key)
    notes = [("help", question.help)] if question.help else []
    notes += [("fault", fault)] if fault else []
    shown = "".join(f'<p class="{one}" id="{name}-{one}">{escape(t)}</p>' for one, t in notes)
    ids = " ".join(f"{name}-{one}" for one, _ in notes)
    described = f' aria-describedby="{ids}"' if ids else ""
    if isinstance(question, Choice):
        return (
            f'<fieldset id="{name}" tabindex="-1"{described}>'
            f"<legend>{escape(question.text)}</legend>{shown}{_options(name, question, value)}"
            "</fieldset>"
        )
    attributes = f'id="{name}" name="{name}"{described}'
    attributes += ' aria-invalid="true"' if fault else ""
    attributes += " required" if question.required else ""
    label = f'<label class="above" for="{name}">{escape(question.text)}</label>{shown}'
    if isinstance(question, Count):
        limits = f'inputmode="numeric" min="{question.low}" max="{question.high}" step="1"'
        return f'<div class="field">{label}<input type="number" {attributes} {limits} value="{escape(value)}"></div>'  # noqa: E501
    return f'<div class="field">{label}{_text_field(question, attributes, value)}</div>'


def _text_field(question: FreeText, attributes: str, value: str) -> str:
    if question.lines == 1:
        return f'<input type="text" {attributes} maxlength="200" value="{escape(value)}">'
    # A line break directly after the tag is not part of the text.
    return (
        f'<textarea {attributes} rows="{question.lines}" maxlength="2000">\n{escape(value)}'
        "</textarea>"
    )


def _options(name: str, question: Choice, chosen: str) -> str:
    """Return the radio buttons of a question: a scale between two words, or a list of labels."""
    required = " required" if question.required else ""
    marks = []
    for place, (value, label) in enumerate(question.options):
        checked = " checked" if str(value) == chosen else ""
        spoken = ""
        if question.ends is not None:
            spoken = _spoken(question, place)
        marks.append(
            f'<label><input type="radio" name="{name}" value="{escape(str(value))}"'
            f'{spoken}{required}{checked}><span>{_visible(question, label)}</span></label>'
        )  # fmt: skip
    if question.ends is None:
        return f'<div class="list">{"".join(marks)}</div>'
    low, high = (escape(end) for end in question.ends)
    size = "few" if len(question.options) <= _ROW else "many"
    return (
        f'<div class="scale {size}"><span class="low" aria-hidden="true">{low}</span>'
        f'<span class="boxes">{"".join(marks)}</span>'
        f'<span class="high" aria-hidden="true">{high}</span></div>'
    )


def _visible(question: Choice, label: str) -> str:
    """Return the visible label of an option; boxes between two words are empty, as on paper."""
    return "" if question.ends is not None and len(question.options) <= _ROW else escape(label)


def _spoken(question: Choice, place: int) -> str:
    """Return the spoken name of a step of a scale: its place, and the word at an end."""
    assert question.ends is not None
    count = len(question.options)
    text = f"{question.options[place][1]} of {question.options[-1][1]}"
    if place in (0, count - 1):
        text += f", {question.ends[0] if place == 0 else question.ends[1]}"
    return f' aria-label="{escape(text)}"'
