"""Further files that `benchmarks/fuzz.py` mutates: of ROS, of people and tools, motions, blocks."""

from __future__ import annotations

import json
import shutil
import struct
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

import fuzz_mutations as mutations
import numpy as np
from fuzz_files import FILE_TYPES, FileType, Scored, default_reach, three
from fuzz_files import prepare as prepare_files

from tcs.files.paths import data_folder

PERSON = """\
sex: female
stature_percentile: 5
mass_percentile: 60
posture: {head_turn_deg: 10, elbow_flexion_left_deg: 20}
"""

PEOPLE = """\
sex,stature,mass_percentile,sitting_height,age
female,1.62,50,0.85,
male,1.9,,,
female,,5,,
male,1.3,60,,9
"""

LOCATED = """\
{"table": "thesis", "pose": {"x": 1.0, "y": 0.2, "yaw_deg": 6.0},
 "covariance": [[0.0004, 0.0001, 0], [0.0001, 0.0004, 0], [0, 0, 0.0004]]}
"""

CONSTRAINTS = """\
only: ["base_x >= -0.7 m", "base_yaw = 0..180 deg"]
keep: [torso]
forbid: ["0.9 -1, 1.2 -1, 1.2 -0.5, 0.9 -0.5", [[3, 3], [4, 3], [4, 4]]]
blocked: ["3 0.9 0.3 0.3 20"]
prefer: ["base_x < -0.7 m"]
"""

PLY = """\
ply
format ascii 1.0
element vertex 27
property float x
property float y
property float z
end_header
"""

_OF_MOTIONS = {"scores.tcs.motions", "plan.json", "kept.block", "manifest.json"}
"""Files that are made together, of scores."""
_OF_SCORES = {*_OF_MOTIONS, "constraints.yaml"}
"""Files that are used with scores."""
BLOCK = 32
"""Configurations of the kitchen's grid, in both observed states."""


def write_texts(folder: Path) -> None:
    """Write the examples that a person could have written, and clouds of points."""
    points = np.stack(np.meshgrid(*[np.linspace(0.0, 0.2, 3)] * 3), axis=-1).reshape(-1, 3)
    rows = "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in points)
    texts = {
        "person.yaml": PERSON,
        "constraints.yaml": CONSTRAINTS,
        "people.csv": PEOPLE,
        "located.json": LOCATED,
        "cloud.ply": PLY + rows,
        "tool.yaml": (data_folder() / "models" / "tools" / "spoon.yaml").read_text("utf-8"),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    np.save(folder / "cloud.npy", points)


def write_bag(path: Path, names: list[str], rows: np.ndarray) -> None:
    """Write joint states as a bag of ROS 1."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types, name = store.types, "sensor_msgs/msg/JointState"
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types["std_msgs/msg/Header"](seq=0, stamp=stamp, frame_id="")
    with Writer(path) as writer:
        connection = writer.add_connection("/joint_states", name, typestore=store)
        for i, row in enumerate(rows):
            state = types[name](header, names, row, np.zeros(0), np.zeros(0))
            writer.write(connection, i * 20_000_000, store.serialize_ros1(state, name))


def prepare(folder: Path, files: Collection[str]) -> None:
    """Write valid examples into a folder, as `fuzz_files.prepare`, of files of all types."""
    needed = set(files)
    if not _OF_SCORES.isdisjoint(files):
        needed.add("scores.tcs")
    if "arm.bag" in files:
        needed.add("recording.csv")
    prepare_files(folder, needed)
    write_texts(folder)
    if "arm.bag" in files:
        names, *rows = (folder / "recording.csv").read_text(encoding="utf-8").splitlines()
        states = np.array([row.split(",") for row in rows[:20]], dtype=np.float64)
        write_bag(folder / "arm.bag", names.split(","), states)
    if not _OF_MOTIONS.isdisjoint(files):
        _write_motions(folder)


def _write_motions(folder: Path) -> None:
    """Write the motions of scores, a plan, and a block."""
    import tcs
    from tcs.files.blocks import MANIFEST
    from tcs.motion import examine, plan, save_plan
    from tcs.placement.scoring import BlockFolder
    from tcs.placement.store import save_motions

    scores = tcs.load(folder / "scores.tcs")
    save_motions(folder / "scores.tcs.motions", examine(scores, seed=0))
    save_plan(folder / "plan.json", plan(scores, scores.nominal.sets.best, seed=0))
    with tempfile.TemporaryDirectory(dir=folder) as blocks:
        tcs.score(*three(folder), blocks=BlockFolder(Path(blocks)), approach=False)
        # Another block has the sets.
        (block,) = Path(blocks).rglob("0*.block")
        shutil.copy(block, folder / "kept.block")
        shutil.copy(block, folder)
        shutil.copy(block.with_name(MANIFEST), folder)


def bag_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a bag with the lengths, names, values or numbers of its records changed."""
    data = bytearray(content)
    lengths, fields = _records(content)
    for _ in range(int(rng.integers(1, 4))):
        action = rng.random()
        if action < 0.4:
            at = mutations.pick(rng, lengths)
            odd = (0, 1, 3, 7, len(content), 2**31 - 1, 2**31, 2**32 - 1)
            struct.pack_into("<I", data, at, mutations.pick(rng, odd))
        elif action < 0.8:
            begin, end = mutations.pick(rng, fields)
            value = str(mutations.pick(rng, (*mutations.TEXTS, "bz2", "lz4", "op", "conn")))
            piece = value.encode(errors="surrogatepass")[: end - begin]
            data[begin : begin + len(piece)] = piece
        else:
            at = int(rng.integers(len(data) - 8))
            with np.errstate(over="ignore"):
                data[at : at + 8] = np.float64(mutations.pick(rng, mutations.NUMBERS)).tobytes()
    return bytes(data)


def _records(content: bytes) -> tuple[list[int], list[tuple[int, int]]]:
    """Return where the lengths of a bag's records stand, and begin and end of their fields."""
    lengths, fields = [], []
    at = content.index(b"\n") + 1
    while at + 4 <= len(content):
        (size,) = struct.unpack_from("<I", content, at)
        lengths.append(at)
        field, end = at + 4, at + 4 + size
        while field + 4 <= end:
            (width,) = struct.unpack_from("<I", content, field)
            lengths.append(field)
            fields.append((field + 4, min(field + 4 + width, end)))
            field += 4 + width
        if end + 4 > len(content):
            break
        lengths.append(end)
        at = end + 4 + struct.unpack_from("<I", content, end)[0]
    return lengths, fields


def json_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a JSON file with nodes changed."""
    tree = mutations.tree_mutated(json.loads(content), rng)
    return json.dumps(tree).encode(errors="surrogatepass")


def npy_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a NumPy array with its description or some numbers changed."""
    begin = content.index(b"\n") + 1
    head, data = content[10:begin].decode("latin1"), bytearray(content[begin:])
    if rng.random() < 0.5:
        shape = mutations.pick(rng, ("()", "(81,)", "(0, 3)", "(2147483648, 3)", "(9, 3, 3)", "x"))
        kind = mutations.pick(rng, ("<f8", "|O", ">f4", "<i2", "|S8", "<c16", "<M8[s]"))
        head = head.replace("(27, 3)", shape) if rng.random() < 0.6 else head.replace("<f8", kind)
    for _ in range(int(rng.integers(1, 4))):
        at = 8 * int(rng.integers(len(data) // 8))
        data[at : at + 8] = np.float64(float(mutations.pick(rng, mutations.NUMBERS))).tobytes()
    return content[:8] + struct.pack("<H", len(head)) + head.encode("latin1") + bytes(data)


def _read_bag(path: Path) -> Any:
    from tcs.capability.bags import read_bags
    from tcs.model.robots import load_robot

    return read_bags([path], load_robot("pr2"), drop_bad=True)


def _read_person(path: Path) -> Any:
    from tcs.model.people import load_person

    return load_person(path)


def _read_people(path: Path) -> Any:
    from tcs.model.people import load_people, scales_of_people

    people = load_people(path)
    scales_of_people(people)
    return people


def _read_located(path: Path) -> Any:
    from tcs.perception.located import load_located

    return load_located(path)


def _located(path: Path, _: int) -> None:
    found = _read_located(path)
    found.in_task_frame()
    found.base_in(found.pose)


def _read_manifest(path: Path) -> Any:
    from tcs.files.blocks import load_manifest

    return load_manifest(path)


def _read_tool(path: Path) -> Any:
    from tcs.model.robots.held_tool import load_tool

    return load_tool(path)


def _read_constraints(path: Path) -> Any:
    from tcs.placement.constraints import read_constraints

    return read_constraints(path)


def _read_cloud(path: Path) -> Any:
    from tcs.model.scene.environment.obstacle_files import cloud_points

    return cloud_points(path, 1.0, "obstacle 'cloud'")


def _read_motions(path: Path) -> Any:
    from tcs.placement.store import load_motions

    return load_motions(path)


def _read_plan(path: Path) -> Any:
    from tcs.motion import load_plan

    return load_plan(path)


def _read_block(path: Path) -> Any:
    from tcs.files.blocks import FORMAT, Blocks, load_block
    from tcs.placement.scoring.blocks import Kept

    blocks = Blocks(path.parent, load_block(path).key)
    kept = Kept(blocks, goals=3, joints=7, contacts=10_000)
    return FORMAT.load(path, lambda inner: kept._decode(inner, 0, BLOCK))


def _bag(path: Path, _: int) -> None:
    from tcs.capability import MapGrid, map_from_recording

    map_from_recording(default_reach(), MapGrid.of(0.1, 8, "all"), _read_bag(path))


def _person(path: Path, number: int) -> None:
    """Move the goals to the person, and build the scene of one in ten."""
    from tcs.placement.scoring.job import load_job

    job = load_job("shaving", "wheelchair", "pr2", person=_read_person(path))
    if number % 10 == 0:
        job.scene()


def _tool(path: Path, _: int) -> Scored:
    from tcs.model.robots.held_tool import holding, load_robot

    task, kitchen, _ = three(path.parent)
    robot = holding("iiwa7", path)
    load_robot(robot)
    return task, kitchen, robot


def _constraints(path: Path, _: int) -> None:
    import tcs

    loaded = tcs.load(path.parent / "scores.tcs")
    here = tcs.InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    tcs.select(loaded, here, constraints=_read_constraints(path))


def _motions(path: Path, _: int) -> None:
    import tcs
    from tcs.placement.store import motions_of

    motions_of(tcs.load(path.parent / "scores.tcs"), path.with_suffix(""))


def _plan(path: Path, number: int) -> None:
    from tcs.motion.plan_files import plan_csv, plan_messages

    plan = _read_plan(path)
    if number % 10 == 0:
        plan_csv(plan)
        plan_messages(plan)


def _read_only(read: Any) -> Any:
    def use(path: Path, _: int) -> None:
        read(path)

    return use


ALL_TYPES = (
    *FILE_TYPES,
    FileType("bag (ROS 1)", "arm.bag", bag_mutated, _read_bag, _bag),
    FileType("person file", "person.yaml", mutations.yaml_mutated, _read_person, _person),
    FileType(
        "people (CSV)", "people.csv", mutations.csv_mutated, _read_people, _read_only(_read_people)
    ),
    FileType("located table", "located.json", json_mutated, _read_located, _located),
    FileType("tool file", "tool.yaml", mutations.yaml_mutated, _read_tool, _tool),
    FileType(
        "constraints file",
        "constraints.yaml",
        mutations.yaml_mutated,
        _read_constraints,
        _constraints,
    ),
    FileType(
        "points (PLY)", "cloud.ply", mutations.obj_mutated, _read_cloud, _read_only(_read_cloud)
    ),
    FileType("points (NPY)", "cloud.npy", npy_mutated, _read_cloud, _read_only(_read_cloud)),
    FileType(
        "motion file", "scores.tcs.motions", mutations.joblib_mutated, _read_motions, _motions
    ),
    FileType("plan (JSON)", "plan.json", json_mutated, _read_plan, _plan),
    FileType("block", "kept.block", mutations.joblib_mutated, _read_block, _read_only(_read_block)),
    FileType(
        "manifest of blocks",
        "manifest.json",
        json_mutated,
        _read_manifest,
        _read_only(_read_manifest),
    ),
)
"""Every type of file that a user can hand to `tcs`."""
