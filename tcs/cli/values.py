"""Values of options: the current state, settings of axes, observed joints and frames, people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import typer

from tcs.errors import DataFileError, SelectionError, one_line
from tcs.model.grid import Axis, InitialConfiguration


def state_if_given(
    here: tuple[float, float, float] | None, torso: float
) -> InitialConfiguration | None:
    """Return the current state, or None without `--here`.

    Args:
        here: x [m], y [m] and heading [deg] in the environment frame, or None.
        torso: Torso height [m].

    Raises:
        typer.BadParameter: If there is a torso height without `--here`.
    """
    if here is not None:
        return current_state(here, torso)
    if torso:
        raise typer.BadParameter("requires --here.", param_hint="--torso")
    return None


def current_state(
    here: tuple[float, float, float], torso: float = 0.0, at: Sequence[str] = ()
) -> InitialConfiguration:
    """Return the current state.

    Args:
        here: x [m], y [m] and heading [deg] in the environment frame.
        torso: Torso height [m].
        at: Settings of the environment's axes as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg].

    Raises:
        SelectionError: If a setting is not of that form.

    >>> current_state((1.0, 2.0, 180.0), 0.1, ["head_rest_deg=90"]).environment
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


def parking_window(text: str | None) -> tuple[float, ...] | None:
    """Return a parking window given as "X,Y,YAW_DEG" [m, m, deg]; None without one.

    Raises:
        SelectionError: If it is not of that form.

    >>> parking_window("0.05,0.05,3")
    (0.05, 0.05, 3.0)
    """
    if text is None:
        return None
    try:
        x, y, yaw_deg = map(float, text.split(","))
    except ValueError:
        raise SelectionError(
            f"--parking is '{one_line(text)}'; must be half widths X,Y,YAW_DEG (m, m, deg), e.g. "
            "0.05,0.05,3."
        ) from None
    return x, y, yaw_deg


def settings(given: Sequence[str], option: str) -> dict[str, float]:
    """Return settings of axes given as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg], in m and rad.

    Args:
        given: Values on the command line.
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
    """Return the observed state, given as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg].

    Args:
        given: Values on the command line.
        axes: The observed axes of the score file; other names are passed on unchecked.

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


def frame_values(given: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Return positions of body frames given as "FRAME=X,Y,Z" [m], or poses with a quaternion.

    Raises:
        SelectionError: If one is not of that form.

    >>> frame_values(["head=0.29,0.05,0.68"])
    {'head': (0.29, 0.05, 0.68)}
    """
    frames = {}
    for text in given:
        name, _, numbers = text.partition("=")
        try:
            frames[name] = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            raise SelectionError(
                f"--frames is '{text}'; must be FRAME=X,Y,Z, e.g. head=0.29,0.05,0.68."
            ) from None
    return frames


def person_values(given: Sequence[str]) -> dict[str, Any] | None:
    """Return the keys and values of a person given as files and as "KEY=VALUE", None if not given.

    A value on the command line replaces that of a file.

    Raises:
        DataFileError: If a file cannot be read, or a value is not of that form.

    >>> person_values(["sex=female", "stature_percentile=5"])
    {'sex': 'female', 'stature_percentile': 5.0}
    """
    if not given:
        return None

    from tcs.model.people import WORDS, person_keys

    found: dict[str, Any] = {}
    written: dict[str, Any] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            found.update(person_keys(text))
            continue
        if name in written:
            raise DataFileError(f"--person sets '{name}' twice. Give it once.")
        try:
            written[name] = value if name in WORDS else float(value)
        except ValueError:
            raise DataFileError(
                f"--person is '{one_line(text)}'; must be KEY=NUMBER, e.g. stature=1.62."
            ) from None
    return {**found, **written}


def axis_values(given: Sequence[str], option: str) -> tuple[tuple[str, float], ...]:
    """Return names and numbers given as "NAME=NUMBER".

    Args:
        given: Values on the command line.
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
