"""Formats of numbers, and names of the scores: TC-reachability P_R and TC-manipulability P_M."""

from __future__ import annotations

import math


def percent(fraction: float, digits: int = 1) -> str:
    """Return a fraction as a percentage without its sign.

    >>> percent(0.98407)
    '98.4'
    """
    return f"{100.0 * fraction:.{digits}f}"


def percentage(fraction: float, digits: int = 1) -> str:
    """Return a fraction as a percentage.

    >>> percentage(0.98407)
    '98.4%'
    """
    return f"{percent(fraction, digits)}%"


def signed(points: float) -> str:
    """Return percentage points with their sign.

    >>> signed(0.04), signed(-1.25), signed(-0.01)
    ('0.0', '-1.2', '0.0')
    """
    text = f"{points:+.1f}"
    return "0.0" if float(text) == 0.0 else text


def p_value(p: float) -> str:
    """Return a p-value; a dash for NaN, which is no p-value.

    >>> p_value(3e-7), p_value(0.0312), p_value(1.0), p_value(math.nan)
    ('< 0.0001', '0.031', '1', '–')
    """
    if math.isnan(p):
        return "–"
    if p < 1e-4:
        return "< 0.0001"
    return f"{p:.2g}"


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
