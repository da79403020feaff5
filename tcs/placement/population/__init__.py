"""Populations: which people the best sets of configurations serve, and who is left out.

In: a score file and people, drawn or measured. Out: for each set the goals that it reaches for each
person, and which measures tell those who are served from the others.
"""

from __future__ import annotations

from tcs.placement.population.differences import Difference, Part, ranking, tree
from tcs.placement.population.outcomes import for_papers_man, reasons_for_people
from tcs.placement.population.served import Population, SetForPeople, population

__all__ = [
    "Difference",
    "Part",
    "Population",
    "SetForPeople",
    "for_papers_man",
    "population",
    "ranking",
    "reasons_for_people",
    "tree",
]
