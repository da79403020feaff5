"""The main job end to end: shaving in the wheelchair, on the full grid of the paper.

Loads robot, furniture and person in Drake, scores, builds the sets, saves, chooses from two
places, re-checks with Drake, draws. Exits with 1 when an answer turns out false.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import tcs
from tcs.cli.places import place
from tcs.cli.reports import choice_as_json, report_choice, report_scores, report_verification
from tcs.cli.talk import progress_bar
from tcs.output.draw import save_figure
from tcs.output.report.pictures import map_figure, scene_figure
from tcs.output.report.shown_set import ShownSet
from tcs.placement.scoring import load_job

TASK, ENVIRONMENT, ROBOT = "shaving", "wheelchair", "pr2"
PLACES = ((1.4, -1.2, 180.0), (-1.2, 0.9, 0.0))
"""Where the robot might be when it is asked to help: before the person on the right, and behind
on the left (x [m], y [m], heading [deg])."""


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
    """Do the job and leave its results in a folder."""
    begun = time.perf_counter()
    step("1  Load the robot, the furniture and the person in Drake")
    job = load_job(TASK, ENVIRONMENT, ROBOT)
    scene = job.scene()
    print(f"{job.spec.robot.title}; {job.spec.environment.title}; task '{job.task.title}'.")
    print(f"Origin of the environment frame: {job.spec.environment.origin}")
    print(f"{len(scene.built.parts)} collision shapes, {job.grid.size:,} initial configurations.")

    step("2  Score every initial configuration, build the sets, save")
    path = folder / f"{TASK}-{ENVIRONMENT}-{ROBOT}.tcs"
    with progress_bar("configurations") as on_progress:
        scored = tcs.score(
            TASK,
            ENVIRONMENT,
            ROBOT,
            jobs=2,
            on_progress=on_progress,
            on_compile=lambda: print(
                "Compiling for this machine, up to a minute, once.", flush=True
            ),
        )
    tcs.save(path, scored)
    summary = {**tcs.summary(scored), "file": str(path)}
    report_scores(summary)

    file = tcs.load(path)
    choices = []
    for number, here in enumerate(PLACES, start=1):
        x, y, yaw_deg = here
        step(f"3.{number}  Choose for a robot at x {x} m, y {y} m, heading {yaw_deg:g} deg")
        choices.append(choice_as_json(tcs.select(file, place(here)), file.metadata["measure"]))
        report_choice(choices[-1])

    step("4  Re-check random answers with Drake, and look for missed ones")
    with progress_bar("pairs") as on_progress:
        found = tcs.verify(file, pairs=200, dense=50, seed=0, on_progress=on_progress)
    report_verification(found.to_json())

    step("5  Draw")
    shown = ShownSet.of(file, place(PLACES[0]))
    save_figure(folder / "map.png", map_figure(file, shown))
    save_figure(folder / "scene.png", scene_figure(file, shown))
    results = {"scores": summary, "choices": choices, "verification": found.to_json()}
    (folder / "results.json").write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")

    step("Done")
    timings = scored.metadata["timings"]
    print(
        f"Compiling {timings['compile_seconds']:.1f} s, scoring {timings['scoring_seconds']:.2f} s,"
        f" sets {timings['sets_seconds']:.2f} s, choosing {1e3 * choices[0]['seconds']:.1f} ms; "
        f"everything {time.perf_counter() - begun:.0f} s."
    )
    print(f"Look at {folder / 'map.png'} and {folder / 'scene.png'}.")
    if not found.is_sound:
        print("demo: some answers are false.", file=sys.stderr)
        return 1
    return 0


def step(title: str) -> None:
    """Print the heading of a step."""
    print(f"\n== {title}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
