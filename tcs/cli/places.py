"""Values that commands take: a place, values of axes, a file to write."""

from __future__ import annotations

import math
import secrets
from collections.abc import Sequence
from pathlib import Path

import typer

from tcs.errors import OutputError, SelectionError
from tcs.model.grid import Axis, InitialConfiguration


def place_told(
    here: tuple[float, float, float] | None, torso: float
) -> InitialConfiguration | None:
    """Return the current state, None where nobody says where the robot is.

    Args:
        here: x [m], y [m] and heading [deg] in the environment frame, or None.
        torso: Torso lift [m].

    Raises:
        typer.BadParameter: If there is a torso lift without a place.
    """
    if here is not None:
        return place(here, torso)
    if torso:
        raise typer.BadParameter("needs --here.", param_hint="--torso")
    return None


def place(
    here: tuple[float, float, float], torso: float = 0.0, at: Sequence[str] = ()
) -> InitialConfiguration:
    """Return the current state.

    Args:
        here: x [m], y [m] and heading [deg] in the environment frame.
        torso: Torso lift [m].
        at: Settings of the environment's axes as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg].

    Raises:
        SelectionError: If a setting is none.

    >>> place((1.0, 2.0, 180.0), 0.1, ["head_rest_deg=90"]).environment
    (('head_rest', 1.5707963267948966),)
    """
    x, y, yaw_deg = here
    set_now = settings(at, "--at")
    units = ["rad" if name.endswith("_deg") else "m" for name, _ in axis_values(at, "--at")]
    return InitialConfiguration(
        base_x=x,
        base_y=y,
        base_yaw=math.radians(yaw_deg),
        torso=torso,
        environment=tuple(set_now.items()),
        environment_units=tuple(units),
    )


def settings(given: Sequence[str], option: str) -> dict[str, float]:
    """Return settings of axes given as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg], in m and rad.

    Args:
        given: What stood on the command line.
        option: Name of the option, for the message.

    Raises:
        SelectionError: If one is not of that form, or an axis is set twice.

    >>> settings(["person_y=0.05"], "--observed")
    {'person_y': 0.05}
    """
    found: dict[str, float] = {}
    for name, value in axis_values(given, option):
        axis = name.removesuffix("_deg")
        if axis in found:
            raise SelectionError(f"{option} sets '{axis}' twice. Give it once.")
        found[axis] = math.radians(value) if name.endswith("_deg") else value
    return found


def observed_settings(given: Sequence[str], axes: Sequence[Axis]) -> dict[str, float]:
    """Return how the person is found, given as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg].

    Args:
        given: What stood on the command line.
        axes: The observed axes of the score file; names that are none of them pass.

    Raises:
        SelectionError: If one is not of that form or in the other unit, or an axis is set twice.

    >>> observed_settings(["person_y=0.05"], [Axis("person_y", "m", -0.1, 0.05, 5)])
    {'person_y': 0.05}
    """
    found = settings(given, "--observed")
    written = [name for name, _ in axis_values(given, "--observed")]
    for axis in axes:
        right = f"{axis.name}_deg" if axis.unit == "deg" else axis.name
        if axis.name in found and right not in written:
            raise SelectionError(
                f"--observed: '{axis.name}' is scored in {axis.unit}. Write {right}=VALUE."
            )
    return found


def frame_places(given: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Return places of body frames given as "FRAME=X,Y,Z" [m].

    Raises:
        SelectionError: If one is not of that form.

    >>> frame_places(["head=0.29,0.05,0.68"])
    {'head': (0.29, 0.05, 0.68)}
    """
    places = {}
    for text in given:
        name, _, numbers = text.partition("=")
        try:
            places[name] = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            raise SelectionError(
                f"--seen is '{text}'; must be FRAME=X,Y,Z, e.g. head=0.29,0.05,0.68."
            ) from None
    return places


def axis_values(given: Sequence[str], option: str) -> tuple[tuple[str, float], ...]:
    """Return names and numbers given as "NAME=NUMBER".

    Args:
        given: What stood on the command line.
        option: Name of the option, for the message.

    Raises:
        SelectionError: If one is not of that form.
    """
    pairs = []
    for text in given:
        name, _, number = text.partition("=")
        try:
            pairs.append((name, float(number)))
        except ValueError:
            raise SelectionError(
                f"{option} is '{text}'; must be NAME=NUMBER, e.g. bed_height=0.2."
            ) from None
    return tuple(pairs)


def check_writable(path: Path) -> None:
    """Refuse a file that could not be written, before the work that is to fill it.

    Raises:
        OutputError: If it is a folder, or its folder is missing or takes no files.
    """
    if path.is_dir():
        raise OutputError(f"'{path}' is a folder. Name a file in it.")
    # Permissions do not tell of read-only disks, nor of quotas: only trying does.
    trial = path.with_name(f".{path.name}.{secrets.token_hex(4)}.trial")
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise OutputError(
            f"'{path}' cannot be written: {error.strerror or error}. Name a file in an existing, "
            "writable folder."
        ) from error


def check_page(path: Path) -> None:
    """Refuse a page that no browser would open, or that could not be written.

    Raises:
        OutputError: If its name says that it is something else, or as `check_writable`.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"Page '{path}': its name must end in .html.")
    check_writable(path)
