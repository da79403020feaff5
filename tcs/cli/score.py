"""Commands that make, verify and export score files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.refinement import refined_in_place
from tcs.output import terminal
from tcs.output.terminal import set_tables, tables

if TYPE_CHECKING:
    from tcs.motion import ApproachCheck
    from tcs.placement.store import ScoreFile

PAIRS_PER_APPROACH = 20
"""Pairs re-checked for each approach re-checked: Drake takes a second for the postures of one."""


@expand_options
def score(
    task: Annotated[
        str | None,
        typer.Argument(metavar="TASK", help="Name or YAML file of a task.", show_default=False),
    ] = None,
    environment: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of an environment.", show_default="wheelchair"),
    ] = None,
    everything: Annotated[
        bool,
        typer.Option(
            "--all", help="Score every task in each of its environments, or in the one named."
        ),
    ] = False,
    robot: options.Robot = "pr2",
    tool: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML file of a tool in the robot's hand, whose tip moves to the goals.",
            show_default="none",
        ),
    ] = None,
    arms: Annotated[
        str | None,
        typer.Option(
            metavar="ARM|both",
            help="Arm of the goals that name none, e.g. left; both: each goal is reached by the "
            "arm that reaches it best.",
            show_default="that of the robot file",
        ),
    ] = None,
    measure: Annotated[
        str,
        typer.Option(
            help="Dexterity measure to maximise: isotropy or inverse-condition; -limited lowers it "
            "near joint limits, -limited-thesis with the penalty printed in the ITCM thesis; or "
            "jlwki, the isotropy with the joints weighted by their distance to their limits."
        ),
    ] = "isotropy",
    paper: Annotated[
        bool,
        typer.Option(
            "--paper",
            help="Score as the papers do: each goal at its exact pose, whatever else the task says "
            "serves as well, by any posture, whether or not it can be approached; and count "
            "contacts of the body as they do in what follows.",
        ),
    ] = False,
    approach: Annotated[
        bool,
        typer.Option(
            "--approach",
            help="Refuse tasks and robots whose approaches cannot be scored. A goal counts as "
            "reached only if a posture there can be approached: backwards along the goal's "
            "straight line, within the limits, touching nothing.",
            show_default="scored with approach where it can be",
        ),
    ] = False,
    no_approach: Annotated[bool, typer.Option("--no-approach", hidden=True)] = False,
    refine: Annotated[
        bool,
        typer.Option("--refine", help="Then refine the best sets between the grid points."),
    ] = False,
    jobs: options.Jobs = 2,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; with --all, the folder.",
            show_default="<task>-<environment>-<robot>.tcs",
        ),
    ] = None,
    rules: Annotated[
        str,
        typer.Option(help="Rule for the kept sets: paper, or code2015 as in the original program."),
    ] = "paper",
    same_environment: Annotated[
        bool,
        typer.Option(
            "--same-environment",
            help="Keep only sets whose members share the environment state.",
        ),
    ] = False,
    max_members: Annotated[
        int,
        typer.Option(
            min=1, max=3, help="Greatest number of members of a set; with 3 it takes longer."
        ),
    ] = 2,
    *,
    wanted: options.ScoringConstraintOptions,
    observed: Annotated[
        list[str] | None,
        typer.Option(
            metavar="JOINT=VALUE",
            help="Score the observed environment, e.g. person_x=0.025 (m; JOINT_deg=VALUE).",
        ),
    ] = None,
    frames: Annotated[
        list[str] | None,
        options.frames(
            "Score the environment from the observed position of a frame on the person or the "
            "furniture, in the environment frame (m; a quaternion ,QW,QX,QY,QZ may follow)."
        ),
    ] = None,
    at: options.At = None,
    person: options.Person = None,
    blocks: options.Blocks = None,
    restart: options.Restart = False,
    engine: Annotated[
        str,
        typer.Option(help="Who scores: threads, or dask for the workers of a cluster."),
    ] = "threads",
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="With --engine dask: what `dask scheduler` prints, tcp://..."
        ),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="Only estimate time, memory and disk, from some slices of the grid."
        ),
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Score every initial configuration of a grid and build the sets to select from."""
    if (task is None) != everything:
        raise typer.BadParameter("give a task, or --all for all tasks.", param_hint="TASK")
    if task is None and (observed or frames):
        raise typer.BadParameter("requires one task, not --all.", param_hint="--observed")
    if approach and (paper or no_approach):
        other = "--paper" if paper else "--no-approach"
        raise typer.BadParameter(
            f"cannot be combined with {other}, which scores without.", param_hint="--approach"
        )
    kept = options.block_folder(blocks, restart)
    if refine and dry_run:
        raise typer.BadParameter("requires scores, not --dry-run.", param_hint="--refine")
    if engine != "threads" and dry_run:
        raise typer.BadParameter(
            "other than threads is for scoring a whole grid.", param_hint="--engine"
        )
    constraints = wanted.constraints()
    if at and not frames and not constraints.keep:
        raise typer.BadParameter(
            "requires --frames or --keep: it is the present setting of the environment.",
            param_hint="--at",
        )

    import tcs
    from tcs.cli.values import frame_values, observed_settings, person_values, settings
    from tcs.model.robot_check import quick_problems
    from tcs.model.scene import load_environment
    from tcs.placement.scoring import default_path, score_to_file
    from tcs.placement.scoring.engines import engine_named

    work: dict[str, Any] = {
        "arms": arms,
        "blocks": kept,
        "engine": engine_named(engine, jobs=jobs, scheduler=scheduler),
    }
    scoring_options: dict[str, Any] = {
        "measure": measure,
        "paper": paper,
        "approach": True if approach else False if no_approach else None,
        "rule": rules,
        "same_environment": same_environment,
        "max_members": max_members,
        "constraints": constraints,
        "now": settings(at or (), "--at"),
        "person": person_values(person or ()),
        "jobs": jobs,
        "on_compile": terminal.note_compiling,
    }
    observation = None
    if observed or frames:
        observation = tcs.Observation(
            joints=observed_settings(
                observed or (), load_environment(environment or "wheelchair").observable_axes
            ),
            frames=frame_values(frames or ()),
            setting=settings(at or (), "--at"),
        )
    if dry_run:
        rows = score_to_file.estimate_all(
            task, environment, robot, observation=observation, arms=arms, **scoring_options
        )
        terminal.print_result({"rows": rows}, tables.report_estimates, as_json=as_json)
        return
    if task is None:
        rows = score_to_file.score_all_to_files(
            environment,
            robot,
            out or Path(),
            progress=_progress,
            **work,
            **scoring_options,
        )
        _note_without_approach(rows)
        if refine:
            for row in rows:
                if row["best"]:
                    row["refinement"] = refined_in_place(Path(row["file"]), jobs)
        terminal.print_result({"rows": rows}, tables.report_rows, as_json=as_json)
        return
    environment = environment or "wheelchair"
    path = out or default_path(task, environment, robot, arms)
    if tool is not None:
        from tcs.model.robots import holding

        path = out or path.with_stem(f"{path.stem}-{Path(tool).stem}")
        robot = holding(robot, tool)
    if out is None and person:
        # By default, do not overwrite the file of the papers' man.
        path = path.with_stem(f"{path.stem}-person")
    for problem in quick_problems(robot):
        terminal.note(f"warning, robot '{robot}': {problem} See: tcs robot check {robot}")
    if observation is not None and out is None:
        # By default, do not overwrite the file of the task scored offline.
        path = path.with_stem(f"{path.stem}-live")
    with _progress(task) as on_progress:
        result = score_to_file.score_to_file(
            task, environment, robot, path, observation=observation, on_progress=on_progress,
            **work, **scoring_options,
        )  # fmt: skip
    _note_without_approach([result])
    if refine:
        result["refinement"] = refined_in_place(path, jobs)
    result = _with_places(result)
    report = tables.report_observed if observation is not None else tables.report_scores
    terminal.print_result(result, report, as_json=as_json)
    if refine and not as_json:
        set_tables.report_refined({**result["refinement"], "file": path})


def _note_without_approach(results: Sequence[Mapping[str, Any]]) -> None:
    """Say why approaches were not scored, where nobody asked for that."""
    for reason in dict.fromkeys(result["no_approach"] for result in results):
        if reason is not None:
            terminal.note(f"scored without approach: {reason}.")


def _with_places(result: dict[str, Any]) -> dict[str, Any]:
    """Return the summary of a saved score file with the places of its best sets in words."""
    from tcs.output.words import summary_in_words
    from tcs.placement.store import load_scores

    return summary_in_words(load_scores(Path(result["file"])), result)


@expand_options
def verify(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A file made by `tcs score`, or a plan.json by `tcs plan --out`."
        ),
    ],
    sizes: options.CheckOptions,
    strata: Annotated[
        bool,
        typer.Option(
            "--strata",
            help="Scan every unreached pair that only a search of the arm can decide, for minutes.",
        ),
    ] = False,
    limit: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="With --strata: greatest number of random pairs to scan for each reason.",
            show_default="all",
        ),
    ] = None,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Re-check answers with Drake and estimate the recall of the search, or re-check a plan."""
    if limit is not None and not strata:
        raise typer.BadParameter("requires --strata.", param_hint="--limit")
    is_sound, result = answers_checked(file, sizes, strata=strata, limit=limit, jobs=jobs)
    is_plan = file.suffix == ".json"
    report = set_tables.report_plan_check if is_plan else tables.report_verification
    terminal.print_result(result, report, as_json=as_json)
    if not is_sound:
        what = f"the plan '{file}' is false" if is_plan else f"some answers in '{file}' are false"
        terminal.note(f"{what}; do not use {'it' if is_plan else 'them'}.")
        raise typer.Exit(1)


def answers_checked(
    file: Path,
    sizes: options.CheckOptions,
    *,
    strata: bool = False,
    limit: int | None = None,
    jobs: int = 2,
) -> tuple[bool, dict[str, Any]]:
    """Return whether Drake finds no false answer in scores or a plan, and what was found."""
    if file.suffix == ".json":
        return _plan_checked(file)

    import tcs
    from tcs.placement.scoring.verify import FALSE_VERDICT
    from tcs.placement.store import APPROACH

    loaded = tcs.load(file)
    with terminal.progress_bar("pairs") as on_progress:
        found = tcs.verify(
            loaded,
            pairs=sizes.pairs,
            dense=sizes.dense,
            strata=strata,
            limit=limit,
            jobs=jobs,
            seed=sizes.seed,
            on_progress=on_progress,
        )
    result, is_sound = {**found.to_json(), "approaches": None}, found.is_sound
    if APPROACH in loaded.metadata:
        approaches = _verify_approaches(loaded, sizes.pairs // PAIRS_PER_APPROACH, sizes.seed)
        result["approaches"] = approaches.to_json()
        if not approaches.is_sound:
            result["verdict"], is_sound = FALSE_VERDICT, False
    return is_sound, result


def _plan_checked(path: Path) -> tuple[bool, dict[str, Any]]:
    """Return whether Drake confirms a plan, and what was found."""
    from tcs.motion import check_plan, load_plan

    plan = load_plan(path)
    with terminal.progress_bar("segments") as on_progress:
        found = check_plan(plan, on_progress=on_progress)
    return found.is_sound, found.to_json()


def _verify_approaches(file: ScoreFile, pairs: int, seed: int) -> ApproachCheck:
    """Re-check approaches of random reached pairs."""
    from tcs.motion import check_approaches

    with terminal.progress_bar("approaches") as on_progress:
        return check_approaches(file, pairs=pairs, seed=seed, on_progress=on_progress)


def export(
    file: options.File,
    out: Annotated[Path, typer.Option(help="CSV file to write.")],
    everything: Annotated[
        bool, typer.Option("--all", help="Include configurations that reach no goal.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Write scores as a CSV table, one row for each configuration that reaches a goal.

    Goals are numbered from 0 there: reason_0 and dexterity_0 are of goal 1 of `tcs explain`.
    """
    result = exported(file, out, everything=everything)
    terminal.print_result(
        result, lambda _: typer.echo(f"wrote {out}: {result['rows']:,} rows"), as_json=as_json
    )


def exported(file: Path, out: Path, *, everything: bool = False) -> dict[str, Any]:
    """Write scores as a CSV table and return what was written."""
    import tcs
    from tcs.files.writing import check_writable

    check_writable(out, [file])
    loaded = tcs.load(file)

    from tcs.placement.store.frame import score_frame, write_csv

    frame = score_frame(loaded, everything=everything)
    write_csv(out, frame)
    return {"file": str(out), "rows": len(frame), "columns": list(frame.columns)}


def _progress(task: str) -> AbstractContextManager[Any]:
    """Return the progress bar of one task."""
    return terminal.progress_bar(f"configurations, {Path(task).stem}")
