"""People: sizes of bodies, measured, by percentile or drawn at random.

In: sex, and percentiles or measured values of some measures. Out: all 58 measures of the survey of
bodies, each with its own distribution and correlated as in the survey.
"""

from __future__ import annotations

from tcs.model.people.bodies import Bodies, Body, body, draw_bodies
from tcs.model.people.survey import SEXES, Survey, load_survey

__all__ = ["SEXES", "Bodies", "Body", "Survey", "body", "draw_bodies", "load_survey"]
