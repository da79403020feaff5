"""The commands `tcs arplace merge` and `show`, and the pictures of maps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import arplace_tables

if TYPE_CHECKING:
    from tcs.capability.arplace import ProbabilityMap

PICTURE = "Picture to write: .png, .pdf or .svg."
FIGURES = ("modes", "reconstruction", "generalisation")


def merge(
    maps: Annotated[
        list[Path], typer.Argument(metavar="MAP...", help="Maps made by `tcs arplace query --out`.")
    ],
    rule: Annotated[
        str,
        typer.Option(
            metavar="max|product",
            help="max: several grasps of one object; product: several objects.",
        ),
    ] = "max",
    out: Annotated[Path | None, typer.Option(help="Also write the merged map.")] = None,
    picture: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    as_json: options.Json = False,
) -> None:
    """Merge probability maps of the same base positions."""
    from tcs.capability.arplace import load_probability_map, merge_maps, save_probability_map

    check_outputs(out, picture)
    merged = merge_maps([load_probability_map(path) for path in maps], rule)
    i, j = merged.best()
    best = (float(merged.x[i]), float(merged.y[j]))
    if out is not None:
        save_probability_map(out, merged)
    if picture is not None:
        draw_map(picture, merged, best, f"{rule} of {len(maps)} maps")
    result = arplace_tables.merged_result(merged, rule, len(maps))
    terminal.print_result(result, arplace_tables.report_merged, as_json=as_json)


def show(
    model: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A model or a probability map."),
    ],
    out: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    figure: Annotated[
        str | None,
        typer.Option(
            metavar="modes|reconstruction|generalisation",
            help="With --out, picture of a model: deformation modes and their energy, errors of "
            "the reconstruction, or boundaries by degree and energy.",
            show_default="modes",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Print a summary of a model or a map, and draw it."""
    from tcs.capability.arplace import load_arplace, load_probability_map
    from tcs.capability.arplace.model_files import is_probability_map

    if figure is not None and out is None:
        raise typer.BadParameter("requires --out.", param_hint="--figure")
    if figure not in (None, *FIGURES):
        raise typer.BadParameter(f"must be one of {', '.join(FIGURES)}.", param_hint="--figure")
    check_outputs(None, out)
    if is_probability_map(model):
        found = load_probability_map(model)
        if figure is not None:
            raise typer.BadParameter("a map has a single figure.", param_hint="--figure")
        i, j = found.best()
        if out is not None:
            draw_map(out, found, (float(found.x[i]), float(found.y[j])), "")
        result = arplace_tables.merged_result(found, "none", 1)
        terminal.print_result(result, arplace_tables.report_merged, as_json=as_json)
        return
    arplace = load_arplace(model)
    if out is not None:
        from tcs.output.draw import save_figure
        from tcs.output.draw.arplace import figure_of

        save_figure(out, figure_of(arplace, figure or FIGURES[0]))
    result = arplace_tables.model_result(model, arplace)
    terminal.print_result(result, arplace_tables.report_model, as_json=as_json)


def check_outputs(out: Path | None, picture: Path | None) -> None:
    """Check that files can be written, before the result is computed."""
    if picture is not None:
        from tcs.output.draw import check_format

        check_format(picture)
    for path in (out, picture):
        if path is not None:
            check_writable(path)


def draw_map(
    path: Path, found: ProbabilityMap, best: tuple[float, float], caption: str
) -> None:  # fmt: skip
    """Write a picture of a probability map with its best base position [m]."""
    from tcs.output.draw import save_figure
    from tcs.output.draw.arplace import map_figure

    save_figure(path, map_figure(found, best, caption))
