"""Whatever takes a score file: run on one in this process, and its answer checked."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import yaml

import tcs
from tcs.model.people import Bodies, papers_man
from tcs.motion import check_plan, load_plan
from tcs.placement.store import APPROACH
from tcs.placement.tables import Reason
from tcs.service.answers import Answers
from tcs.service.limits import Limits
from tcs.service.postures import ScenePostures
from tcs.service.requests import FloorRequest, OutcomeRequest, PlanRequest, SelectRequest
from tcs.service.score_files import ScoreFiles
from tcs.service.sent_documents import SentDocuments
from tcs.service.work import SceneWork
from tcs.service.worker import WorkerPool

Run = Callable[..., Any]


@dataclass(frozen=True)
class Given:
    """A score file, and what its consumers need."""

    path: Path
    folder: Path
    """Where to write."""
    run: Run
    """Runs `tcs` with words and returns its JSON."""

    @cached_property
    def file(self) -> tcs.ScoreFile:
        """The file."""
        return tcs.load(self.path)

    def of(self, command: str, *words: object) -> Any:
        """Return the answer of a command on the file."""
        return self.run(command, self.path, *words)

    def scores_of(self, configurations: list[int], table: int) -> tuple[float, float]:
        """Return P_R and P_M of a set, from the scores alone."""
        scores = self.file.tables[table].scores
        reached = scores.reached[configurations]
        best = np.where(reached, scores.dexterity[configurations], 0.0).max(axis=0)
        return float(reached.any(axis=0) @ scores.weights), float(best @ scores.weights)

    def service(self) -> tuple[ScoreFiles, str]:
        """Return the files of a service with this one, and its digest."""
        files = ScoreFiles(self.folder, Limits(), WorkerPool(0, memory=0))
        return files, files.read(self.path).entry.file


def _is_of_its_scores(given: Given, chosen: dict[str, Any]) -> None:
    """Check that a selected set is in the file, with the scores that the file gives it."""
    assert chosen["reachability"] > 0.0
    table, refined = given.file.nominal_index, chosen.get("refined")
    if refined is not None:
        held = given.file.tables[table].refined
        assert held is not None
        weights = given.file.nominal.scores.weights
        reached, dexterity = held.reached[refined], held.dexterity[refined]
        expected = (
            reached.any(axis=0) @ weights,
            np.where(reached, dexterity, 0.0).max(axis=0) @ weights,
        )
    else:
        expected = given.scores_of(chosen["configurations"], table)
    np.testing.assert_allclose(
        (chosen["reachability"], chosen["manipulability"]), expected, atol=1e-6
    )


def select(given: Given) -> None:
    """A set of the file, with the scores that follow from the tables."""
    chosen = given.of("select")
    _is_of_its_scores(given, chosen)
    # From where the first member is, no other set has a greater utility.
    here = chosen["members"][0]
    from_there = given.of(
        "select", "--here", here["base_x"], here["base_y"], here["base_yaw_deg"], "--top", 2
    )
    _is_of_its_scores(given, from_there)


def explain(given: Given) -> None:
    """Whether the goal is reached is as the scores have it, and the change reaches it."""
    scores = given.file.nominal.scores
    for goal in range(scores.goals):
        unreached = np.flatnonzero(~scores.reached[:, goal])
        h = int(unreached[0])
        found = given.of("explain", "--goal", goal + 1, "--configuration", h)
        assert found["explained"]["configuration"] == h
        assert not found["explained"]["reached"]
        assert found["explained"]["reason"] == Reason(scores.reason[h, goal]).name.lower()
        assert found["reasons"]["reached"] == np.count_nonzero(scores.reached[:, goal])
        nearest = found["nearest_reaching"]
        assert (nearest is not None) == bool(scores.reached[:, goal].any())
        if nearest is not None:
            assert scores.reached[nearest["configuration"], goal]


def verify(given: Given) -> None:
    """Drake confirms what is reached, the approaches too; a dense scan finds nothing missed."""
    found = given.of("verify", "--pairs", 6, "--dense", 1)
    assert found["checked"] > 0
    assert (found["false_reached"], found["missed"]) == (0, 0)
    if APPROACH in given.file.metadata:
        approaches = tcs.motion.check_approaches(given.file, pairs=3)
        of_grid = approaches.checked - approaches.refined_checked
        assert (of_grid, approaches.false) == (3, 0)


def evaluate(given: Given) -> None:
    """Without error, a set has its nominal score; with errors, no more than all goals."""
    errors = given.folder / "errors.yaml"
    joints = given.of("evaluate", "--samples", 2)["errors"]
    none = {
        joint: {key: 1e-12 if isinstance(value, float) else value for key, value in error.items()}
        for joint, error in joints.items()
    }
    errors.write_text(yaml.safe_dump({"errors": none}))
    found = given.of("evaluate", "--samples", 2, "--errors", errors)
    total = float(given.file.nominal.scores.weights.sum())
    assert 0.0 < found["mean"] <= 1.0
    assert np.isclose(found["mean"] * total, found["reachability"])


def robustify(given: Given) -> None:
    """The file with success has the same scores, and a set of it that is at least as sure."""
    out = given.folder / "robust.tcs"
    given.of("robustify", "--samples", 8, "--sets", 2, "--out", out)
    found = tcs.load(out)
    for before, after in zip(given.file.tables, found.tables, strict=True):
        np.testing.assert_array_equal(before.scores.reason, after.scores.reason)
    success = found.nominal.success
    assert success is not None
    assert np.all((success.success >= 0.0) & (success.success <= 1.0))
    chosen = tcs.select(found, weights=tcs.UtilityWeights(success=1.0))
    assert chosen.reachability > 0.0


def refine(given: Given) -> None:
    """Refined sets score no less than the best of the grid, and Drake confirms them."""
    out = given.folder / "refined.tcs"
    given.of("refine", "--starts", 1, "--rounds", 1, "--no-keep-success", "--out", out)
    found = tcs.load(out)
    refined, sets = found.nominal.refined, found.nominal.sets
    assert refined is not None
    weights = found.nominal.scores.weights
    reached = refined.reached.any(axis=1) @ weights
    dexterity = np.where(refined.reached, refined.dexterity, 0.0).max(axis=1) @ weights
    assert np.max(reached + dexterity) >= sum(sets.scores_of(sets.best)) - 1e-6
    again = tcs.verify(found, pairs=4, dense=0)
    assert again.is_sound
    assert again.refined_checked > 0


def population(given: Given) -> None:
    """The papers' man alone is served as often as the scores say, or more without approach."""
    man = papers_man()
    alone = Bodies(tuple(man.measures), np.array([True]), np.array([list(man.measures.values())]))
    found = tcs.population(given.file, alone, top=tcs.Top(count=1))
    total = float(given.file.nominal.scores.weights.sum())
    assert np.all(found.best.fractions >= found.best.reachability / total - 1e-6)
    drawn = given.of("population", "--bodies", 2, "--sets", 1)
    assert 0.0 <= drawn["served"] <= 1.0


def plan(given: Given) -> None:
    """Goals are done, and Drake finds nothing false in the stored plan."""
    out = given.folder / "plan.json"
    found = given.of("plan", "--out", out)
    assert found["goals_done"] > 0
    assert found["verified"]["false"] == 0
    again = check_plan(load_plan(out))
    assert again.is_sound
    assert again.goals == found["goals_done"]


def motions(given: Given) -> None:
    """Only reached goals are done, and a selection by them follows."""
    out = given.path.with_name(f"{given.path.name}.motions")
    found = given.of("motions", "--most", 1, "--out", out)
    scores = given.file.nominal.scores
    assert found["done"] > 0
    for one in found["results"]:
        assert scores.reached[one["configuration"], one["done"]].all()
    chosen = given.of("select", "--executable")
    out.unlink()
    assert chosen["reachability"] > 0.0


def report(given: Given) -> None:
    """A page of its own that names every goal."""
    out = given.folder / "report.html"
    given.of("report", "--out", out, "--pairs", 2, "--dense", 0)
    text = out.read_text(encoding="utf-8")
    assert text.rstrip().endswith("</html>")
    assert "<script src=" not in text
    for goal in given.file.task["goals"]:
        assert goal["name"] in text


def _is_drawn(path: Path) -> None:
    """Check that a picture shows something."""
    pixels = matplotlib.image.imread(path)
    assert min(pixels.shape[:2]) > 200
    assert len(np.unique(pixels[..., :3].reshape(-1, 3), axis=0)) > 20


def draw_map(given: Given) -> None:
    """A picture with colours."""
    out = given.folder / "map.png"
    given.of("map", "--out", out)
    _is_drawn(out)


def picture(given: Given) -> None:
    """A picture with colours."""
    out = given.folder / "picture.png"
    given.of("picture", "--out", out)
    _is_drawn(out)


def export(given: Given) -> None:
    """A row for each configuration that reaches a goal, with what it reaches."""
    out = given.folder / "scores.csv"
    given.of("export", "--out", out)
    with out.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    expected = sum(int(t.scores.reached.any(axis=1).sum()) for t in given.file.tables)
    assert len(rows) == expected > 0


def page(given: Given) -> None:
    """The floor has the best scores, and an outcome and the scene are those of a configuration."""
    files, digest = given.service()
    answers, scores = Answers(files), given.file.nominal.scores
    floor = answers.floor(FloorRequest(file=digest))
    # The floor has four decimals.
    best = np.max(scores.reached @ scores.weights)
    assert np.isclose(np.max(floor["reachability"]), best, rtol=0.0, atol=5e-5)
    h = int(np.argmax(scores.reached @ scores.weights))
    at = given.file.configurations.configuration(h)
    here = (at.base_x, at.base_y, float(np.degrees(at.base_yaw)))
    outcome = answers.outcome(OutcomeRequest(file=digest, here=here, torso=at.torso))
    assert [goal["reached"] for goal in outcome["goals"]] == scores.reached[h].tolist()
    seen = ScenePostures().at(digest, given.file, at)
    assert seen["configuration"] == h
    assert scores.reached[h, seen["goal"]]
    assert np.all(np.isfinite(seen["frames"]))


def serve_select(given: Given) -> None:
    """The service selects what the command line selects."""
    files, digest = given.service()
    found = Answers(files).select(SelectRequest(file=digest))
    expected = given.of("select")
    for key in ("members", "reachability", "manipulability"):
        assert found[key] == expected[key]


def serve_plan(given: Given) -> None:
    """The job of the service does goals, and Drake finds nothing false."""
    files, digest = given.service()
    work = SceneWork(files, SentDocuments(given.folder), Limits())
    found = work.plan(PlanRequest(file=digest, max_members=1), _Quiet())  # type: ignore[arg-type]
    assert found["goals_done"] > 0
    assert found["verified"]["false"] == 0


class _Quiet:
    """Progress of a job that nobody looks at."""

    def __call__(self, done: int, total: int) -> None:
        """Do nothing."""

    def compiling(self) -> None:
        """Do nothing."""


CONSUMERS: dict[str, Callable[[Given], None]] = {
    "select": select,
    "explain": explain,
    "verify": verify,
    "evaluate": evaluate,
    "robustify": robustify,
    "refine": refine,
    "population": population,
    "plan": plan,
    "motions": motions,
    "report": report,
    "map": draw_map,
    "picture": picture,
    "page": page,
    "export": export,
    "serve: select": serve_select,
    "serve: plan": serve_plan,
}
"""Every consumer of score files."""
