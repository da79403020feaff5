"""Order of the conditions of each operator, counterbalanced against learning and carry-over."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TypeVar

T = TypeVar("T")
COMPLETE = 3
"""Greatest number of conditions whose permutations are all used; four have 24 permutations."""


def counterbalanced_orders(conditions: Sequence[T]) -> tuple[tuple[T, ...], ...]:
    """Return the orders that operators take in turn.

    Up to three conditions have all their permutations. More have a balanced Latin square, in which
    each condition is equally often at each position and directly after each other condition.

    Args:
        conditions: The conditions, n of them.

    Returns:
        For n <= 3 all n! permutations, the first in the given order; for greater n, n orders if n
        is even and 2 n if it is odd.

    Source:
        Null-space paper, Table I (both orders of two conditions in turn); ITCM thesis, section
        III.C.2 (an order per participant, six participants, three conditions). The square is that
        of Williams, Austral. J. Sci. Res. A 2 (1949) 149-168.

    >>> counterbalanced_orders("AB")
    (('A', 'B'), ('B', 'A'))
    >>> ["".join(order) for order in counterbalanced_orders("ABCD")]
    ['ABDC', 'BCAD', 'CDBA', 'DACB']
    """
    n = len(conditions)
    if n <= COMPLETE:
        return tuple(itertools.permutations(conditions))
    # 0, 1, n-1, 2, n-2, ...: all differences of neighbours, modulo n, are different.
    first = [0, *((i + 1) // 2 if i % 2 else n - i // 2 for i in range(1, n))]
    rows = [[(place + shift) % n for place in first] for shift in range(n)]
    if n % 2:
        rows += [row[::-1] for row in rows]
    return tuple(tuple(conditions[place] for place in row) for row in rows)
