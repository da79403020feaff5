"""Run every benchmark that a page shows with --save, and print how long each took.

Usage: python benchmarks/save_all.py [--only NAME ...] [--again] [--list]

A part that has been saved since the last change of package, models, tasks and its own script is
left out, so that an interrupted run continues where it was; `--again` runs it nevertheless.
Afterwards `make figures` rewrites the pages.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import time
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
STAMPS = CHECKOUT / "out" / "benchmarks"
SCORES = "out/scores"
"""Folder of the score files of all rows: `rows` writes them, others read them."""
PARTS: dict[str, tuple[str, ...]] = {
    "rows": ("--out", SCORES),
    "run": ("--pairs", "500", "--dense", "200"),
    "selection": (f"{SCORES}/bathing-bed-pr2.tcs", f"{SCORES}/shaving-wheelchair-pr2.tcs"),
    "constraints": (f"{SCORES}/bathing-bed-pr2.tcs",),
    "motion": (
        *(f"{SCORES}/shaving-wheelchair-pr2.tcs", f"{SCORES}/bathing-bed-pr2.tcs"),
        *("--places", "60", "--drake", "10"),
    ),
    "plan_success": (
        *(f"{SCORES}/shaving-wheelchair-pr2.tcs", f"{SCORES}/feeding-wheelchair-pr2.tcs"),
        f"{SCORES}/bathing-bed-pr2.tcs",
    ),
    "planning": ("--limit", "20", "--compared", "1", "--seeds", "20"),
    "service": (f"{SCORES}/shaving-wheelchair-pr2.tcs",),
    "service_strain": (f"{SCORES}/shaving-wheelchair-pr2.tcs", "--seconds", "4"),
    "ros2": (f"{SCORES}/shaving-wheelchair-pr2.tcs",),
    "app": (f"{SCORES}/shaving-wheelchair-pr2.tcs",),
    "approach": (
        *("--rows", "shaving/wheelchair", "feeding/wheelchair", "bathing/bed"),
        *("--pairs", "100"),
    ),
    "approach_search": (),
    "parking": (
        *(f"{SCORES}/shaving-wheelchair-pr2.tcs", f"{SCORES}/feeding-wheelchair-pr2.tcs"),
        f"{SCORES}/bathing-bed-pr2.tcs",
    ),
    "rooms_done": tuple(
        f"{SCORES}/{name}-wheelchair-pr2.tcs" for name in ("shaving", "feeding", "brushing")
    ),
    "done_table": (),
    "motions": (
        *(
            f"{SCORES}/{name}-pr2.tcs"
            for name in (
                *("shaving-wheelchair", "feeding-wheelchair", "brushing-wheelchair"),
                *("shaving-bed", "shaving-bed-no-wall", "bathing-bed", "scratching_chest-bed"),
                *("scratching_forearm_left-bed", "scratching_forearm_right-bed"),
                *("scratching_upper_arm_left-bed", "scratching_upper_arm_right-bed"),
                *("scratching_thigh_left-bed", "scratching_thigh_right-bed"),
            )
        ),
        *("--jobs", "2"),
    ),
    "optimum": (),
    "surest_search": (),
    "surest_rules": (),
    "surest_exact": (),
    "toc": (),
    "placing": (),
    "obstacles": (),
    "first_run": (),
    "viewer": ("--scores", SCORES),
    "live_page": (),
    "teleop": (),
    "peers": (),
    "live": (),
    "robots": ("--limit", "2000", "--finished", "out/robots.jsonl"),
    "numeric_arms": (),
    "six_joints": (),
    "freedom": (),
    "drafting": ("--coarse",),
    "primitives": (),
    "shapes": (),
    "null_space": (),
    "capability": (),
    "itcm_task": ("--pictures", "out/pictures"),
    "arms": (),
    "thesis_base_poses": (),
    "arplace": (),
    "locating": ("--runs", "60"),
    "robustness": ("--scores", SCORES),
    "population": ("--scores", SCORES),
    "head_turn": (),
    "postures": (),
    "people": (),
    "person_shapes": ("--bodies", "300"),
    "equal_reachability": ("--scores", SCORES),
    "printed_grid": (),
    "row_measures": (),
    "experiment": (),
    "lines": (),
    "pick_and_place": (),
    "engines": (),
    "scale": (),
    "faults": (),
    "kills": (),
    "fault_conditions": (),
    "edges": (),
    "campaign": ("--folder", "out/campaign"),
    "fuzz": ("--mutants", "10000", "--score-every", "100"),
    "fuzz_options": (),
}
"""Arguments of each script; those with times come first."""


def main() -> int:
    """Run the parts; the exit code is 1 when one failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", choices=PARTS, default=list(PARTS))
    parser.add_argument("--again", action="store_true", help="also what has been saved")
    parser.add_argument("--list", action="store_true", help="print the state, run nothing")
    options = parser.parse_args()
    failed = []
    for name in options.only:
        stamp, digest = STAMPS / f"{name}.json", digest_of(name)
        if stamp.exists() and not options.again:
            saved = json.loads(stamp.read_text(encoding="utf-8"))
            if saved["digest"] == digest:
                print(f"{name:<12} saved before, in {saved['seconds']:.0f} s", flush=True)
                continue
        if options.list:
            print(f"{name:<12} to be run")
            continue
        seconds = run(name)
        if seconds is None:
            failed.append(name)
            continue
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.write_text(json.dumps({"digest": digest, "seconds": seconds}), encoding="utf-8")
        print(f"{name:<12} saved in {seconds:.0f} s", flush=True)
    if failed:
        print(f"failed: {', '.join(failed)}; the others are saved.", file=sys.stderr)
    return 1 if failed else 0


def run(name: str) -> float | None:
    """Run a part, its output in a log file; return the time [s], None if it failed."""
    STAMPS.mkdir(parents=True, exist_ok=True)
    log = STAMPS / f"{name}.log"
    command = [sys.executable, f"benchmarks/{name}.py", *PARTS[name], "--save"]
    begun = time.perf_counter()
    with log.open("w", encoding="utf-8") as stream:
        done = subprocess.run(command, cwd=CHECKOUT, stdout=stream, stderr=subprocess.STDOUT)
    if done.returncode:
        print(f"{name:<12} failed with exit code {done.returncode}: see {log}", flush=True)
        return None
    return time.perf_counter() - begun


def digest_of(name: str) -> str:
    """Return a digest of everything that the results of a part depend on."""
    digest = hashlib.sha256(json.dumps(PARTS[name]).encode())
    folders = (
        CHECKOUT / "tcs",
        CHECKOUT / "shapes",
        CHECKOUT / "studies",
        CHECKOUT / "models",
        CHECKOUT / "tasks",
    )
    files = [path for folder in folders for path in folder.rglob("*") if path.is_file()]
    for path in sorted([*files, CHECKOUT / "benchmarks" / f"{name}.py"]):
        if "__pycache__" not in path.parts:
            digest.update(str(path.relative_to(CHECKOUT)).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


if __name__ == "__main__":
    sys.exit(main())
