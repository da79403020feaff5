"""Tasks scored as the papers score them: each goal at its own pose alone, without approach."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import yaml

from tcs.errors import ArmClassError, StoreMismatchError
from tcs.placement.robustness import evaluate
from tcs.placement.scoring import LiveScorer, load_job, rebuild_scenes, score
from tcs.placement.scoring.dry_run import estimate
from tcs.placement.scoring.offline import load_setups
from tcs.placement.scoring.rebuild import made_from
from tests.environments import CORNER, write_environment
from tests.exact import exact_content

FREE = {"rotation_about": [1, 0, 0], "position": [0, 0.02, 0.02]}


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("paper"), "corner", CORNER)


@pytest.fixture(scope="module")
def tasks(tmp_path_factory):
    """Paths of shaving with and without freedom and further poses of its goals."""
    folder, paths = tmp_path_factory.mktemp("tasks"), []
    for name in ("free", "exact"):
        content = exact_content("shaving")
        if name == "free":
            content["free"] = FREE
            first = content["goals"][0]
            first["alternatives"] = [{"quaternion_wxyz": [0.0, 0.0, 0.0, 1.0]}]
        (folder / name).mkdir()
        paths.append(folder / name / "shaving.yaml")
        paths[-1].write_text(yaml.safe_dump(content))
    return paths


@pytest.fixture(scope="module")
def paper(tasks, corner):
    return score(tasks[0], corner, paper=True)


@pytest.fixture(scope="module")
def exact(tasks, corner):
    return score(tasks[1], corner, approach=False)


def assert_same_scores(file, other):
    for name in ("reason", "dexterity", "arm_joints", "pair", "pair_names"):
        found, expected = (getattr(f.nominal.scores, name) for f in (file, other))
        np.testing.assert_array_equal(found, expected, err_msg=name)


def test_goals_are_exact_and_approaches_not_scored(paper, exact):
    assert exact.nominal.scores.reached.any()
    assert_same_scores(paper, exact)
    assert paper.task["goals"] == exact.task["goals"]
    assert paper.metadata["scene_digest"] == exact.metadata["scene_digest"]


def test_the_file_records_it_once(paper, exact):
    assert paper.metadata["paper"] is True
    assert not {"approach", "no_approach"} & set(paper.metadata)
    assert "paper" not in exact.metadata


def test_what_is_free_makes_a_difference(paper, tasks, corner):
    free = score(tasks[0], corner, approach=False).nominal.scores.reached
    assert np.all(free | ~paper.nominal.scores.reached)
    assert free.sum() > paper.nominal.scores.reached.sum()


def test_the_scene_is_built_again_from_exact_goals(paper):
    ((job, _, lowered),) = rebuild_scenes(paper)
    assert job.paper
    assert not job.task.has_freedom
    assert lowered.digest() == paper.metadata["scene_digest"]
    record = made_from(paper)
    assert record["paper"] is True
    forgotten = {key: value for key, value in record.items() if key != "paper"}
    with pytest.raises(StoreMismatchError, match="other models"):
        rebuild_scenes(forgotten)


def test_success_is_that_of_exact_goals(paper, exact):
    found, expected = (
        dataclasses.replace(
            evaluate(file, samples=8, seed=3, body_collisions="paper"), seconds=0.0
        ).to_json()
        for file in (paper, exact)
    )
    assert found == expected
    assert found["approach"] is False


def test_live_scoring_is_exact_too(paper, tasks, corner):
    live = LiveScorer(tasks[0], corner, paper=True).score()
    assert live.metadata["paper"] is True
    assert_same_scores(live, paper)


def test_a_dry_run_is_that_of_exact_goals(tasks, corner):
    def disk_bytes(task, **options):
        setups = load_setups(task, corner, "pr2", measure="isotropy", jobs=1, sets={}, **options)
        return estimate(setups).disk_bytes

    expected = disk_bytes(tasks[1], approach=False)
    assert disk_bytes(tasks[0], paper=True) == expected != disk_bytes(tasks[0])


def test_several_hands_are_scored_so(tasks, corner):
    both = score(tasks[0], corner, arms="both", paper=True)
    assert both.metadata["paper"] is True
    assert all(not job.task.has_freedom for job, *_ in rebuild_scenes(both))


def test_papers_know_no_approach(tasks, corner):
    with pytest.raises(ArmClassError, match="papers score no approach"):
        score(tasks[0], corner, paper=True, approach=True)


def test_surfaces_lose_their_freedom_too(tmp_path):
    task = tmp_path / "washing.yaml"
    task.write_text(
        "{name: washing, title: t, source: s, environments: [wheelchair], free: orientation,"
        " surface: {body: forearm_left, spacing: 0.1}}"
    )
    free, exact = (load_job(task, "wheelchair", "pr2", paper=paper).task for paper in (False, True))
    assert free.has_freedom
    assert not exact.has_freedom
    assert len(free.goals) == len(exact.goals) > 1
