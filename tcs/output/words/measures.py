"""Names of the scores: TC-reachability P_R and TC-manipulability P_M."""

from __future__ import annotations

from tcs.output.words.numbers import percentage

REACHABILITY_LABEL = "goals reached, P_R [%]"
"""Title of a scale of P_R."""


def manipulability_label(measure: str) -> str:
    """Return the title of a scale of P_M.

    Args:
        measure: Name of the dexterity measure.
    """
    return f"manipulability, P_M ({measure}) [0 to 1]"


def scores_text(reachability: float, manipulability: float, measure: str) -> str:
    """Return both scores of a set.

    Args:
        reachability: P_R.
        manipulability: P_M.
        measure: Name of the dexterity measure.

    >>> scores_text(0.95238, 0.41234, "isotropy")
    '95.2% of the goals, manipulability 0.412 (isotropy)'
    """
    return (
        f"{percentage(reachability)} of the goals, manipulability {manipulability:.3f} ({measure})"
    )
