"""Run the trajectory-following experiment with scripted operators, for the tables of the docs.

Usage: python benchmarks/experiment.py [--robot iiwa7] [--operators 26] [--trials 3] [--training 4]
           [--seed 0] [--line-seed 0] [--jobs 2]

It runs the same experiment as `tcs teleop experiment`. The operators are scripted, not people. The
results depend only on the seeds, not on the machine.
"""

from __future__ import annotations

import time

from table import header, parser, record_table, row, save

from tcs.model.robots import load_robot
from tcs.teleop.arm import load_arm, torso_height_of
from tcs_studies.experiment.course import find_course
from tcs_studies.experiment.within_subject import ExperimentPlan, run_experiment
from tcs_studies.output.report.experiment.pictures import phase_table
from tcs_studies.output.report.experiment.tables import (
    group_table,
    learning_table,
    motion_tables,
    signed_rank_table,
    trials_table,
)


def main() -> None:
    """Run the experiment, print its tables and record them."""
    command_line = parser(__doc__)
    command_line.add_argument("--robot", default="iiwa7")
    command_line.add_argument("--operators", type=int, default=26)
    command_line.add_argument("--trials", type=int, default=3)
    command_line.add_argument("--training", type=int, default=4)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--line-seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header("statsmodels")
    plan = ExperimentPlan(
        operators=options.operators,
        trials=options.trials,
        training=options.training,
        seed=options.seed,
    )
    robot = load_robot(options.robot)
    arm = load_arm(robot, torso_height=torso_height_of(robot))
    course = find_course(arm, options.line_seed)
    begun = time.perf_counter()
    experiment = run_experiment(arm, course, plan, jobs=options.jobs)
    row("experiment", f"{time.perf_counter() - begun:.0f} s on {options.jobs} processes")
    comparison = experiment.comparison()
    tables = dict(
        zip(
            ("groups", "tests", "motion", "pairs", "trials", "phases", "learning"),
            (
                group_table(comparison),
                signed_rank_table(comparison),
                *motion_tables(comparison),
                trials_table(comparison),
                phase_table(experiment),
                learning_table(comparison),
            ),
            strict=True,
        )
    )
    for name, table in tables.items():
        print(f"\n{table.caption}")
        for cells in table.texts():
            print("  ".join(cells))
        record_table(name, table)
    save(options)


if __name__ == "__main__":
    main()
