"""Packages of ROS 1 and the service types of tcs, which are generated from the files of `ros/`."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

from tcs.errors import ServiceError
from tcs.files.paths import data_folder
from tcs.files.writing import scratch_folder

PACKAGE = "tcs_msgs"
DEBIAN = Path("/usr/lib/python3/dist-packages")
"""Where Debian's packages of ROS 1 are, which a virtual environment does not see."""
_NEEDED = ("rospy", "genpy", "genmsg", "geometry_msgs.msg", "trajectory_msgs.msg", "tf2_msgs.msg")
_INSTALL = (
    "On Debian: apt-get install python3-rospy python3-geometry-msgs python3-trajectory-msgs "
    "python3-tf2-msgs. With another ROS 1, source its setup.bash first."
)
_RULE = "=" * 80
"""Line between the definitions of a message and of those it is made of, in generated classes."""


def ros1_modules() -> SimpleNamespace:
    """Return the packages of ROS 1 that the node needs, by name, e.g. `.rospy`.

    Debian's folder is appended to the module path if they are only there: after every package of
    this environment, so that none of these is replaced.

    Raises:
        ServiceError: If a package is not installed.
    """
    if importlib.util.find_spec("rospy") is None and (DEBIAN / "rospy").is_dir():
        sys.path.append(str(DEBIAN))
    try:
        modules = {name: importlib.import_module(name) for name in _NEEDED}
    except ImportError as error:
        raise ServiceError(
            f"`tcs serve --ros1` needs packages of ROS 1, but {error}. {_INSTALL}"
        ) from None
    return SimpleNamespace(**{name.split(".")[0]: module for name, module in modules.items()})


@contextmanager
def ros1_types() -> Iterator[SimpleNamespace]:
    """Yield the modules of the message and service classes, as `.msg` and `.srv`.

    They are generated anew into a temporary folder, so that no workspace has to be built. A client
    whose workspace contains the package `ros/tcs_msgs` has classes with the same checksums.

    Raises:
        ServiceError: If a package is not installed, or the definitions cannot be generated.
    """
    ros = ros1_modules()
    generator = importlib.import_module("genpy.generator")
    initialiser = importlib.import_module("genpy.generate_initpy")
    definitions = data_folder() / "ros" / PACKAGE
    with scratch_folder() as folder:
        known = [ros.geometry_msgs.PoseStamped, ros.trajectory_msgs.JointTrajectory]
        search = _definitions_of(known, folder / "known")
        search[PACKAGE] = [str(definitions / "msg")]
        made = folder / "python" / PACKAGE
        made.mkdir(parents=True)
        (made / "__init__.py").touch()
        for part, generate in (("msg", generator.MsgGenerator), ("srv", generator.SrvGenerator)):
            files = sorted(str(path) for path in (definitions / part).glob(f"*.{part}"))
            (made / part).mkdir()
            if generate().generate_messages(PACKAGE, files, str(made / part), search):
                raise ServiceError(f"the definitions in {definitions / part} cannot be generated.")
            initialiser.write_modules(str(made / part))
        sys.path.insert(0, str(made.parent))
        try:
            yield SimpleNamespace(
                msg=_imported(f"{PACKAGE}.msg"), srv=_imported(f"{PACKAGE}.srv"),
            )  # fmt: skip
        finally:
            sys.path.remove(str(made.parent))


def _imported(name: str) -> ModuleType:
    importlib.invalidate_caches()
    return importlib.import_module(name)


def _definitions_of(classes: Iterable[Any], folder: Path) -> dict[str, list[str]]:
    """Write the definitions of generated classes as files; return their folders by package.

    Args:
        classes: Message classes; each contains the definitions of the messages it is made of.
        folder: Folder to write to.
    """
    search: dict[str, list[str]] = {}
    for one in classes:
        first, *rest = one._full_text.split(_RULE)
        texts = {one._type: first}
        for part in rest:
            title, _, text = part.strip().partition("\n")
            texts[title.removeprefix("MSG: ").strip()] = text
        for name, text in texts.items():
            package, _, message = name.partition("/")
            path = folder / package / f"{message}.msg"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            search[package] = [str(path.parent)]
    return search
