"""Every reason has a text, a name and a colour of its own."""

from __future__ import annotations

import pytest

from tcs.output.words import REASON_COLOURS, REASON_NAMES, REASON_TEXTS, colour_legend, reason_of
from tcs.output.words.reasons import COLOUR_NAMES
from tcs.placement.tables import Reason
from tests.fresh import fresh


@pytest.mark.parametrize("words", [REASON_TEXTS, REASON_NAMES, REASON_COLOURS, COLOUR_NAMES])
def test_each_reason_has_its_own(words):
    assert set(words) == set(Reason)
    assert len(set(words.values())) == len(Reason)


def test_the_legend_names_every_colour_and_reason():
    legend = colour_legend()
    assert all(name in legend for name in (*COLOUR_NAMES.values(), *REASON_NAMES.values()))


@pytest.mark.parametrize("reason", Reason)
def test_a_reason_is_found_by_its_name_in_json(reason):
    assert reason_of(reason.name.lower()) == reason


def test_words_need_no_simulator_compiler_or_plots():
    code = (
        "import sys, tcs.output.words, tcs.output.words.success;"
        "print([m for m in ('matplotlib', 'pydrake', 'numba', 'pandas') if m in sys.modules])"
    )
    assert fresh(code) == "[]"
