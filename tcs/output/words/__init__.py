"""Words for results: the texts, number formats and colours that every surface shares.

In: reasons, configurations, score tables, losses and verifications. Out: plain strings and tuples
for the command line, reports, the viewer and pictures. Nothing here draws, simulates or compiles.
"""

from __future__ import annotations

from tcs.output.words.answers import (
    basis_text,
    choice_in_words,
    explanation_in_words,
    gain_text,
    summary_in_words,
)
from tcs.output.words.assignment import assign_goals, assigned_goals
from tcs.output.words.bodies import body_name, frame_name, pair_text
from tcs.output.words.configurations import (
    HAND,
    axis_name,
    axis_title,
    axis_unit,
    axis_value,
    base_pose_text,
    deviation_text,
    hands_text,
    member_text,
    quantity,
    setting_text,
    settings_text,
)
from tcs.output.words.goals import (
    goal_index,
    goal_index_of_number,
    goal_list,
    goal_names,
    goal_place,
    goal_text,
    goals_by_reason,
    goals_text,
    text_of_goal,
)
from tcs.output.words.measures import REACHABILITY_LABEL, manipulability_label, scores_text
from tcs.output.words.numbers import p_value, percent, percentage, signed
from tcs.output.words.people import person_text
from tcs.output.words.places import (
    RelativePlace,
    frames_of_state,
    member_places,
    place_in_line,
    place_of_state,
    relative_place,
    stop_places,
)
from tcs.output.words.reasons import (
    REASON_COLOURS,
    REASON_NAMES,
    REASON_TEXTS,
    colour_legend,
    reason_of,
)

__all__ = [
    "HAND",
    "REACHABILITY_LABEL",
    "REASON_COLOURS",
    "REASON_NAMES",
    "REASON_TEXTS",
    "RelativePlace",
    "assign_goals",
    "assigned_goals",
    "axis_name",
    "axis_title",
    "axis_unit",
    "axis_value",
    "base_pose_text",
    "basis_text",
    "body_name",
    "choice_in_words",
    "colour_legend",
    "deviation_text",
    "explanation_in_words",
    "frame_name",
    "frames_of_state",
    "gain_text",
    "goal_index",
    "goal_index_of_number",
    "goal_list",
    "goal_names",
    "goal_place",
    "goal_text",
    "goals_by_reason",
    "goals_text",
    "hands_text",
    "manipulability_label",
    "member_places",
    "member_text",
    "p_value",
    "pair_text",
    "percent",
    "percentage",
    "person_text",
    "place_in_line",
    "place_of_state",
    "quantity",
    "reason_of",
    "relative_place",
    "scores_text",
    "setting_text",
    "settings_text",
    "signed",
    "stop_places",
    "summary_in_words",
    "text_of_goal",
]
