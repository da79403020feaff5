"""The commands `tcs robot ...`: draft a robot file from a URDF, and check a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.output import terminal

app = typer.Typer(
    help="Robots: draft a robot file from any URDF, and check a robot.", no_args_is_help=True
)


@app.command()
def new(
    urdf: Annotated[
        str, typer.Argument(metavar="URDF", help="Path or package:// address of a URDF.")
    ],
    tool: Annotated[str, typer.Option(help="Link of the URDF that moves to the goals.")],
    base: Annotated[
        str | None,
        typer.Option(help="Link from which on joints may belong to the arm.", show_default="root"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="<urdf>.yaml")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Draft a robot file from any URDF, and a CSV file with its collision primitives."""
    from tcs.files.writing import check_writable
    from tcs.model.robots.draft import check_free, draft_robot, write_draft

    path = out or Path(f"{Path(urdf).stem}.yaml")
    check_writable(check_free(path))
    with terminal.progress_bar("bodies") as on_progress:
        draft = draft_robot(urdf, tool, base=base, name=path.stem, on_progress=on_progress)
    shapes = write_draft(draft, path)
    robot = draft.robot
    result = {
        "file": str(path),
        "primitives": str(shapes),
        "arm_base": robot.arm_base,
        "arm_joints": list(robot.arm_joints),
        "torso_joint": robot.torso_joint,
        "tool_frame": robot.tool_frame,
        "disabled_pairs": len(robot.disabled_pairs),
        "remarks": list(draft.remarks),
    }
    terminal.print_result(result, _report_draft, as_json=as_json)


def _report_draft(result: dict[str, Any]) -> None:
    """Print a draft as text."""
    typer.echo(f"wrote {result['file']} and {result['primitives']}")
    for remark in result["remarks"]:
        typer.echo(f"- {remark}")
    typer.echo(f"Review it, then: tcs robot check {result['file']}")


@app.command()
def check(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Name or YAML file of a robot.")],
    samples: Annotated[
        int, typer.Option(min=1, help="Random postures of the IK round trip.")
    ] = 1000,
    seed: options.Seed = 0,
    as_json: options.Json = False,
) -> None:
    """Check a robot: arm class, limits, primitives, self-collision, IK; exit 1 if one fails."""
    from tcs.model.checkup import check_up
    from tcs.model.robots import load_robot

    found = check_up(load_robot(robot), samples=samples, seed=seed)
    terminal.print_result(found.to_json(), _report_check, as_json=as_json)
    if not found.is_sound:
        terminal.note(f"robot '{found.robot.name}' is not fit for scoring.")
        raise typer.Exit(1)


def _report_check(found: dict[str, Any]) -> None:
    """Print the result of a check as text."""
    arm, trip, contact = found["arm_class"], found["ik_round_trip"], found["self_collision"]
    echo = typer.echo
    echo(f"robot            {found['robot']}")
    echo(
        f"arm class        {arm['class'] or 'outside the closed-form classes, solved numerically'}"
    )
    distances = ", ".join(
        f"{axes} {'parallel' if metres is None else f'{metres * 1e3:.3g} mm'}"
        for axes, metres in arm["metres_from_meeting"].items()
    )
    echo(f"axis distances   {distances}")
    echo(f"limits           {found['limits']['in_force']}")
    for name, joint in found["limits"]["joints"].items():
        echo(f"  {name:<28} {_range(joint)}")
    shapes = found["enclosed"]
    echo(f"enclosed         {shapes['triangles'] - shapes['outside']:,} of "
         f"{shapes['triangles']:,} triangles")  # fmt: skip
    echo("excess volume    " + ("largest: " if found["excess_volume"] else "none"))
    largest = sorted(found["excess_volume"].items(), key=lambda item: -item[1])
    for body, excess in largest[:5]:
        echo(f"  {body:<28} {excess:.2f}")
    margin = f"{contact['margin_m'] * 1e3:g} mm"
    echo(f"self-collision   {len(contact['pairs'])} pairs closer than {margin}")
    recovered = "tool poses solved" if arm["class"] is None else "postures recovered"
    joints = trip["max_joint_error_rad"]
    echo(
        f"IK round trip    {trip['recovered']:,} of {trip['samples']:,} {recovered}, "
        + ("" if joints is None else f"joints to {joints:.1e} rad, ")
        + f"tool to {trip['max_position_error_m']:.1e} m"
    )
    for heading in ("problems", "notes"):
        for line in found[heading]:
            echo(f"{heading[:-1]:<16} {line}")


def _range(joint: dict[str, Any]) -> str:
    if joint["continuous"]:
        return "continuous"
    shown = {name: "[{:.4f}, {:.4f}]".format(*joint[name]) for name in ("in_force", "hard")}
    same = shown["in_force"] == shown["hard"]
    return shown["in_force"] + ("" if same else f"  hard {shown['hard']}")
