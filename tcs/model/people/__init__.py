"""People: sizes of bodies, measured, by percentile or drawn at random.

In: sex, and percentiles or measured values of some measures, also of many people in a table. Out:
all 58 measures of the survey of bodies, also of children, each with its own distribution and
correlated as in the survey, and the sizes of the links of a person's model relative to the papers'
average man; joints, the ranges in which people move them, and named postures.
"""

from __future__ import annotations

from tcs.model.people.bodies import Bodies, Body, body, draw_bodies
from tcs.model.people.children import ADULT, YOUNGEST, survey_at
from tcs.model.people.joints import JOINTS, NamedPosture, named_postures, range_of_motion
from tcs.model.people.people_file import load_people
from tcs.model.people.person import WORDS, Person, PersonEntry, PersonLike, load_person, person_keys
from tcs.model.people.proportions import (
    LINKS,
    PAPERS_MAN,
    Scale,
    link_scales,
    papers_man,
    scales_of_people,
)
from tcs.model.people.survey import SEXES, Survey, load_survey

__all__ = [
    "ADULT",
    "JOINTS",
    "LINKS",
    "PAPERS_MAN",
    "SEXES",
    "WORDS",
    "YOUNGEST",
    "Bodies",
    "Body",
    "NamedPosture",
    "Person",
    "PersonEntry",
    "PersonLike",
    "Scale",
    "Survey",
    "body",
    "draw_bodies",
    "link_scales",
    "load_people",
    "load_person",
    "load_survey",
    "named_postures",
    "papers_man",
    "person_keys",
    "range_of_motion",
    "scales_of_people",
    "survey_at",
]
