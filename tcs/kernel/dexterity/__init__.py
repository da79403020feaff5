"""Dexterity measures: how well the arm can move its tool in every direction.

In: joint angles. Out: a measure in [0, 1]. Names and codes are here, so that a name can be checked
without loading the compiler; `measures` computes the values.
"""

from __future__ import annotations

from typing import NamedTuple

from tcs.errors import UnknownNameError

ISOTROPY, INVERSE_CONDITION, LIMIT_WEIGHTED, ANY = 0, 1, 2, 3
"""Function of the Jacobian; LIMIT_WEIGHTED is the isotropy with the joints weighted by their
distance to their limits, ANY that of some solution: the search ends at the first one."""
UNLIMITED, NORMALISED, THESIS = 0, 1, 2
"""Joint-limit penalty: none, normalised, or as in the ITCM thesis."""


class Dexterity(NamedTuple):
    """A dexterity measure, as the codes that the compiled functions use."""

    of: int
    """ISOTROPY, INVERSE_CONDITION, LIMIT_WEIGHTED or ANY."""
    penalty: int
    """UNLIMITED, NORMALISED or THESIS."""


ANY_SOLUTION = Dexterity(ANY, UNLIMITED)
"""In place of a measure where only the reason of each pair counts."""
DEFAULT_MEASURE = "isotropy"
MEASURES = {
    DEFAULT_MEASURE: Dexterity(ISOTROPY, UNLIMITED),
    "inverse-condition": Dexterity(INVERSE_CONDITION, UNLIMITED),
    "isotropy-limited": Dexterity(ISOTROPY, NORMALISED),
    "inverse-condition-limited": Dexterity(INVERSE_CONDITION, NORMALISED),
    "isotropy-limited-thesis": Dexterity(ISOTROPY, THESIS),
    "inverse-condition-limited-thesis": Dexterity(INVERSE_CONDITION, THESIS),
    "jlwki": Dexterity(LIMIT_WEIGHTED, UNLIMITED),
}
"""Every measure; docs/method.md has the equations."""


def dexterity(measure: str) -> Dexterity:
    """Return the measure of that name.

    Raises:
        UnknownNameError: If there is no measure of that name.
    """
    if measure not in MEASURES:
        raise UnknownNameError("measure", measure, MEASURES)
    return MEASURES[measure]
