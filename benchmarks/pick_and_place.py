"""Run the ITCM thesis's experiment: its Table 2, the map's score against the time, sensitivity.

Usage: python benchmarks/pick_and_place.py [--operators 6] [--bases 25] [--seed 0] [--jobs 2]

Scripted operators, not people. This is a benchmark, not a test.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import stats
from table import cell, header, parser, record, record_table, row, save

from tcs.capability import (
    MapGrid,
    TaskMap,
    map_from_recording,
    merge,
    pick_and_place_task,
    visibility,
)
from tcs.capability.head import head_view
from tcs.errors import TaskError
from tcs.teleop.control.latency import Latency
from tcs_studies.output.report.pick_and_place.tables import (
    segments_table,
    table_2,
)
from tcs_studies.pick_and_place.analysis import time_with_failures
from tcs_studies.pick_and_place.master import Coupling
from tcs_studies.pick_and_place.phases import Traits
from tcs_studies.pick_and_place.protocol import (
    PickAndPlace,
    Plan,
    Robot,
    load_pick_and_place_robot,
    run_pick_and_place,
)
from tcs_studies.pick_and_place.repetition import Setting
from tcs_studies.pick_and_place.slave import Control
from tcs_studies.pick_and_place.task import CONDITIONS, EXPERT, ITCM_HIGH, ITCM_LOW, Condition
from tcs_studies.simulated_recording import HandMotion, simulate_recording

HEIGHT = 0.41
"""Height of the tool in the recording [m], as in the thesis."""
SHORT_LIMIT = 90.0
"""Time limit where many base poses are compared [s]."""
THESIS = {"tct": 71, "csa": 78, "cst": 34}
"""Increase from ITCM-high to ITCM-low in the thesis [%]."""
VARIATIONS: dict[str, dict[str, Any]] = {
    "as set": {},
    "speed halved": {"speed": 0.04},
    "speed doubled": {"speed": 0.16},
    "reaction 0.5 s": {"reaction": 0.5},
    "no mental rotation time": {"mental_rotation": 0.0},
    "mental rotation twice as slow": {"mental_rotation": 2.0 * Traits().mental_rotation},
    "learning 1 % of the angle": {"learning": 0.01},
    "learning 20 % of the angle": {"learning": 0.2},
    "adaptation 60 %": {"adaptation": 0.6},
    "adaptation 100 %": {"adaptation": 1.0},
    "depth as well as width": {"depth": 1.0},
    "depth six times worse": {"depth": 6.0},
    "misjudgement doubled": {"misjudging": 0.004, "weber": 0.06},
    "seen everywhere": {"blind": 0.002},
    "no noise in submovements": {"extent_noise": 0.0, "direction_noise": 0.0},
    "noise in submovements doubled": {"extent_noise": 0.16, "direction_noise": 0.2},
    "no tremor": {"tremor": 0.0},
    "patience 6": {"patience": 6},
}
"""Traits of the operators that are changed."""
COUPLINGS = {
    "no latency": Coupling(latency=Latency(0.0)),
    "latency 0.3 s": Coupling(latency=Latency(0.3)),
    "scale 5": Coupling(scale=5.0),
    "scale 10": Coupling(scale=10.0),
}
"""Couplings of master and slave that are changed."""


class TurnedImage(Robot):
    """The robot, with the image turned against the master by the rotation of the task."""

    def setting(self, condition: Condition, control: Control, coupling: Coupling) -> Setting:
        """Return what is the same in all repetitions from a base pose."""
        found = super().setting(condition, control, coupling)
        return replace(found, camera=replace(found.camera, angle=condition.yaw))


def main() -> None:
    """Run and print everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--operators", type=int, default=6)
    command_line.add_argument("--few", type=int, default=3, help="operators of the other tables")
    command_line.add_argument("--bases", type=int, default=25, help="base poses of the map")
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header("statsmodels")
    robot = load_pick_and_place_robot()
    the_experiment(robot, options)
    save(options)
    task = task_map(robot)
    chosen = spread_over(task, options.bases)
    correlation(robot, chosen, options)
    save(options)
    controls(robot, chosen, options)
    save(options)
    sensitivity(robot, options)


def the_experiment(robot: Robot, options: argparse.Namespace) -> None:
    """Run the experiment of the thesis and compare it with Table 2."""
    plan = Plan(operators=options.operators, seed=options.seed)
    result = run_pick_and_place(plan, robot, jobs=options.jobs)
    record_table("table_2", table_2(result))
    record_table("segments", segments_table(result))
    for cells in table_2(result).texts():
        row(cells[0], " | ".join(cells[1:]))
    for name, theirs in THESIS.items():
        low, high, expert = (mean(result, one, name) for one in (ITCM_LOW, ITCM_HIGH, EXPERT))
        cell("claims", f"ITCM-low against ITCM-high, {name} [%]", "here", f"{increase(low, high)}")
        cell("claims", f"ITCM-low against ITCM-high, {name} [%]", "thesis", f"+{theirs}")
        cell("claims", f"Expert against ITCM-high, {name} [%]", "here", increase(expert, high))
        cell("claims", f"Expert against ITCM-high, {name} [%]", "thesis", "no difference")
        row(f"{name}: low, Expert against high", f"{increase(low, high)}, {increase(expert, high)}")


def increase(value: float, reference: float) -> str:
    """Return an increase in percent."""
    percent = 100.0 * (value / reference - 1.0)
    return "none" if math.isnan(percent) else f"{percent:+.0f}"


def task_map(robot: Robot) -> TaskMap:
    """Return the thesis's task map (TS-ITCM), from a simulated recording of its length."""
    simulated = simulate_recording(robot.reach, HandMotion(height=HEIGHT), seed=0)
    grid = MapGrid.of(grasps="side")
    recorded = map_from_recording(robot.reach, grid, simulated.recording, height=HEIGHT)
    task = pick_and_place_task(0.15, HEIGHT, pre_grasps=(0.05,), direction=1)
    return merge(
        recorded.capability, task, scale="thesis", torso_height=float(robot.reach.torso_height)
    )


def spread_over(task: TaskMap, count: int) -> list[tuple[Condition, float]]:
    """Return base poses at equal steps of the rank of their score, and their scores, worst first.

    Base poses in the table are left out.
    """
    found = []
    for x, y, yaw, _, score in task.base_poses[np.argsort(task.base_poses[:, 4], kind="stable")]:
        c, s = math.cos(yaw), math.sin(yaw)
        pose = -(c * x + s * y), s * x - c * y, math.degrees(-yaw)
        try:
            found.append((Condition(f"base {len(found)}", *map(float, pose)), float(score)))
        except TaskError:
            continue
    row("base poses of the map, beside the table", f"{len(task.base_poses)}, {len(found)}")
    return [found[i] for i in np.unique(np.linspace(0, len(found) - 1, count).round().astype(int))]


def correlation(
    robot: Robot, chosen: list[tuple[Condition, float]], options: argparse.Namespace
) -> None:
    """Compare the score of base poses with the time that operators need from them."""
    conditions = tuple(condition for condition, _ in chosen)
    plan = Plan(
        operators=options.few, repetitions=2, training=1, seed=options.seed,
        conditions=conditions, time_limit=SHORT_LIMIT,
    )  # fmt: skip
    result = run_pick_and_place(plan, robot, jobs=options.jobs)
    scores = np.array([score for _, score in chosen])
    times = np.array([time_with_failures(result, one.name) for one in conditions])
    failures = np.array([result.failures(one.name) for one in conditions], dtype=float)
    view = head_view(robot.reach.scene, float(robot.reach.torso_height))
    seen = np.array([visibility(view, one.cup[None])[0] for one in conditions])
    angles = np.abs([result.settings[one.name].camera.angle for one in conditions])
    steering, taken = (
        np.array([mean(result, one, name) for one in conditions]) for name in ("csa", "tct")
    )
    done = np.isfinite(steering)
    lines = {
        "score and time, failures counting with the limit": (scores, times),
        "score and time of the successful repetitions": (scores[done], taken[done]),
        "score and csa of the successful repetitions": (scores[done], steering[done]),
        "score and failures": (scores, failures),
        "visibility of the cup and time": (seen, times),
        "angle of the camera and time": (angles, times),
    }
    for name, (a, b) in lines.items():
        found = stats.spearmanr(a, b)
        cell("correlation", name, "base poses", str(len(a)))
        cell("correlation", name, "Spearman's rho", f"{found.statistic:+.2f}")
        cell("correlation", name, "p", f"{found.pvalue:.2g}")
        row(name, f"rho {found.statistic:+.2f}, p {found.pvalue:.2g} ({len(a)} base poses)")
    rows = []
    for (one, score), time, steered in zip(
        reversed(chosen), times[::-1], steering[::-1], strict=True
    ):
        parts = [operator.recorded[one.name] for operator in result.operators]
        rows.append(
            [
                f"{one.x:.2f}, {one.y:.2f}, {one.yaw_deg:.1f}", f"{score:.2f}",
                str(round(math.degrees(result.settings[one.name].camera.angle))),
                f"{time:.1f}", "–" if math.isnan(steered) else f"{steered:.1f}",
                str(sum(len(part.successes) for part in parts)),
                str(result.failures(one.name)),
            ]
        )  # fmt: skip
    columns = (
        "task in the base: x, y [m], yaw [deg]", "score", "angle of the camera [deg]",
        "time with failures [s]", "csa [rad]", "successful", "failed",
    )  # fmt: skip
    record("bases", columns, rows)
    for cells in rows:
        print("  " + " | ".join(cells))


def controls(
    robot: Robot, chosen: list[tuple[Condition, float]], options: argparse.Namespace
) -> None:
    """Run the experiment with each control of the slave, also from base poses of our own map."""
    own = {"worst of our map": 0, "median of our map": len(chosen) // 2, "best of our map": -1}
    conditions = [*CONDITIONS]
    for name, i in own.items():
        conditions.append(replace(chosen[i][0], name=name))
    for control in Control:
        plan = Plan(
            operators=options.few, repetitions=2, training=1, seed=options.seed,
            conditions=tuple(conditions), control=control, time_limit=SHORT_LIMIT,
        )  # fmt: skip
        result = run_pick_and_place(plan, robot, jobs=options.jobs)
        for one in conditions:
            line = f"{one.name} ({one.x:.2f}, {one.y:.2f} m, {one.yaw_deg:.1f} deg)"
            text = short(result, one)
            cell("controls", line, f"{control}: tct [s], csa [rad], failed", text)
            row(f"{control}, {one.name}", text)


def short(result: PickAndPlace, condition: Condition) -> str:
    """Return time, steering and failures from a base pose."""
    tct, csa = (mean(result, condition, name) for name in ("tct", "csa"))
    failed = result.failures(condition.name)
    if math.isnan(tct):
        return f"none, {failed} failed"
    return f"{tct:.1f}, {csa:.1f}, {failed}"


def mean(result: PickAndPlace, condition: Condition, measure: str) -> float:
    """Return the mean of a measure over operators with a success, NaN without one."""
    sample = result.sample(condition.name, measure)
    sample = sample[np.isfinite(sample)]
    return float(sample.mean()) if len(sample) else math.nan


def sensitivity(robot: Robot, options: argparse.Namespace) -> None:
    """Vary traits of the operators and the coupling."""
    cases: dict[str, tuple[Robot, dict[str, Any]]] = {
        name: (robot, {"usual": Traits(**changes)}) for name, changes in VARIATIONS.items()
    }
    cases |= {name: (robot, {"coupling": coupling}) for name, coupling in COUPLINGS.items()}
    turned = TurnedImage(robot.reach, robot.arm, robot.joints)
    cases["image turned by the task's 90 deg"] = turned, {}
    for name, (one, changes) in cases.items():
        plan = Plan(
            operators=options.few, repetitions=2, training=2, seed=options.seed,
            time_limit=SHORT_LIMIT, **changes,
        )  # fmt: skip
        result = run_pick_and_place(plan, one, jobs=options.jobs)
        texts = []
        for measure in THESIS:
            expert, high, low = (mean(result, one, measure) for one in CONDITIONS)
            texts.append(f"{increase(low, high)}, {increase(expert, high)}")
            column = f"{measure}: ITCM-low, Expert against ITCM-high [%]"
            cell("sensitivity", name, column, texts[-1])
        high = mean(result, ITCM_HIGH, "tct")
        failed = ", ".join(str(result.failures(c.name)) for c in CONDITIONS)
        cell("sensitivity", name, "tct of ITCM-high [s]", f"{high:.1f}")
        cell("sensitivity", name, "failed: Expert, ITCM-high, ITCM-low", failed)
        row(name, f"{' | '.join(texts)} | {high:.1f} s | {failed}")
        # Many cases take long: what has been measured is kept.
        save(options)


if __name__ == "__main__":
    main()
