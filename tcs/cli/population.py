"""The command `tcs population`: which people the best sets serve."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.robustness import table_of
from tcs.output import terminal

if TYPE_CHECKING:
    from tcs.model.people import Bodies


@dataclass(frozen=True, kw_only=True)
class _PeopleOptions:
    """Whom the sets are to serve."""

    bodies: Annotated[
        int | None,
        typer.Option(min=1, help="Number of people to draw.", show_default="1000"),
    ] = None
    sex: Annotated[
        str | None,
        typer.Option(
            metavar="any|female|male",
            help="Sex of the people to draw; any: women and men in equal parts.",
            show_default="any",
        ),
    ] = None
    age: Annotated[
        float | None,
        typer.Option(
            metavar="YEARS",
            help="Age of the people to draw, of children from 4 years.",
            show_default="adults",
        ),
    ] = None
    people: Annotated[
        Path | None,
        typer.Option(
            metavar="CSV",
            help="Measured people in place of drawn ones: a row for each, with the columns sex, "
            "age (of children) and measures of docs/people.md (m, kg) or NAME_percentile.",
        ),
    ] = None

    def check(self) -> None:
        """Check that the people are either drawn or measured.

        Raises:
            typer.BadParameter: If both are requested.
        """
        drawn = (self.bodies, self.sex, self.age)
        if self.people is not None and any(given is not None for given in drawn):
            raise typer.BadParameter("excludes --bodies, --sex and --age.", param_hint="--people")

    def found(self, seed: int) -> Bodies:
        """Return the people.

        Raises:
            DataFileError: If the file cannot be used.
            UnknownNameError: If the sex, or a column of the file, is unknown.
            TcsError: If the number or the seed is out of range.
        """
        from tcs.model.people import draw_bodies, load_people

        if self.people is not None:
            return load_people(self.people)
        number = 1000 if self.bodies is None else self.bodies
        return draw_bodies(number, sex=self.sex or "any", age=self.age, seed=seed)


@expand_options
def population(
    file: options.File,
    *,
    who: _PeopleOptions,
    sets: Annotated[
        int, typer.Option(min=1, max=100, help="Number of sets, those with the best scores.")
    ] = 10,
    min_apart: Annotated[
        float,
        typer.Option(help="Distance at which base positions of two sets count as different (m)."),
    ] = 0.5,
    errors: Annotated[
        bool,
        typer.Option(
            "--errors",
            help="Displace person and furniture by the random errors of the environment, one "
            "sample for each person.",
        ),
    ] = False,
    error_file: Annotated[
        Path | None,
        typer.Option(help="The same, with the errors by joint of a YAML file."),
    ] = None,
    seed: options.Seed = 0,
    observed: options.Observed = None,
    map_to: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="PICTURE",
            help="Draw success over stature and abdominal depth: .png, .pdf or .svg.",
        ),
    ] = None,
    blocks: options.Blocks = None,
    restart: options.Restart = False,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Count the people of a population whom the best sets serve: all goals are reached for them."""
    who.check()
    kept = options.block_folder(blocks, restart)
    import tcs
    from tcs.output.terminal import set_tables

    if map_to is not None:
        from tcs.files.writing import check_writable
        from tcs.output.draw import check_format

        check_format(map_to)
        check_writable(map_to)
    people = who.found(seed)
    loaded = tcs.load(file)
    table = table_of(loaded, observed)
    with terminal.progress_bar("people") as on_progress:
        found = tcs.population(
            loaded,
            people,
            top=tcs.Top(count=sets, min_apart=min_apart),
            errors=errors if error_file is None else error_file,
            seed=seed,
            table=table,
            jobs=jobs,
            blocks=kept,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    if map_to is not None:
        from tcs.output.draw import population_figure, save_figure

        save_figure(map_to, population_figure(found))
    result = found.to_json() | ({} if map_to is None else {"map": str(map_to)})
    terminal.print_result(result, set_tables.report_population, as_json=as_json)
