"""The re-check of stored answers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import StoreMismatchError, TcsError
from tcs.files import mapped
from tcs.model.grid import Grid
from tcs.placement.scoring import build_sets, load_job, score, summary, verify
from tcs.placement.scoring.file_checker import (
    SAMPLED,
    STRATA,
    estimated_recall,
    random_pairs,
    scan_counts,
)
from tcs.placement.store import StateTables
from tcs.placement.tables import Reason
from tests.environments import BESIDE, write_environment


def test_stored_answers_are_true(small_file):
    found = verify(small_file, pairs=40, dense=20)
    assert found.is_sound
    assert found.checked == 40
    assert found.false_reached == found.limit_violations == found.unconfirmed_hits == 0
    assert 0.0 < found.max_position_error <= 1e-6
    assert found.max_isotropy_error <= 1e-6
    assert found.shortfall_checked == 20
    assert set(found.to_json()) >= {"checked", "false_reached", "recall", "recall_ci95"}


@pytest.mark.parametrize("measure", ["inverse-condition", "isotropy-limited"])
def test_a_file_is_verified_by_the_measure_it_was_made_with(small_file, small_environment, measure):
    file = score("shaving", small_environment, measure=measure, paper=True)
    assert file.metadata["measure"] == summary(file)["measure"] == measure
    found = verify(file, pairs=40, dense=10)
    assert found.is_sound
    assert found.measure == found.to_json()["measure"] == measure
    # Refinement leaves almost no shortfall, by this measure too.
    assert found.mean_shortfall < 1e-3
    # The same answers, but by another measure: every value differs.
    forged = dataclasses.replace(file, metadata={**file.metadata, "measure": "isotropy"})
    wrong = verify(forged, pairs=40, dense=0)
    assert wrong.false_reached == 0
    assert wrong.max_isotropy_error > 1e-3
    assert not wrong.is_sound
    # Which goals are reached does not depend on the measure; how well they are, does.
    np.testing.assert_array_equal(file.nominal.scores.reason, small_file.nominal.scores.reason)
    reached = file.nominal.scores.reached
    assert np.any(
        file.nominal.scores.dexterity[reached] < small_file.nominal.scores.dexterity[reached]
    )


def with_joints(file, change):
    joints = file.nominal.scores.arm_joints.copy()
    change(joints)
    scores = dataclasses.replace(file.nominal.scores, arm_joints=joints)
    return dataclasses.replace(file, tables=(StateTables.of(scores, file.nominal.sets),))


def test_a_joint_moved_by_a_hundredth_is_found(small_file):
    def nudge(joints):
        joints[:, 3] -= 0.01

    found = verify(with_joints(small_file, nudge), pairs=10, dense=0)
    assert found.false_reached == 10
    assert found.max_position_error > 1e-3
    assert not found.is_sound


def test_a_joint_beyond_its_limit_is_found(small_file):
    def shift(joints):
        joints[:, 3] = -0.1

    found = verify(with_joints(small_file, shift), pairs=10, dense=0)
    assert found.limit_violations == 10
    assert not found.is_sound


def test_an_arm_too_close_to_the_person_is_found(small_file, small_environment):
    # The same answers in an environment that requires 25 cm of clearance: only contact differs.
    text = small_environment.read_text().replace("name: small-wheelchair", "name: tight-wheelchair")
    tight = small_environment.parent / "tight-wheelchair.yaml"
    tight.write_text(text + "contact_margin: 0.25\n")
    job = load_job("shaving", tight, "pr2", paper=True)
    metadata = {
        **small_file.metadata,
        "environment": str(tight),
        "scene_digest": job.lowered(job.scene()).digest(),
    }
    found = verify(dataclasses.replace(small_file, metadata=metadata), pairs=20, dense=0)
    assert found.false_reached == 20
    assert found.max_position_error <= 1e-6


def test_a_file_of_other_models_is_refused(small_file):
    metadata = {**small_file.metadata, "scene_digest": "0" * 64}
    with pytest.raises(StoreMismatchError, match="Score the task again"):
        verify(dataclasses.replace(small_file, metadata=metadata))


def without_every_second(file, reason):
    """Return the file with every second reached pair stored as unreached, and how many they are."""
    scores = file.nominal.scores
    reasons, dexterity = scores.reason.copy(), scores.dexterity.copy()
    taken = np.argwhere(scores.reached)[::2]
    reasons[taken[:, 0], taken[:, 1]] = reason
    dexterity[taken[:, 0], taken[:, 1]] = 0.0
    kept = np.ones(len(scores.arm_joints), dtype=bool)
    kept[::2] = False
    stripped = dataclasses.replace(
        scores, reason=reasons, dexterity=dexterity, arm_joints=scores.arm_joints[kept]
    )
    sets = build_sets(stripped, Grid.from_dict(file.grid))
    return dataclasses.replace(file, tables=(StateTables.of(stripped, sets),)), len(taken)


def test_reached_pairs_taken_away_are_missed(small_file):
    # Declare every second reached pair blocked: the dense scan must find about all of them.
    forged, _ = without_every_second(small_file, Reason.ARM_BLOCKED)
    found = verify(forged, pairs=0, dense=60)
    assert found.missed > 0
    assert found.recall < 0.9
    assert found.recall_ci95[0] <= found.recall <= found.recall_ci95[1]


@pytest.mark.parametrize("reason", STRATA, ids=lambda reason: reason.name.lower())
def test_a_whole_scan_finds_what_was_taken_from_its_stratum(small_file, reason):
    forged, taken = without_every_second(small_file, reason)
    found = verify(forged, pairs=0, dense=0, strata=True)
    assert [stratum.reason for stratum in found.strata] == list(STRATA)
    for stratum in found.strata:
        count = int(np.sum(forged.nominal.scores.reason == stratum.reason))
        assert stratum.pairs == stratum.scanned == count
        # What the search itself may have missed is not what this test is about.
        assert stratum.missed >= 0.99 * taken if stratum.reason is reason else not stratum.missed
    stored = int(forged.nominal.scores.reached.sum())
    assert found.recall == pytest.approx(stored / (stored + found.missed))
    assert found.recall_ci95 == (found.recall, found.recall)
    by_reason = {stratum.reason: stratum.recall for stratum in found.strata}
    assert by_reason[reason] == found.recall
    assert all(recall == 1.0 for other, recall in by_reason.items() if other is not reason)
    assert found.unconfirmed_hits == 0


def test_a_limit_samples_each_stratum(small_file):
    found = verify(small_file, pairs=0, dense=0, strata=True, limit=7)
    assert [s.scanned for s in found.strata] == [min(7, s.pairs) for s in found.strata]
    assert found.to_json()["strata"][0]["reason"] == "joint_limits"


def test_threads_change_nothing_in_the_findings(small_file):
    first, second = (verify(small_file, pairs=0, dense=40, jobs=n) for n in (1, 3))
    assert first == second
    assert first.scan_seconds > 0.0


def test_the_smallest_sample_has_a_pair_of_each_stratum(small_file):
    found = verify(small_file, pairs=0, dense=1)
    assert all(stratum.pairs for stratum in found.strata)
    assert [stratum.scanned for stratum in found.strata] == [1, 1]
    assert found.recall is not None


@pytest.mark.parametrize("dense", [1, 2, 3, 10, 999])
@pytest.mark.parametrize("sizes", [(0, 50), (50, 0), (1, 1), (1, 900), (900, 1), (30, 40), (0, 0)])
def test_every_stratum_is_scanned_and_no_pair_twice(sizes, dense):
    reason = np.repeat(np.array(SAMPLED, np.uint8), sizes)[:, None]
    counts = [scan_counts(reason, dense)[r] for r in SAMPLED]
    assert all(0 < n <= size if size else n == 0 for n, size in zip(counts, sizes, strict=True))
    strata = sum(size > 0 for size in sizes)
    assert sum(counts) == min(max(dense, strata), sum(sizes))


def test_the_same_seed_checks_the_same_pairs(small_file):
    first, again, other = (verify(small_file, pairs=10, dense=5, seed=s) for s in (1, 1, 2))
    assert first == again
    assert first != other


@pytest.mark.parametrize("bad", [{"pairs": -1}, {"dense": -1}])
def test_negative_numbers_are_refused(small_file, bad):
    with pytest.raises(TcsError, match="neither may be negative"):
        verify(small_file, **bad)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"jobs": 0}, "jobs is 0"),
        ({"limit": 5}, "needs strata=True"),
        ({"strata": True, "limit": 0}, "at least 1"),
    ],
)
def test_odd_options_of_the_scan_are_refused(small_file, bad, message):
    with pytest.raises(TcsError, match=message):
        verify(small_file, **bad)


def test_recall_of_one_stratum_is_the_textbook_formula():
    recall, (low, high) = estimated_recall(900, [500], [100], [4])
    assert recall == pytest.approx(900 / (900 + 500 * 4 / 100))
    # Clopper-Pearson limits of 4 in 100, from tables: 0.0110 and 0.0993.
    assert low == pytest.approx(900 / (900 + 500 * 0.0993), rel=1e-4)
    assert high == pytest.approx(900 / (900 + 500 * 0.0110), rel=1e-4)


def test_an_unscanned_stratum_leaves_recall_open():
    recall, (low, high) = estimated_recall(100, [100], [0], [0])
    assert recall is None
    assert (low, high) == (0.5, 1.0)


def test_a_stratum_scanned_as_a_whole_leaves_nothing_to_estimate():
    recall, interval = estimated_recall(900, [50, 100], [50, 100], [4, 0])
    assert recall == 900 / 904
    assert interval == (recall, recall)


def test_recall_is_undefined_where_nothing_is_known_to_be_reachable():
    assert estimated_recall(0, [100], [10], [0]) == (None, None)
    assert estimated_recall(0, [100], [10], [1]) == (0.0, (0.0, 0.0))


def test_a_file_that_reaches_nothing_claims_nothing(tmp_path):
    # Bases 4 m from the person: every goal is too far.
    far = write_environment(tmp_path, "far-away", {**BESIDE, "base_x": [5.0, 0.1, 2]})
    found = verify(score("shaving", far, paper=True), pairs=10, dense=10)
    assert (found.checked, found.dense_checked, found.shortfall_checked) == (0, 0, 0)
    assert found.is_sound
    assert found.verdict == "nothing was checked"
    assert found.recall_note == "not estimated: no unreached pair was scanned"
    plain = found.to_json()
    for key in ("max_position_error", "max_isotropy_error", "recall", "recall_ci95"):
        assert plain[key] is None
    assert plain["mean_shortfall"] is None


@pytest.mark.parametrize("count", [0, 5, 400, None])
def test_random_pairs_do_not_depend_on_the_size_of_chunks(count, monkeypatch):
    reason = np.random.default_rng(3).integers(0, 7, size=(700, 3)).astype(np.uint8)
    flat = np.flatnonzero(reason == Reason.ARM_BLOCKED)
    picked = flat
    if count is not None:
        picked = np.random.default_rng(8).choice(flat, size=min(count, flat.size), replace=False)
    monkeypatch.setattr(mapped, "CHUNK_BYTES", 50)
    found = random_pairs(np.random.default_rng(8), reason, Reason.ARM_BLOCKED, count)
    assert [3 * h + g for h, g in found] == picked.tolist()
