"""Postures that shapes block: which pairs of bodies are to blame."""

from tcs_shapes.blocked import Blocked

PAIRS = ((("arm", "base"), 9), (("arm", "hand"), 3), (("hand", "base"), 1), (("base", "wrist"), 1))


def test_the_worst_pairs_leave_the_others_a_fraction_of_the_postures():
    found = Blocked(free=200, blocked=14, pairs=PAIRS)
    names = [pair for pair, _ in PAIRS]
    for allowed, count in ((0.0, 4), (0.005, 3), (0.01, 2), (0.024, 2), (0.025, 1), (0.07, 0)):
        assert found.worst(allowed) == tuple(names[:count])


def test_where_nothing_is_blocked_no_pair_is_to_blame():
    assert Blocked(free=200, blocked=0, pairs=()).worst(0.0) == ()
