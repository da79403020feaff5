"""The CSV file of every sample of a study."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from tcs_studies.output.report.robustness.write import evaluations, samples_csv


@pytest.fixture(scope="module")
def table(study, lossless):
    """Every sample, read from the file."""
    return list(csv.DictReader(io.StringIO(samples_csv([study, lossless]).decode())))


def test_every_sample_is_in_the_file(study, lossless, table, plan):
    tried = sum(found.samples for row in (study, lossless) for *_, found in evaluations(row))
    assert len(table) == tried
    # The best set, the best single, and four methods on common and on independent samples.
    assert tried == 2 * 10 * plan.samples


def test_means_follow_from_the_file(study, table):
    fractions = [
        float(line["fraction"])
        for line in table
        if (line["task"], line["method"], line["draw"]) == ("shaving", "best set", "common")
    ]
    # Written with nine digits.
    assert np.mean(fractions) == pytest.approx(study.best.summary.mean, abs=1e-8)
    for line in table:
        # All eight goals of shaving weigh the same.
        assert float(line["fraction"]) == pytest.approx(line["goals"].count("1") / 8, abs=1e-8)


def test_errors_are_those_that_were_drawn(study, table):
    first = table[0]
    assert (first["sample"], first["method"]) == ("0", "best set")
    for name, values in study.best.offsets.items():
        assert float(first[name]) == pytest.approx(values[0], rel=1e-5)
    assert first["members"] == "+".join(map(str, study.best.sets[0]))
