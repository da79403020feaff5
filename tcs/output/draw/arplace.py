"""Figures of ARPlace models and probability maps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tcs.capability.arplace import Arplace, ProbabilityMap
from tcs.capability.arplace.boundary import Boundary
from tcs.capability.arplace.polygons import inside
from tcs.capability.arplace.region_vectors import boundary_from
from tcs.capability.arplace.success_model import LINEAR, QUADRATIC
from tcs.kernel.arrays import FloatArray
from tcs.output.draw.colours import ARM, FURNITURE, HERE, MEMBER, SCALE

MODES = 4
"""Deformation modes that are drawn."""
PANELS = 6
"""Grasps whose reconstruction is drawn."""
HEIGHTS, DISTANCES = 3, 4
"""Greatest numbers of heights and distances of the figure of success models."""
_FINE = 6
"""Points of a picture between neighbouring base positions."""
_GREY = "#8a929a"


def figure_of(arplace: Arplace, name: str) -> Figure:
    """Return a figure of a model: "modes", "reconstruction" or "generalisation"."""
    figures: dict[str, Callable[[Arplace], Figure]] = {
        "modes": modes_figure,
        "reconstruction": reconstruction_figure,
        "generalisation": generalisation_figure,
    }
    return figures[name](arplace)


def modes_figure(arplace: Arplace) -> Figure:
    """Return the first deformation modes about the mean boundary, and the energy of all modes.

    Source:
        ITCM thesis, Figure 41.
    """
    distribution = arplace.success_model.distribution
    count = min(MODES, len(distribution.variance))
    figure = Figure(figsize=(2.3 * count + 2.9, 4.6), layout="constrained")
    panels = figure.subplots(1, count + 1, squeeze=False)[0]
    mean = boundary_from(arplace.representation, distribution.mean, arplace.grid)
    for mode, axes in enumerate(panels[:count]):
        for sign in (-1.0, 1.0):
            deformation = np.zeros((1, mode + 1))
            deformation[0, mode] = sign * math.sqrt(distribution.variance[mode])
            shape = distribution.shapes(deformation)[0]
            boundary = boundary_from(arplace.representation, shape, arplace.grid)
            _draw_boundary(axes, boundary, color=ARM if sign > 0.0 else MEMBER, lw=1.2)
        _draw_boundary(axes, mean, color=HERE, lw=2.6)
        axes.set_title(f"mode {mode + 1}: {100.0 * distribution.energy[mode]:.1f} %", fontsize=11)
    _frame(panels[:count], arplace)
    energy = 100.0 * np.cumsum(distribution.energy)
    shown = min(len(energy), 12)
    panels[-1].bar(np.arange(1, shown + 1), 100.0 * distribution.energy[:shown], color=FURNITURE)
    panels[-1].plot(np.arange(1, shown + 1), energy[:shown], "o-", color=HERE, ms=4)
    panels[-1].set_xlabel("mode")
    panels[-1].set_title("energy and its sum [%]", fontsize=11)
    handles = [
        Line2D([], [], color=HERE, lw=2.6, label="mean"),
        Line2D([], [], color=ARM, label="plus one standard deviation"),
        Line2D([], [], color=MEMBER, label="minus one standard deviation"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle(_title(arplace, "deformation modes"), fontsize=13)
    return figure


def reconstruction_figure(arplace: Arplace) -> Figure:
    """Return the original and the reconstructed boundaries of some grasps, with their difference.

    Source:
        ITCM thesis, Figure 42.
    """
    shown = _spread(len(arplace.task), PANELS)
    figure = Figure(figsize=(2.4 * len(shown), 4.6), layout="constrained")
    panels = figure.subplots(1, len(shown), squeeze=False)[0]
    distribution = arplace.success_model.distribution
    mean = boundary_from(arplace.representation, distribution.mean, arplace.grid)
    x, y = (_finer(values) for values in arplace.grid)
    for grasp, axes in zip(shown, panels, strict=True):
        parameters = arplace.task.parameters[grasp]
        original = arplace.boundaries[grasp]
        predicted = arplace.predicted(parameters[None], at=(x, y))[0]
        difference = predicted.astype(int) - inside(original, x, y).astype(int)
        colours = matplotlib.colors.ListedColormap([ARM, "#ffffff", MEMBER])
        axes.pcolormesh(x, y, difference.T, cmap=colours, vmin=-1, vmax=1, shading="nearest")
        _draw_boundary(axes, mean, color=_GREY, lw=1.0)
        _draw_boundary(axes, original, color=HERE, lw=1.6)
        reconstructed = arplace.predicted_boundary(parameters)
        _draw_boundary(axes, reconstructed, color=HERE, lw=1.2, ls="--")
        axes.set_title(_grasp_text(parameters), fontsize=10)
    _frame(panels, arplace)
    handles = [
        Line2D([], [], color=_GREY, lw=1.0, label="mean"),
        Line2D([], [], color=HERE, lw=1.6, label="original"),
        Line2D([], [], color=HERE, lw=1.2, ls="--", label="reconstructed"),
        Patch(color=MEMBER, label="incorrectly included"),
        Patch(color=ARM, label="incorrectly excluded"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, frameon=False)
    model = arplace.success_model
    figure.suptitle(
        _title(arplace, f"{arplace.rule} reconstruction by {model.kept} modes"), fontsize=13
    )
    return figure


def generalisation_figure(arplace: Arplace) -> Figure:
    """Return boundaries over the distances for each height, by three polynomial models.

    Source:
        ITCM thesis, Figure 45.
    """
    models = [
        arplace.success_model_of(rule, energy)
        for rule, energy in ((LINEAR, 0.99), (QUADRATIC, 0.9), (QUADRATIC, 0.99))
    ]
    heights = arplace.task.height.values
    heights = heights[_spread(len(heights), HEIGHTS)]
    figure = Figure(figsize=(2.9 * len(models), 4.0 * len(heights) + 0.8), layout="constrained")
    panels = figure.subplots(len(heights), len(models), squeeze=False)
    distances = arplace.task.distance.values
    distances = distances[_spread(len(distances), DISTANCES)]
    colours = matplotlib.colormaps[SCALE](np.linspace(0.0, 0.9, len(distances)))
    angle = float(arplace.task.angle.values[0])
    for row, height in enumerate(heights):
        for column, model in enumerate(models):
            axes = panels[row, column]
            for distance, colour in zip(distances, colours, strict=True):
                parameters = np.array([distance, height, angle])
                grasp = int(np.argmin(np.abs(arplace.task.parameters - parameters).sum(axis=1)))
                _draw_boundary(axes, arplace.boundaries[grasp], color=colour, lw=1.0)
                predicted = arplace.predicted_boundary(parameters, model)
                _draw_boundary(axes, predicted, color=colour, lw=1.2, ls="--")
            held = 100.0 * float(model.distribution.energy[: model.kept].sum())
            axes.set_title(
                f"{model.rule}, {model.kept} modes ({held:.1f} %)\nheight {height:.3f} m",
                fontsize=10,
            )
    _frame(list(panels.ravel()), arplace)
    handles = [
        Line2D([], [], color=colours[0], label=f"distance {distances[0]:g} m"),
        Line2D([], [], color=colours[-1], label=f"distance {distances[-1]:g} m"),
        Line2D([], [], color=HERE, lw=1.0, label="original"),
        Line2D([], [], color=HERE, lw=1.2, ls="--", label="predicted"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(_title(arplace, "generalised success models"), fontsize=13)
    return figure


def map_figure(found: ProbabilityMap, best: tuple[float, float], caption: str) -> Figure:
    """Return a probability map with the table's edge and the best base position.

    Args:
        found: The map.
        best: x and y of the base position to highlight [m].
        caption: Second line of the title; may be empty.
    """
    figure = Figure(figsize=(5.4, 6.0), layout="constrained")
    axes = figure.subplots()
    shown = np.ma.masked_less_equal(found.probability.T, 0.0)
    mesh = axes.pcolormesh(
        found.x, found.y, shown, cmap=SCALE, vmin=0.0, vmax=1.0, shading="nearest"
    )
    figure.colorbar(mesh, ax=axes, label="probability of success", shrink=0.85)
    axes.axvline(0.0, color=FURNITURE, lw=3.0, label="table's edge")
    yaw = found.base_yaw
    axes.plot(*best, marker=(3, 0, math.degrees(yaw) - 90.0), ms=13, color=MEMBER, mec="white",
              ls="none", label=f"best: x {best[0]:.2f} m, y {best[1]:.2f} m")  # fmt: skip
    axes.set_xlim(float(found.x[0]) - 0.05, max(float(found.x[-1]), 0.0) + 0.05)
    _label(axes)
    axes.legend(loc="upper left", fontsize=9)
    lines = ["probability of success over base positions", *([caption] if caption else [])]
    axes.set_title("\n".join(lines), fontsize=11)
    return figure


def _draw_boundary(axes: Axes, boundary: Boundary, **style: object) -> None:
    for polygon in boundary:
        closed = np.concatenate([polygon, polygon[:1]])
        axes.plot(closed[:, 0], closed[:, 1], **style)  # type: ignore[arg-type]


def _frame(panels: Sequence[Axes], arplace: Arplace) -> None:
    """Give panels the same limits: those of all boundaries and the table's edge."""
    corners = [polygon for boundary in arplace.boundaries for polygon in boundary]
    points = np.concatenate(corners)
    low, high = points.min(axis=0) - 0.1, points.max(axis=0) + 0.1
    for axes in panels:
        axes.axvline(0.0, color=FURNITURE, lw=3.0)
        axes.set_xlim(low[0], max(high[0], 0.05))
        axes.set_ylim(low[1], high[1])
        _label(axes)


def _label(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.grid(color="0.9", lw=0.5)
    axes.set_axisbelow(True)


def _spread(count: int, most: int) -> NDArray[np.int64]:
    """Return at most so many indices below a count, first and last among them."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def _finer(values: FloatArray) -> FloatArray:
    count = (len(values) - 1) * _FINE + 1
    return np.linspace(float(values[0]), float(values[-1]), count)


def _grasp_text(parameters: FloatArray) -> str:
    distance, height, angle = parameters
    text = f"distance {distance:.2f} m\nheight {height:.3f} m"
    return text if angle == 0.0 else f"{text}, {math.degrees(angle):g} deg"


def _title(arplace: Arplace, what: str) -> str:
    # A robot of the user's own is stored by the path of its file.
    robot = Path(str(arplace.metadata.get("robot", ""))).stem
    return f"ARPlace of {robot}, {arplace.task.approach} grasps: {what} ({arplace.representation})"
