"""Results on robots as text: a drafted robot file, and the check of a robot."""

from __future__ import annotations

from typing import Any

import typer


def report_draft(result: dict[str, Any]) -> None:
    """Print a draft as text."""
    typer.echo(f"wrote {result['file']} and {result['primitives']}")
    for remark in result["remarks"]:
        typer.echo(f"- {remark}")
    typer.echo(f"Review it, then: tcs robot check {result['file']}")


def report_check(found: dict[str, Any]) -> None:
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
        echo(f"  {name:<28} {_limits(joint)}")
    shapes = found["enclosed"]
    echo(f"enclosed         {shapes['triangles'] - shapes['outside']:,} of "
         f"{shapes['triangles']:,} triangles")  # fmt: skip
    echo("excess volume    " + ("largest: " if found["excess_volume"] else "none"))
    largest = sorted(found["excess_volume"].items(), key=lambda item: -item[1])
    for body, excess in largest[:5]:
        echo(f"  {body:<28} {excess:.2f}")
    if found["hand_beyond_tool_m"] is not None:
        beyond = found["hand_beyond_tool_m"]
        side = "beyond" if beyond >= 0.0 else "behind"
        echo(f"tool frame       the hand ends {abs(beyond):.3f} m {side} it")
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


def _limits(joint: dict[str, Any]) -> str:
    """Return the limits of a joint used in scoring, and its hard limits if they differ."""
    if joint["continuous"]:
        return "continuous"
    shown = {name: "[{:.4f}, {:.4f}]".format(*joint[name]) for name in ("in_force", "hard")}
    same = shown["in_force"] == shown["hard"]
    return shown["in_force"] + ("" if same else f"  hard {shown['hard']}")
