"""Sizes of the wheelchair and the bed: parameters, presets, and the models changed to them.

The models `wheelchair.sdf` and `bed.sdf` are those of the papers, and are what they are without
parameters. With them boxes are moved and lengthened, and the person sits or lies where the seat or
the mattress is.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field
from scipy.spatial.transform import Rotation

from tcs.errors import EnvironmentFileError
from tcs.files.documents import Document, Number
from tcs.kernel.arrays import FloatArray
from tcs.model.scene.person.shapes import read_pose

Pose = tuple[FloatArray, FloatArray]
"""Orientation, shape (3, 3), and position [m], shape (3,)."""

SEAT = {"seat_width": 0.475, "seat_depth": 0.42, "seat_height": 0.47}
"""Seat of the papers' wheelchair: between the side panels, from back rest to front edge, and top
above the floor [m]."""
MATTRESS = {"length": 2.14, "width": 0.915}
"""Size of the papers' bed: between the boards' middles, and width of the mattress [m]."""

# Edges between which a box is lengthened; what lies beyond is moved [m].
_MIDDLE, _PANEL = 0.03, 0.2375
_BACK_REST, _SEAT_FRONT = 0.305, 0.6
_CALVES, _FOOT_END = 1.5, 2.05
_TUBE = np.array([math.sqrt(0.5), 0.0, -math.sqrt(0.5)])
"""Direction of the leg rests, downward."""
_WHEELS = ("rear wheel", "front wheel")
_FRAME = ("lower side rail", "front post")
_BACK = ("back rest", "push handle")


class Wheelchair(Document):
    """Parameters of the wheelchair; what is not given is as in the papers, or of the preset."""

    preset: Literal["standard", "wide", "child", "tilt-in-space"] = "standard"
    seat_width: Annotated[Number, Field(ge=0.28, le=0.8)] = SEAT["seat_width"]
    """Distance between the side panels [m]."""
    seat_depth: Annotated[Number, Field(ge=0.25, le=0.6)] = SEAT["seat_depth"]
    """From the back rest to the front edge of the seat [m]."""
    seat_height: Annotated[Number, Field(ge=0.44, le=0.65)] = SEAT["seat_height"]
    """Top of the seat above the floor [m]; the foot plates are as far below it as in the papers."""
    leg_rest: Annotated[Number, Field(ge=-0.2, le=0.1)] = 0.0
    """By how much the leg rests are longer than in the papers [m]."""
    back_angle_deg: Annotated[Number, Field(ge=0.0, le=30.0)] = 0.0
    """Angle by which the back rest, and the trunk with it, leans backward from the seat [deg]."""
    tilt_deg: Annotated[Number, Field(ge=0.0, le=50.0)] = 0.0
    """Angle by which seat, rests and person are tilted backward on the frame [deg]."""


class Bed(Document):
    """Parameters of the bed; what is not given is as in the papers, or of the preset."""

    preset: Literal["standard", "wide", "long", "child"] = "standard"
    length: Annotated[Number, Field(ge=1.7, le=2.6)] = MATTRESS["length"]
    """Distance between head and foot board [m]; the foot end moves."""
    width: Annotated[Number, Field(ge=0.7, le=1.4)] = MATTRESS["width"]
    """Width of the mattress [m]."""


PRESETS: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    # Widths and depths in the usual steps of an inch.
    "wheelchair": {
        "standard": {},
        "wide": {"seat_width": 0.61, "seat_depth": 0.457},
        "child": {"seat_width": 0.356, "seat_depth": 0.33, "seat_height": 0.45, "leg_rest": -0.1},
        "tilt-in-space": {"seat_width": 0.457, "back_angle_deg": 10.0, "tilt_deg": 30.0},
    },
    "bed": {
        "standard": {},
        "wide": {"width": 1.07},
        "long": {"length": 2.34},
        "child": {"length": 1.8, "width": 0.8},
    },
}
"""Parameters of each preset."""


def _with_preset(model: str) -> Callable[[Any], Any]:
    """Return a function that fills in the parameters of a preset; a plain text is its name."""

    def fill(value: Any) -> Any:
        given = {"preset": value} if isinstance(value, str) else value
        if not isinstance(given, Mapping):
            return given
        return {**PRESETS[model].get(str(given.get("preset")), {}), **given}

    return fill


WheelchairEntry = Annotated[Wheelchair, BeforeValidator(_with_preset("wheelchair"))]
BedEntry = Annotated[Bed, BeforeValidator(_with_preset("bed"))]


def changed_wheelchair(chair: Wheelchair, root: ElementTree.Element, where: str) -> None:
    """Change the model of the papers' wheelchair to parameters, in place.

    Raises:
        EnvironmentFileError: If it is another model.
    """
    wider = 0.5 * (chair.seat_width - SEAT["seat_width"])
    deeper = chair.seat_depth - SEAT["seat_depth"]
    higher = chair.seat_height - SEAT["seat_height"]
    for element, name in _boxes(root, ("seat", "back rest", "front post left"), where):
        box = _Box(element)
        rigid = name.startswith(_WHEELS)
        box.stretch(1, lambda y: math.copysign(_ramp(abs(y), _MIDDLE, _PANEL, wider), y), rigid)
        box.stretch(0, lambda x: _ramp(x, _BACK_REST, _SEAT_FRONT, deeper), rigid)
        if name.startswith("front post"):
            box.stretch(2, lambda z: _ramp(z, 0.3, 0.4, higher), False)
        elif not name.startswith((*_WHEELS, *_FRAME)):
            if name.startswith("foot plate"):
                box.p = box.p + chair.leg_rest * _TUBE
            elif name.startswith("leg-rest tube"):
                box.lengthen(chair.leg_rest)
            if name.startswith(_BACK):
                hinge = np.array([_BACK_REST, 0.0, SEAT["seat_height"]])
                box.move(_turn(-chair.back_angle_deg, hinge))
            box.move(seat_motion(chair))
        box.write()


def seat_motion(chair: Wheelchair) -> Pose:
    """Return how the seat, and the person with it, moves from its place in the papers."""
    higher = np.array([0.0, 0.0, chair.seat_height - SEAT["seat_height"]])
    R, p = _turn(-chair.tilt_deg, np.array([0.5, 0.0, SEAT["seat_height"]]))
    return R, p + higher


def changed_bed(bed: Bed, root: ElementTree.Element, where: str) -> None:
    """Change the model of the papers' bed to parameters, in place.

    Raises:
        EnvironmentFileError: If it is another model.
    """
    wider = 0.5 * (bed.width - MATTRESS["width"])
    longer = bed.length - MATTRESS["length"]
    places = {link.get("name"): read_pose(link.find("pose"))[1] for link in root.iter("link")}
    # The frames of the leg rests hang from each other.
    places["leg_rest_lower_link"] = places["leg_rest_lower_link"] + places["leg_rest_upper_link"]
    for link in root.iter("link"):
        start = float(places[link.get("name")][0])
        toward_foot = partial(_ramp_from, start, longer)
        for element, name in _boxes(link, (), where):
            box = _Box(element)
            rigid = "disc" in name or "post" in name or "corner" in name
            box.stretch(1, lambda y: math.copysign(_ramp(abs(y), _MIDDLE, _PANEL, wider), y), rigid)
            box.stretch(0, toward_foot, rigid or "board" in name or "plate" in name)
            box.write()


def _ramp_from(start: float, longer: float, x: float) -> float:
    """Return where a point along the bed is, in the frame of a link that is at `start` [m]."""
    return _ramp(x + start, _CALVES, _FOOT_END, longer) - start


class _Box:
    """A box in the frame of its link, whose edges are moved."""

    def __init__(self, element: ElementTree.Element) -> None:
        self._element = element
        self.R, self.p = read_pose(element.find("pose"))
        size = element.findtext("geometry/box/size", "").split()
        self._size = np.array([float(word) for word in size])

    def stretch(self, axis: int, moved: Callable[[float], float], rigid: bool) -> None:
        """Move both faces across an axis of the link, or if it is rigid or oblique the centre."""
        is_oblique = abs(self.R[axis, axis]) < 1.0 - 1e-9
        if rigid or is_oblique:
            self.p[axis] = moved(float(self.p[axis]))
            return
        half = 0.5 * self._size[axis]
        low, high = (moved(float(self.p[axis] + sign * half)) for sign in (-1.0, 1.0))
        self.p[axis], self._size[axis] = 0.5 * (low + high), high - low

    def lengthen(self, by: float) -> None:
        """Lengthen it along its own x axis, at the far end."""
        self._size[0] += by
        self.p = self.p + 0.5 * by * self.R[:, 0]

    def move(self, motion: Pose) -> None:
        """Move it as a whole."""
        R, p = motion
        self.R, self.p = R @ self.R, R @ self.p + p

    def write(self) -> None:
        """Write size and pose to the element."""
        pose, size = self._element.find("pose"), self._element.find("geometry/box/size")
        if pose is None or size is None:
            return
        pose.attrib.clear()
        pose.set("rotation_format", "quat_xyzw")
        numbers = [*self.p.tolist(), *Rotation.from_matrix(self.R).as_quat().tolist()]
        pose.text = " ".join(map(repr, numbers))
        size.text = " ".join(map(repr, self._size.tolist()))


def _boxes(
    root: ElementTree.Element, needed: tuple[str, ...], where: str
) -> list[tuple[ElementTree.Element, str]]:
    """Return the boxes below an element, with their names."""
    found = [
        (element, element.get("name", ""))
        for kind in ("collision", "visual")
        for element in root.iter(kind)
        if element.find("geometry/box") is not None
    ]
    names = {name for _, name in found}
    for name in needed:
        if name not in names:
            raise EnvironmentFileError(
                f"{where} has no box '{name}', so that its sizes cannot be given. Use "
                "wheelchair.sdf."
            )
    return found


def _ramp(at: float, first: float, last: float, by: float) -> float:
    """Return a coordinate moved by nothing up to `first` and by `by` from `last` on."""
    return at + by * min(1.0, max(0.0, (at - first) / (last - first)))


def _turn(angle_deg: float, about: FloatArray) -> Pose:
    """Return a rotation about the y axis through a point."""
    R = np.asarray(Rotation.from_euler("y", angle_deg, degrees=True).as_matrix())
    return R, about - R @ about
