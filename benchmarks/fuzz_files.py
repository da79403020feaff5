"""The files that `benchmarks/fuzz.py` mutates, and what a user does with each."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import fuzz_mutations as mutations
import numpy as np
from fuzz_mutations import Mutation

from tcs.files.paths import data_folder

TASK = """\
name: fetch
title: Fetch a cup from the shelf
source: made up
environments: [kitchen]
allowed_contacts: []
goals:
  - {body_frame: top, position: [0.2, 0.3, 0.1], quaternion_wxyz: [1, 0, 0, 0], weight: 2}
  - {body_frame: top, position: [-0.1, 0.1, 0.2], quaternion_wxyz: [0.7071068, 0, 0.7071068, 0]}
  - {body_frame: lid, position: [0.0, -0.1, 0.2], quaternion_wxyz: [0.7071068, 0, 0, 0.7071068]}
grids:
  kitchen:
    base_x: {start: -0.75, step: 0.15, count: 2}
"""

ENVIRONMENT = """\
name: kitchen
title: A table with a lid, a box and a lamp
origin: on the floor below the middle of the table
source: made up
models:
  - {name: table, file: table.sdf, xyz: [0, 0, 0], rpy_deg: [0, 0, 0]}
obstacles:
  - {name: shelf, box: [0.3, 1.2, 0.03], xyz: [0.5, 0, 0.9], rpy_deg: [0, 0, 5]}
  - {name: lamp, file: lamp.sdf, xyz: [0.2, 0.9, 0], rpy_deg: [0, 0, 30]}
body_frames: {top: "table::board", lid: "table::lid"}
padding: {"table::board": 0.002}
contact_margin: 0.001
joints: {slide: 0.05}
posture:
  turn:
    knots_deg: [-40, 0, 40]
    joints: {tilt: [-0.1, 0.0, 0.2]}
errors:
  slide: {distribution: normal, std: 0.02}
  turn: {distribution: uniform, half_width_deg: 5}
observed:
  slide: {unit: m, start: 0, step: 0.05, count: 2}
grid:
  turn: {unit: deg, start: 0, step: 10, count: 2}
  base_x: {unit: m, start: -0.6, step: 0.3, count: 2}
  base_y: {unit: m, start: -0.2, step: 0.4, count: 2}
  base_yaw: {unit: deg, start: 0, step: 90, count: 2}
  torso: {unit: m, start: 0, step: 0, count: 1}
"""

TABLE = """\
<sdf version="1.9"><model name="table">
<link name="base"><collision name="foot"><pose>0 0 0.3 0 0 0</pose>
<geometry><box><size>0.1 0.1 0.6</size></box></geometry></collision></link>
<link name="board"><pose>0 0 0.62 0 0 0</pose><inertial><mass>3.5</mass></inertial>
<collision name="plate"><geometry><box><size>0.5 0.8 0.03</size></box></geometry></collision>
<visual name="plate"><geometry><box><size>0.5 0.8 0.03</size></box></geometry></visual></link>
<link name="lid"><pose>0 0 0.7 0 0 0</pose><collision name="lid"><pose>0 0 0 0 1.57 0</pose>
<geometry><capsule><radius>0.02</radius><length>0.3</length></capsule></geometry></collision></link>
<link name="knob"><pose>0 0.2 0.7 0 0 0</pose><collision name="knob"><geometry><sphere>
<radius>0.03</radius></sphere></geometry></collision></link>
<joint name="slide" type="prismatic"><parent>base</parent><child>board</child><axis>
<xyz>1 0 0</xyz><limit><lower>-0.1</lower><upper>0.3</upper></limit></axis></joint>
<joint name="turn" type="revolute"><parent>board</parent><child>lid</child><axis>
<xyz>0 0 1</xyz><limit><lower>-1.5</lower><upper>1.5</upper></limit></axis></joint>
<joint name="tilt" type="revolute"><parent>board</parent><child>knob</child><axis>
<xyz expressed_in="__model__">0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis>
</joint></model></sdf>
"""

LAMP = """\
<sdf version="1.9"><model name="lamp"><link name="lamp"><collision name="pole">
<pose>0 0 0.7 0 0 0</pose><geometry><capsule><radius>0.02</radius><length>1.3</length></capsule>
</geometry></collision></link></model></sdf>
"""

ERRORS = """\
title: Errors of the table
source: made up
errors:
  slide: {distribution: normal, std: 0.02}
  turn: {distribution: uniform, half_width_deg: 5}
"""

OBJ = "\n".join(
    [f"v {x} {y} {z}" for x in (0.0, 0.05) for y in (0.0, 0.1) for z in (0.0, 0.2)]
    + [f"f {a} {b} {c}" for a, b, c in ((1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6))]
    + [f"f {a} {b} {c}" for a, b, c in ((1, 6, 2), (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5))]
    + ["f 2 6 8", "f 2 8 4"]
)

MESHES = """\
<robot name="box"><link name="body"><visual><origin xyz="0 0 0.1"/><geometry>
<mesh filename="{file}" scale="1 1 1"/></geometry></visual></link></robot>
"""

Scored = tuple[Path, Path, Path | str]
"""Task, environment and robot of an accepted file, to be scored and re-checked."""


@dataclass(frozen=True)
class FileType:
    """A type of file, a valid example of it, and what is done with it."""

    name: str
    """Name of the type in the table."""
    file: str
    """Name of the file in the working folder."""
    mutate: Mutation
    read: Callable[[Path], Any]
    """Reads and checks the file, in milliseconds."""
    use: Callable[[Path, int], Scored | None]
    """Reads the file and builds what the program builds of it; returns what to score, None where
    there is nothing. Its second argument is the number of the mutant, to do expensive things with
    one in ten."""


def prepare(folder: Path, files: Collection[str]) -> None:
    """Write valid examples into a folder: all that a person could have written, and some others.

    Args:
        folder: The folder.
        files: Names of the files that are needed of those that `tcs` makes.
    """
    write_texts(folder)
    for made, write in _RESULTS:
        if not made.isdisjoint(files):
            write(folder)


def write_texts(folder: Path) -> None:
    """Write the examples that a person could have written, and a mesh."""
    import trimesh
    import yaml

    texts = {
        "task.yaml": TASK,
        "kitchen.yaml": ENVIRONMENT,
        "table.sdf": TABLE,
        "lamp.sdf": LAMP,
        "errors.yaml": ERRORS,
        "mesh.obj": OBJ,
        "obj.urdf": MESHES.format(file="mesh.obj"),
        "stl.urdf": MESHES.format(file="mesh.stl"),
    }
    robots = data_folder() / "models" / "robots"
    for name in ("iiwa7.urdf", "iiwa7_primitives.csv"):
        texts[name] = (robots / name).read_text(encoding="utf-8")
    robot = yaml.safe_load((robots / "iiwa7.yaml").read_text(encoding="utf-8"))
    robot["frames"].append({"name": "tip", "parent": "spoon", "xyz": [0.1, 0, 0]})
    spoon = "{kind: capsule, size: [0.01, 0.08], xyz: [0.09, 0, 0], rpy_deg: [0, 90, 0]}"
    robot["bodies"] = [{"name": "spoon", "parent": "flange", "primitives": [yaml.safe_load(spoon)]}]
    robot["rest"] = {"iiwa_joint_4": -1.0}
    texts["iiwa7.yaml"] = yaml.safe_dump(robot, sort_keys=False)
    head = data_folder() / "models" / "heads" / "pr2.yaml"
    texts["head.yaml"] = head.read_text(encoding="utf-8")
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    trimesh.creation.box((0.05, 0.1, 0.2)).export(folder / "mesh.stl")


def _write_arplace(folder: Path) -> None:
    """Write an ARPlace model of TIAGo and a probability map."""
    from tcs.capability.arplace import (
        TableTask,
        learn,
        query,
        save_arplace,
        save_probability_map,
    )
    from tcs.model.grid import Axis

    task = TableTask(
        distance=Axis("distance", "m", 0.0, 0.15, 3),
        base_x=Axis("base_x", "m", -1.0, 0.1, 11),
        base_y=Axis("base_y", "m", -0.9, 0.1, 19),
    )
    model = learn("tiago", task)
    save_arplace(folder / "model.arp", model)
    save_probability_map(folder / "map.apm", query(model).map)


def _write_scores(folder: Path) -> None:
    """Write the scores of the kitchen."""
    import tcs

    scores = tcs.score(
        folder / "task.yaml", folder / "kitchen.yaml", folder / "iiwa7.yaml", approach=False
    )
    tcs.save(folder / "scores.tcs", scores)


def _write_map(folder: Path) -> None:
    """Write a recording, and the map that is made of it."""
    from tcs.capability import MapGrid, map_from_recording, save_map, write_csv
    from tcs_studies.simulated_recording import HandMotion, simulate_recording

    reach = default_reach()
    recording = simulate_recording(reach, HandMotion(seconds=2.0), seed=0).recording
    write_csv(folder / "recording.csv", reach.robot, recording)
    grid = MapGrid.of(0.1, 8, "all")
    save_map(folder / "map.tcm", map_from_recording(reach, grid, recording).capability)


def _write_run(folder: Path) -> None:
    """Write a run of teleoperation, of random numbers."""
    from tcs.model.robots import load_robot
    from tcs.teleop.runs.run import Run
    from tcs.teleop.runs.run_files import save_run

    robot = load_robot("iiwa7")
    rng, n = np.random.default_rng(0), 20
    quaternion = rng.standard_normal((n, 4))
    run = Run(
        robot.arm_joints,
        time=np.arange(n) * 0.01,
        joints=rng.uniform(-1.0, 1.0, (n, 7)),
        rates=rng.standard_normal((n, 7)),
        position=rng.standard_normal((n, 3)),
        quaternion=quaternion / np.linalg.norm(quaternion, axis=1)[:, None],
        linear=rng.standard_normal((n, 3)),
        angular=rng.standard_normal((n, 3)),
        group=rng.integers(-1, 4, n),
        sign=rng.integers(-1, 2, n),
        clutch=rng.random(n) < 0.5,
        mode=np.where(rng.random(n) < 0.5, "pose", "end-effector"),
        limits=rng.integers(-1, 2, (n, 7)),
        singular=rng.random(n) < 0.5,
        stopped=rng.random(n) < 0.5,
        metadata={"robot": "iiwa7", "seed": 0},
    )
    save_run(folder / "run.csv", run)


_RESULTS: tuple[tuple[frozenset[str], Callable[[Path], None]], ...] = (
    (frozenset({"scores.tcs"}), _write_scores),
    (frozenset({"recording.csv", "map.tcm"}), _write_map),
    (frozenset({"model.arp", "map.apm"}), _write_arplace),
    (frozenset({"run.csv"}), _write_run),
)
"""Files that `tcs` makes, and what makes them."""


def three(folder: Path) -> Scored:
    """Return the task, the environment and the robot in a folder."""
    return folder / "task.yaml", folder / "kitchen.yaml", folder / "iiwa7.yaml"


def _read_task(path: Path) -> Any:
    from tcs.model.tasks import load_task

    return load_task(path)


def _read_environment(path: Path) -> Any:
    from tcs.model.scene import load_environment

    return load_environment(path)


def _read_model(path: Path) -> Any:
    from tcs.model.scene.environment.model_files import check_model_file

    return check_model_file(path, f"model '{path}'")


def _read_robot(path: Path) -> Any:
    from tcs.model.robots import load_robot

    return load_robot(path.parent / "iiwa7.yaml")


def _read_mesh(path: Path) -> Any:
    from tcs.model.robots.urdf import read_urdf
    from tcs.model.robots.urdf.surfaces import body_triangles

    return body_triangles(read_urdf(path.with_name(f"{path.suffix[1:]}.urdf")))


def _read_errors(path: Path) -> Any:
    from tcs.errors import DataFileError
    from tcs.files.documents import read_document
    from tcs.placement.robustness.error_model import ErrorFile

    return read_document(path, ErrorFile, f"error file '{path}'", DataFileError)


def _read_head(path: Path) -> Any:
    from tcs.capability.head import load_head
    from tcs.model.robots import load_robot

    return load_head(load_robot("pr2"), path)


def _read_scores(path: Path) -> Any:
    import tcs

    return tcs.load(path).nominal.scores


def _read_map(path: Path) -> Any:
    from tcs.capability import load_map

    return load_map(path)


def _read_arplace(path: Path) -> Any:
    from tcs.capability.arplace import load_arplace

    return load_arplace(path)


def _read_probability_map(path: Path) -> Any:
    from tcs.capability.arplace import load_probability_map

    return load_probability_map(path)


def _read_run(path: Path) -> Any:
    from tcs.teleop.runs.run_files import load_run

    return json.dumps(load_run(path).metadata)


def _read_recording(path: Path) -> Any:
    from tcs.capability import read_csv
    from tcs.model.robots import load_robot

    return read_csv(path, load_robot("pr2"), drop_bad=True)


def _task(path: Path, _: int) -> Scored:
    _read_task(path)
    return three(path.parent)


def _scene(path: Path, _: int) -> Scored:
    """Build the scene of the robot in the environment, whichever of the files was changed."""
    from tcs.model.scene import Scene, SceneSpec

    task, kitchen, iiwa = three(path.parent)
    Scene(SceneSpec(_read_robot(iiwa), _read_environment(kitchen)))
    return task, kitchen, iiwa


def _urdf(path: Path, number: int) -> Scored:
    """Draft a robot from one URDF in ten, and build the scene of every one."""
    from tcs_shapes.draft import draft_robot

    if number % 10 == 0:
        draft_robot(str(path), "iiwa_link_ee_kuka")
    return _scene(path, number)


def _mesh(path: Path, number: int) -> None:
    """Convert a mesh for Drake, and fit primitives to one in ten."""
    from tcs.model.robots.urdf.meshes import as_obj
    from tcs_shapes.covering import Target, fit_triangles

    for body, triangles in _read_mesh(path).items():
        if number % 10 == 0:
            fit_triangles(body, triangles, Target(protrusion=0.01, max_shapes=8))
    as_obj(path)


@cache
def _unchanged_scene(folder: Path) -> Any:
    """Return the scene of the unchanged files."""
    from tcs.model.scene import Scene, SceneSpec

    _, kitchen, iiwa = three(folder)
    return Scene(SceneSpec(_read_robot(iiwa), _read_environment(kitchen)))


@cache
def default_reach() -> Any:
    """Return the reach of the PR2, made once."""
    from tcs.capability import Reach

    return Reach.load("pr2", step=0.1)


def _errors(path: Path, _: int) -> None:
    from tcs.placement.robustness.error_model import ErrorModel

    drawn = ErrorModel.of(_unchanged_scene(path.parent), path).draw(16, 0)
    assert all(np.all(np.isfinite(values)) for values in drawn.values())


def _head(path: Path, _: int) -> None:
    from tcs.capability.head import head_view

    reach = default_reach()
    head_view(reach.scene, reach.torso_height, path)


def _scores(path: Path, _: int) -> None:
    import tcs
    from tcs.placement.store.frame import score_frame

    loaded = tcs.load(path)
    here = tcs.InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    try:
        tcs.select(loaded, here)
    finally:
        score_frame(loaded)


def _map(path: Path, _: int) -> None:
    from tcs.capability import TaskShape, load_map, merge

    loaded = load_map(path)
    merge(loaded, TaskShape(shape="pick-and-place", height=0.41).task(loaded.grid.step))


def _arplace(path: Path, _: int) -> None:
    from tcs.capability.arplace import covariance_of, load_arplace, query

    query(load_arplace(path), covariance=covariance_of((0.05, 0.05, 0.0, 0.0)), samples=50)


def _probability_map(path: Path, _: int) -> None:
    from tcs.capability.arplace import load_probability_map, merge_maps

    loaded = load_probability_map(path)
    merge_maps([loaded, loaded], "product").best()


def _run(path: Path, number: int) -> None:
    from tcs.output.view.teleop.replay import load_run_view

    _read_run(path)
    if number % 10 == 0:
        load_run_view(path, None)


def _recording(path: Path, _: int) -> None:
    from tcs.capability import MapGrid, map_from_recording, read_csv

    reach = default_reach()
    recording = read_csv(path, reach.robot, drop_bad=True)
    map_from_recording(reach, MapGrid.of(0.1, 8, "all"), recording)


FILE_TYPES = (
    FileType("task", "task.yaml", mutations.yaml_mutated, _read_task, _task),
    FileType("environment", "kitchen.yaml", mutations.yaml_mutated, _read_environment, _scene),
    FileType("SDFormat model", "table.sdf", mutations.xml_mutated, _read_model, _scene),
    FileType("robot file", "iiwa7.yaml", mutations.yaml_mutated, _read_robot, _scene),
    FileType(
        "primitives (CSV)", "iiwa7_primitives.csv", mutations.csv_mutated, _read_robot, _scene
    ),
    FileType("URDF", "iiwa7.urdf", mutations.xml_mutated, _read_robot, _urdf),
    FileType("mesh (OBJ)", "mesh.obj", mutations.obj_mutated, _read_mesh, _mesh),
    FileType("mesh (STL)", "mesh.stl", mutations.stl_mutated, _read_mesh, _mesh),
    FileType("error file", "errors.yaml", mutations.yaml_mutated, _read_errors, _errors),
    FileType("head file", "head.yaml", mutations.yaml_mutated, _read_head, _head),
    FileType("score file", "scores.tcs", mutations.joblib_mutated, _read_scores, _scores),
    FileType("capability map", "map.tcm", mutations.joblib_mutated, _read_map, _map),
    FileType("ARPlace model", "model.arp", mutations.joblib_mutated, _read_arplace, _arplace),
    FileType(
        "probability map",
        "map.apm",
        mutations.joblib_mutated,
        _read_probability_map,
        _probability_map,
    ),
    FileType("run (CSV)", "run.csv", mutations.json_cell_mutated, _read_run, _run),
    FileType(
        "recording (CSV)", "recording.csv", mutations.csv_mutated, _read_recording, _recording
    ),
)
"""The types of files of scenes, scores and maps; `fuzz_further_files.ALL_TYPES` has all."""
