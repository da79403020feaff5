"""Meshes of a URDF: their triangles, and their conversion to OBJ, the format that Drake reads."""

from __future__ import annotations

import hashlib
import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import RobotError
from tcs.files.paths import CACHE_ADVICE, cache_folder
from tcs.files.quantities import SIZE
from tcs.files.reading import read_bytes
from tcs.files.unchanged import kept_while_unchanged
from tcs.files.writing import whole_file

if TYPE_CHECKING:
    import trimesh
import xml.etree.ElementTree as ElementTree

FloatArray = NDArray[np.float64]

MAX_BYTES = 500 * 1024**2
"""Most bytes of a mesh file: fifty times the largest of the robots that ship."""
MAX_TRIANGLES = 5_000_000
"""Most triangles of a mesh: ten times as many as a whole robot in the packages in use."""
MAX_COORDINATE = SIZE.high * 1e4
"""Greatest coordinate in the unit of a mesh: the greatest size in tenths of a millimetre."""

_VERSION = b"3"
"""Part of the cache key: increase it when the conversion changes."""
_APPEARANCE = frozenset(
    (
        "library_images",
        "library_effects",
        "library_materials",
        "library_cameras",
        "library_lights",
        "bind_material",
        "instance_camera",
        "instance_light",
    )
)
"""Elements that say how geometry looks, or from where it is seen."""


def as_obj(mesh: Path) -> Path:
    """Return an OBJ file of a mesh: the mesh itself, or its conversion in the user's cache.

    The name of the converted file contains a hash of the mesh, so an edited mesh is converted
    anew, and equal meshes share one file.

    Args:
        mesh: A file in any format that trimesh reads, e.g. STL, Collada or OBJ.

    Raises:
        RobotError: If the mesh cannot be read.
        OutputError: If the cache cannot be written.
    """
    if mesh.suffix.lower() == ".obj":
        return mesh
    key = hashlib.sha256(_VERSION + mesh.suffix.lower().encode() + _content(mesh)).hexdigest()
    target = cache_folder("meshes") / f"{mesh.stem}_{key[:16]}.obj"
    if not os.path.isfile(target):
        text = _obj_text(mesh)
        # Two processes may convert the same mesh.
        with whole_file(target, "Converted mesh", advice=CACHE_ADVICE) as stream:
            stream.write(text.encode())
    return target


@kept_while_unchanged(files=256)
def mesh_triangles(mesh: Path) -> FloatArray:
    """Return the corners of every triangle of a mesh, shape (n, 3, 3).

    Those of Collada files, which name their unit, are in metres, others in the unit of the mesh.

    Triangles without area are kept, because the primitives must enclose them as well.

    Raises:
        RobotError: If the mesh cannot be read.
    """
    loaded = _load(mesh)
    triangles = np.asarray(loaded.vertices, dtype=np.float64)[loaded.faces]
    triangles.setflags(write=False)
    return triangles


def _content(mesh: Path) -> bytes:
    return read_bytes(mesh, f"mesh '{mesh}'", RobotError, limit=MAX_BYTES)


def _obj_text(mesh: Path) -> str:
    from trimesh.exchange.obj import export_obj

    return str(export_obj(_load(mesh), include_texture=False, include_color=False))  # type: ignore[no-untyped-call]


def _load(mesh: Path) -> trimesh.Trimesh:
    # A late import: it takes half a second, and scoring does not need it.
    import trimesh

    content = _content(mesh)
    file: Path | io.BytesIO = mesh
    options: dict[str, Any] = {}
    unit = 1.0
    try:
        if mesh.suffix.lower() == ".dae":
            # Faults of geometry are raised, not passed over with what they concern.
            geometry, unit = geometry_only(content)
            file = io.BytesIO(geometry)
            options = {"file_type": "dae", "ignore_broken": False}
        loaded = trimesh.load(file, force="mesh", process=False, **options)
    except MemoryError:
        raise
    except Exception as error:  # its readers raise errors of many classes
        text = " ".join(str(error).split()) or type(error).__name__
        raise RobotError(f"mesh '{mesh}' cannot be used: {text}.") from error
    if not isinstance(loaded, trimesh.Trimesh) or len(loaded.faces) == 0:
        raise RobotError(f"mesh '{mesh}' contains no triangles.")
    _check(mesh, loaded)
    if unit != 1.0:
        loaded.vertices = np.asarray(loaded.vertices) * unit
    return loaded


def _check(mesh: Path, loaded: trimesh.Trimesh) -> None:
    """Refuse too many triangles, unknown vertices, and coordinates that are no lengths."""
    faces, vertices = np.asarray(loaded.faces), np.asarray(loaded.vertices, dtype=np.float64)
    if len(faces) > MAX_TRIANGLES:
        raise RobotError(
            f"mesh '{mesh}' has {len(faces):,} triangles; at most {MAX_TRIANGLES:,} are read. "
            "Decimate it."
        )
    # Of a line of an OBJ file that lacks a number, trimesh may keep the others.
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        raise RobotError(f"mesh '{mesh}' is damaged: a vertex has not three coordinates.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise RobotError(f"mesh '{mesh}' is damaged: a triangle names a vertex that is not there.")
    # In the unit of the mesh: `geometry_triangles` checks the metres.
    if not np.all(np.abs(vertices) <= MAX_COORDINATE):
        raise RobotError(
            f"mesh '{mesh}' has a coordinate that is not a number from {-MAX_COORDINATE:g} to "
            f"{MAX_COORDINATE:g}."
        )


def geometry_only(content: bytes) -> tuple[bytes, float]:
    """Return a Collada file without materials, images, cameras and lights, and its unit [m].

    A reader of Collada leaves out geometry whose material it cannot read: the surface would be lost
    without a word.

    Args:
        content: The file.

    Raises:
        SyntaxError: If it is not XML.
        ValueError: If its unit is no length.
    """
    root = ElementTree.fromstring(content)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag.rpartition("}")[2] in _APPEARANCE:
                parent.remove(child)
    return ElementTree.tostring(root), _unit(root)


def _unit(root: ElementTree.Element) -> float:
    """Return the length of the unit of a Collada file [m], 1 if it names none."""
    found = root.find("{*}asset/{*}unit")
    text = "1" if found is None else found.get("meter", "1")
    unit = float(text)
    if not 1e-6 <= unit <= 1e3:
        raise ValueError(f"its unit is {text} m")
    return unit
