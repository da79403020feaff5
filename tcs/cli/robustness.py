"""Commands for success under error: `tcs evaluate` and `tcs robustify`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.values import observed_settings
from tcs.output import terminal
from tcs.output.terminal import tables
from tcs.output.words import member_text, settings_text
from tcs.output.words.robustness import BODY_COLLISIONS, error_width

_Errors = Annotated[
    Path | None,
    typer.Option(
        help="YAML file of errors by joint, in place of those of the environment.",
        show_default="those of the environment, TCS Table II",
    ),
]
Delta = Annotated[
    float,
    typer.Option(
        help="Weight of the success under error; above 0 only sets with an estimate by "
        "`tcs robustify` can be selected."
    ),
]
_BodyCollisions = Annotated[
    str,
    typer.Option(
        metavar="paper|all|none",
        help="Collisions of base, torso, head and other arm with the environment that count in a "
        "sample: all but those of the base with the furniture, as in the paper; all; or none.",
    ),
]
_CheckBase = Annotated[
    bool, typer.Option("--check-base", help="The same as --body-collisions all.")
]


def evaluate(
    file: options.File,
    samples: Annotated[int, typer.Option(help="Number of samples.")] = 1000,
    seed: options.Seed = 0,
    errors: _Errors = None,
    select: Annotated[
        str,
        typer.Option(
            metavar="best|single|robust|uniform",
            help="Set to evaluate: the best set, the best single configuration, the most robust "
            "set (greatest lower confidence bound on success, by `tcs robustify`), or another set "
            "in each sample, drawn from all with P_R of at least 98 % of the greatest.",
        ),
    ] = "best",
    members: Annotated[
        int | None,
        typer.Option(
            min=1, max=2, help="Number of members of the sets drawn uniformly.", show_default="2"
        ),
    ] = None,
    observed: options.Observed = None,
    body_collisions: _BodyCollisions = "paper",
    check_base: _CheckBase = False,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Evaluate the success of a set in randomly perturbed environments."""
    if members is not None and select != "uniform":
        raise typer.BadParameter("requires --select uniform.", param_hint="--members")
    import tcs

    loaded = tcs.load(file)
    table = _table(loaded, observed)
    with terminal.progress_bar("configurations in samples") as on_progress:
        found = tcs.evaluate(
            loaded,
            samples=samples,
            seed=seed,
            errors=errors,
            select=select,
            members=members or 2,
            table=table,
            body_collisions="all" if check_base else body_collisions,
            jobs=jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    terminal.print_result(found.to_json(), report_evaluation, as_json=as_json)


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
    body_collisions: _BodyCollisions = "paper",
    check_base: _CheckBase = False,
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
    check_writable(path)
    loaded = tcs.load(file)
    table = _table(loaded, observed)
    with terminal.progress_bar("rounds") as on_progress:
        done = tcs.robustify(
            loaded,
            sets=sets,
            samples=samples,
            seed=seed,
            errors=errors,
            body_collisions="all" if check_base else body_collisions,
            tables=None if table is None else [table],
            jobs=jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
        tcs.save(path, done)
    result = {"file": str(path), **success_summary(done)}
    terminal.print_result(result, report_robustified, as_json=as_json)


def report_robustified(result: Mapping[str, Any]) -> None:
    """Print the most robust set of each size with its estimate."""
    out = terminal.results_console()
    table = tables.new_table("observed", "set", ">success", ">95 % interval", ">sets", "members")
    for row in result["tables"]:
        state = settings_text(row["observed"]) or "-"
        for best in row["best"]:
            low, high = best["ci95"]
            table.add_row(
                state,
                f"of {len(best['members'])}",
                f"{best['success']:.1%}",
                f"{low:.1%} to {high:.1%}",
                f"{best['sets']:,}",
                "; ".join(member_text(member) for member in best["members"]),
            )
    out.print(table)
    out.print(f"wrote {result['file']}. To select by success, with the current base X Y YAW_DEG:")
    typer.echo(f"tcs select {shlex.quote(result['file'])} --here X Y YAW_DEG --delta 1")


def _table(loaded: Any, observed: list[str] | None) -> int | None:
    """Return the number of the table nearest to the observation, None without an observation."""
    if not observed:
        return None
    from tcs.placement.selection.observed import nearest_table

    settings = observed_settings(observed, loaded.observed_axes)
    return nearest_table(loaded, observed=settings).index


def report_evaluation(result: Mapping[str, Any]) -> None:
    """Print the success of a set under error."""
    out = terminal.results_console()
    if result["members"]:
        out.print(tables.members_table(result["members"]))
    else:
        out.print(f"one of {result['choices']:,} sets with equal P_R is drawn for each sample")
    interval = ""
    if result["ci95"] is not None:
        low, high = result["ci95"]
        interval = f" (95 % interval {low:.1%} to {high:.1%})"
    out.print(
        f"without error {result['reachability']:.1%} of the goals, manipulability "
        f"{result['manipulability']:.3f}"
    )
    out.print(
        f"under error {result['mean']:.1%} of the goals{interval}, "
        f"standard deviation {result['std']:.1%}; all goals in {result['complete']:.1%} of "
        f"{result['samples']:,} samples"
    )
    goals = ", ".join(f"{i}: {part:.1%}" for i, part in enumerate(result["per_goal"]))
    out.print(f"by goal  {goals}")
    widths = ", ".join(f"{joint} {error_width(error)}" for joint, error in result["errors"].items())
    out.print(f"errors  {widths}")
    out.print(f"collisions  {BODY_COLLISIONS[result['body_collisions']]}")
    if result["clipped"]:
        out.print(f"in {result['clipped']:,} samples an error was limited by a joint limit")
    out.print(f"seed {result['seed']}, {result['seconds']:.1f} s")
