"""The commands about success under error: `tcs evaluate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import reports, talk
from tcs.cli.places import observed_settings

_File = Annotated[Path, typer.Argument(metavar="FILE", help="A file made by `tcs score`.")]
_Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
_Seed = Annotated[int, typer.Option(min=0, help="Seed of the random errors.")]
_Jobs = Annotated[int, typer.Option(min=1, help="Number of threads; results are the same.")]
_Errors = Annotated[
    Path | None,
    typer.Option(
        help="YAML file of errors by joint, in place of the environment's own.",
        show_default="those of the environment, TCS Table II",
    ),
]
_Observed = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="How the person is believed to be found, e.g. person_y=0.05; the nearest state that "
        "was scored is used.",
    ),
]
_CheckBase = Annotated[
    bool,
    typer.Option("--check-base", help="The base must stay free, too; the paper leaves that out."),
]


def evaluate(
    file: _File,
    samples: Annotated[int, typer.Option(help="Number of samples.")] = 1000,
    seed: _Seed = 0,
    errors: _Errors = None,
    select: Annotated[
        str,
        typer.Option(
            metavar="best|single|uniform",
            help="Which set: the best one, the best place alone, or in each sample another one "
            "drawn from all that reach as much as the best (98 % of it).",
        ),
    ] = "best",
    members: Annotated[
        int | None,
        typer.Option(min=1, max=2, help="Members of the sets drawn uniformly.", show_default="2"),
    ] = None,
    observed: _Observed = None,
    check_base: _CheckBase = False,
    jobs: _Jobs = 2,
    as_json: _Json = False,
) -> None:
    """Try a set again in rooms a little off: how much of the task is still done?"""
    if members is not None and select != "uniform":
        raise typer.BadParameter("goes with --select uniform only.", param_hint="--members")
    import tcs

    loaded = tcs.load(file)
    table = _table(loaded, observed)
    with talk.progress_bar("configurations in samples") as on_progress:
        found = tcs.evaluate(
            loaded,
            samples=samples,
            seed=seed,
            errors=errors,
            select=select,
            members=members or 2,
            table=table,
            check_base=check_base,
            jobs=jobs,
            on_progress=on_progress,
            on_compile=lambda: talk.say(
                "compiling for this machine, up to a minute; later runs do without."
            ),
        )
    talk.print_result(found.to_json(), report_evaluation, as_json=as_json)


def _table(loaded: Any, observed: list[str] | None) -> int | None:
    """Return the number of the table nearest to what is observed, None where nothing is."""
    if not observed:
        return None
    from tcs.select.observed import nearest_table

    settings = observed_settings(observed, loaded.observed_axes)
    return nearest_table(loaded, observed=settings).index


def report_evaluation(result: Mapping[str, Any]) -> None:
    """Print what is left of a set under error."""
    out = talk.paper()
    if result["members"]:
        out.print(reports.members_table(result["members"]))
    else:
        out.print(f"Each sample: a set drawn from {result['choices']:,} that reach as much.")
    low, high = result["ci95"]
    out.print(
        f"without error {result['reachability']:.1%} of the goals, manipulability "
        f"{result['manipulability']:.3f}"
    )
    out.print(
        f"under error {result['mean']:.1%} of the goals (95 % between {low:.1%} and {high:.1%}), "
        f"standard deviation {result['std']:.1%}; all goals in {result['complete']:.1%} of "
        f"{result['samples']:,} samples"
    )
    goals = ", ".join(f"{i}: {share:.1%}" for i, share in enumerate(result["per_goal"]))
    out.print(f"by goal  {goals}")
    widths = ", ".join(f"{joint} {_width(error)}" for joint, error in result["errors"].items())
    base = "" if result["check_base"] else "; the base is not checked, as in the paper"
    out.print(f"errors  {widths}{base}")
    if result["clipped"]:
        out.print(f"in {result['clipped']:,} samples a joint was stopped at its limit")
    out.print(f"seed {result['seed']}, {result['seconds']:.1f} s")


def _width(error: Mapping[str, Any]) -> str:
    """Return an error in words, e.g. "normal 0.05 m"."""
    (key, width) = next((k, v) for k, v in error.items() if k != "distribution")
    sign = "sd" if error["distribution"] == "normal" else "uniform ±"
    return f"{sign} {width:g} {'deg' if key.endswith('_deg') else 'm'}"
