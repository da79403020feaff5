"""Demonstrate the whole method: shaving in the wheelchair, on the full grid of the paper.

Loads robot, furniture and person in Drake, scores, builds the sets, saves, selects sets from two
positions of the robot, verifies with Drake, draws. Exits with 1 if verification finds an error.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import tcs
from tcs.output import terminal
from tcs.output.draw import save_figure
from tcs.output.report.score.pictures import map_figure, scene_figure
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.words import member_text, percentage, scores_text
from tcs.placement.scoring import load_job

TASK, ENVIRONMENT, ROBOT = "shaving", "wheelchair", "pr2"
STATES = (
    tcs.InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=math.pi, torso=0.0),
    tcs.InitialConfiguration(base_x=-1.2, base_y=0.9, base_yaw=0.0, torso=0.0),
)
"""Current states of the robot: in front of the person on the right, and behind on the left."""


def main() -> int:
    """Run the demo; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder for the results")
    folder = parser.parse_args().out
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return run(folder)
    except OSError as error:
        print(f"demo: '{folder}' cannot be used: {error.strerror}.", file=sys.stderr)
    except tcs.TcsError as error:
        print(f"demo: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("demo: interrupted; no half-written file is left.", file=sys.stderr)
        return 130
    return 1


def run(folder: Path) -> int:
    """Run all steps and write their results into a folder."""
    begun = time.perf_counter()
    step("1  Load the robot, the furniture and the person in Drake")
    job = load_job(TASK, ENVIRONMENT, ROBOT)
    scene = job.scene()
    print(f"{job.spec.robot.title}; {job.spec.environment.title}; task '{job.task.title}'.")
    print(f"Origin of the environment frame: {job.spec.environment.origin}")
    print(f"{len(scene.built.parts)} collision shapes, {job.grid.size:,} initial configurations.")

    step("2  Score every initial configuration, build the sets, save")
    path = folder / f"{TASK}-{ENVIRONMENT}-{ROBOT}.tcs"
    with terminal.progress_bar("configurations") as on_progress:
        scored = tcs.score(
            TASK,
            ENVIRONMENT,
            ROBOT,
            jobs=2,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    tcs.save(path, scored)
    summary = {**tcs.summary(scored), "file": str(path)}
    print_scores(summary)

    file = tcs.load(path)
    choices = []
    for number, here in enumerate(STATES, start=1):
        step(f"3.{number}  Select a set for a robot at {member_text(here.to_json())}")
        choices.append(tcs.select(file, here).to_json(file.metadata["measure"]))
        print_choice(choices[-1])

    step("4  Verify random results with Drake, and scan for missed ones")
    with terminal.progress_bar("pairs") as on_progress:
        found = tcs.verify(file, pairs=200, dense=50, seed=0, on_progress=on_progress)
    print_verification(found)

    step("5  Draw")
    shown = ShownSet.of(file, STATES[0])
    save_figure(folder / "map.png", map_figure(file, shown))
    save_figure(folder / "scene.png", scene_figure(file, shown))
    results = {"scores": summary, "choices": choices, "verification": found.to_json()}
    (folder / "results.json").write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")

    step("Done")
    timings = scored.metadata["timings"]
    print(
        f"Compiling {timings['compile_seconds']:.1f} s, scoring {timings['scoring_seconds']:.2f} s,"
        f" sets {timings['sets_seconds']:.2f} s, selecting {1e3 * choices[0]['seconds']:.1f} ms; "
        f"total {time.perf_counter() - begun:.0f} s."
    )
    print(f"Pictures: {folder / 'map.png'} and {folder / 'scene.png'}.")
    print(f"In the browser: {Path(sys.executable).parent / 'tcs'} app {path}")
    if not found.is_sound:
        print("demo: some results are false.", file=sys.stderr)
        return 1
    return 0


def print_scores(summary: dict[str, Any]) -> None:
    """Print the size of the score table and the best sets."""
    print(
        f"{summary['configurations']:,} configurations x {summary['goals']} goals scored in "
        f"{summary['scoring_seconds']:.2f} s; {summary['candidates']:,} configurations reach a "
        f"goal, {summary['sets']:,} sets kept."
    )
    for key, title in (("best_single", "Best single configuration"), ("best", "Best set")):
        print(f"{title}: {scores_of(summary[key], summary['measure'])}")
        print_members(summary[key]["members"])
    print(f"Wrote {summary['file']}.")


def print_choice(choice: dict[str, Any]) -> None:
    """Print a selected set with its scores and costs."""
    print_members(choice["members"])
    print(
        f"{scores_of(choice, choice['measure'])}, travel cost {choice['cost']:.2f}, utility "
        f"{choice['utility']:.3f} (selected in {1e3 * choice['seconds']:.1f} ms)"
    )


def print_verification(found: tcs.Verification) -> None:
    """Print what verification checked and found."""
    error = found.max_position_error
    print(
        f"{found.checked} reached pairs checked with Drake: {found.false_reached} false, "
        f"{found.limit_violations} beyond joint limits"
        + ("." if error is None else f", position error at most {error:.1e} m.")
    )
    print(f"{found.dense_checked} unreached pairs scanned densely: {found.missed} reachable.")
    if found.recall is None or found.recall_ci95 is None:
        print(f"Recall: {found.recall_note}")
    else:
        low, high = (percentage(end, 2) for end in found.recall_ci95)
        print(f"Recall {percentage(found.recall, 2)} (95 % interval {low} to {high}).")
    print(f"Verdict: {found.verdict}.")


def print_members(members: list[dict[str, float]]) -> None:
    """Print the members of a set, one on each line."""
    for number, member in enumerate(members, start=1):
        print(f"  {number}: {member_text(member)}")


def scores_of(result: dict[str, Any], measure: str) -> str:
    """Return the scores of a set."""
    return scores_text(result["reachability"], result["manipulability"], measure)


def step(title: str) -> None:
    """Print the heading of a step."""
    print(f"\n== {title}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
