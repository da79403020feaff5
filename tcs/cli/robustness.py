"""Commands for success under error: `tcs evaluate` and `tcs robustify`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.values import observed_settings
from tcs.output import terminal
from tcs.output.terminal import set_tables

if TYPE_CHECKING:
    from tcs.placement.store import ScoreFile

_Errors = Annotated[
    Path | None,
    typer.Option(
        help="YAML file of errors by joint, in place of those of the environment.",
        show_default="those of the environment, TCS Table II",
    ),
]
Delta = Annotated[
    float | None,
    typer.Option(
        help="Weight of the success under error; above 0 only sets with an estimate by "
        "`tcs robustify` can be selected.",
        show_default="0",
    ),
]
BodyCollisions = Annotated[
    str | None,
    typer.Option(
        metavar="all|paper|none",
        help="Collisions of base, torso, head and other arm with the environment that count in a "
        "sample: all; all but those of the base with the furniture, as in the paper; or none.",
        show_default="all; paper in a file scored with --paper",
    ),
]


def evaluate(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A file made by `tcs score`, or a plan.json by `tcs plan --out`."
        ),
    ],
    samples: Annotated[
        int | None,
        typer.Option(help="Number of samples.", show_default="1000; of a plan 100"),
    ] = None,
    seed: options.Seed = 0,
    errors: _Errors = None,
    select: Annotated[
        str,
        typer.Option(
            metavar="best|single|robust|refined|uniform|equal",
            help="Set to evaluate: the best set, the best single configuration, the most robust "
            "set (greatest lower confidence bound on success, by `tcs robustify`), the best "
            "refined set (by `tcs refine`), or another set in each sample, drawn from all with P_R "
            "of at least 98 % of the greatest (uniform) or equal to it (equal).",
        ),
    ] = "best",
    members: Annotated[
        int | None,
        typer.Option(
            min=1, max=2, help="Number of members of the sets drawn uniformly.", show_default="2"
        ),
    ] = None,
    observed: options.Observed = None,
    body_collisions: BodyCollisions = None,
    replan: Annotated[
        bool, typer.Option(help="Of a plan: whether motions are also planned anew in each sample.")
    ] = True,
    blocks: options.Blocks = None,
    restart: options.Restart = False,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Evaluate the success of a set, or of a plan, in randomly perturbed environments."""
    if file.suffix == ".json":
        chosen = select != "best" or members or observed or blocks or restart
        if chosen or body_collisions is not None:
            raise typer.BadParameter(
                "of a plan, only --samples, --seed, --errors, --jobs and --no-replan can be set.",
                param_hint="FILE",
            )
        evaluate_plan_file(file, samples or 100, seed, errors, replan, jobs, as_json)
        return
    if members is not None and select not in ("uniform", "equal"):
        raise typer.BadParameter("requires --select uniform or equal.", param_hint="--members")
    if blocks is not None and select == "refined":
        raise typer.BadParameter("is not for refined sets.", param_hint="--blocks")
    kept = options.block_folder(blocks, restart)
    import tcs

    loaded = tcs.load(file)
    table = table_of(loaded, observed)
    with terminal.progress_bar("configurations in samples") as on_progress:
        found = tcs.evaluate(
            loaded,
            samples=1000 if samples is None else samples,
            seed=seed,
            errors=errors,
            select=select,
            members=members or 2,
            table=table,
            body_collisions=body_collisions,
            jobs=jobs,
            blocks=kept,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    terminal.print_result(found.to_json(), set_tables.report_evaluation, as_json=as_json)


def robustify(
    file: options.File,
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="FILE itself")
    ] = None,
    sets: Annotated[
        int, typer.Option(help="Greatest number of pairs to estimate; a quarter as many singles.")
    ] = 2000,
    samples: Annotated[
        int, typer.Option(help="Number of samples of the best sets; other sets get fewer.")
    ] = 1024,
    seed: options.Seed = 0,
    errors: _Errors = None,
    observed: options.Observed = None,
    body_collisions: BodyCollisions = None,
    blocks: options.Blocks = None,
    restart: options.Restart = False,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Estimate the success under error of the best sets, for `tcs select --delta`.

    Without --observed, the success is estimated for every observed state in the file.
    """
    import tcs
    from tcs.files.writing import check_writable
    from tcs.placement.robustness import success_summary

    path = out or file
    kept = options.block_folder(blocks, restart)
    check_writable(path)
    loaded = tcs.load(file)
    table = table_of(loaded, observed)
    with terminal.progress_bar("rounds") as on_progress:
        done = tcs.robustify(
            loaded,
            sets=sets,
            samples=samples,
            seed=seed,
            errors=errors,
            body_collisions=body_collisions,
            tables=None if table is None else [table],
            jobs=jobs,
            blocks=kept,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
        tcs.save(path, done)
    result = {"file": str(path), **success_summary(done)}
    terminal.print_result(result, set_tables.report_robustified, as_json=as_json)


def evaluate_plan_file(
    path: Path,
    samples: int,
    seed: int,
    errors: Path | None,
    replan: bool,
    jobs: int,
    as_json: bool,
) -> None:
    """Print whether the motions of a plan stay free in randomly perturbed environments."""
    from tcs.motion import evaluate_plan, load_plan

    plan = load_plan(path)
    with terminal.progress_bar("steps") as on_progress:
        found = evaluate_plan(
            plan,
            samples=samples,
            seed=seed,
            errors=errors,
            replan=replan,
            jobs=jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    terminal.print_result(found.to_json(), set_tables.report_plan_success, as_json=as_json)


def table_of(loaded: ScoreFile, observed: list[str] | None) -> int | None:
    """Return the number of the table nearest to the observation, None without an observation."""
    if not observed:
        return None
    from tcs.placement.selection.observed import nearest_table

    settings = observed_settings(observed, loaded.observed_axes)
    return nearest_table(loaded, observed=settings).index
