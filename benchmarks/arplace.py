"""Measure ARPlace: errors of its models, time of queries, and chosen base positions against others.

Usage: python benchmarks/arplace.py [--samples 1000] [--queries 100] [--pictures FOLDER]

The base position for a top grasp of TIAGo on a table is chosen by ARPlace, by TCS and by the
capability map, and judged by the kernel at the same poses of the object, which differ by a normal
error of its x and y. This is a benchmark, not a test.
"""

from __future__ import annotations

import dataclasses
import math
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from table import header, parser, record, row, save, spread

from tcs.capability import (
    Grasp,
    GraspPosition,
    GraspTask,
    MapGrid,
    MapVolume,
    Reach,
    Surroundings,
    map_from_ik,
    merge,
)
from tcs.capability.arplace import (
    Arplace,
    Errors,
    ModelOptions,
    ObjectPose,
    TableTask,
    covariance_of,
    learn,
    query,
)
from tcs.capability.arplace.labels import grasp_rotation, label, table_scene
from tcs.capability.arplace.learning import generalised
from tcs.capability.arplace.query import wilson_interval
from tcs.errors import SelectionError
from tcs.files.writing import make_folder
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import score as score_rows
from tcs.model.grid import Axis, Grid
from tcs.model.random_streams import named_generator
from tcs.model.robots import load_robot
from tcs.model.scene import EnvironmentFile, ErrorDistribution, lower
from tcs.output.draw import save_figure
from tcs.output.draw.arplace import figure_of
from tcs.placement.robustness import robustify
from tcs.placement.scoring import score

ROBOT = "tiago"
HEIGHT = 0.515
"""Height of the tool in the comparison [m]."""
CASES = ((0.1, 0.05), (0.25, 0.05), (0.4, 0.05), (0.25, 0.1), (0.4, 0.1))
"""Distance from the table's edge, and standard deviation of x and y [m]."""
WIDE = Axis("distance", "m", 0.0, 0.05, 14)
"""Distances beyond those of the thesis, up to some from which no base position reaches."""
OBJECT = """<?xml version="1.0"?>
<sdf version="1.9">
  <model name="object" canonical_link="base_link">
    <link name="base_link"/>
    <link name="moved_x"/>
    <joint name="object_x" type="prismatic">
      <parent>base_link</parent><child>moved_x</child>
      <axis><xyz>1 0 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis>
    </joint>
    <link name="grasp"/>
    <joint name="object_y" type="prismatic">
      <parent>moved_x</parent><child>grasp</child>
      <axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis>
    </joint>
  </model>
</sdf>
"""


@dataclass(frozen=True)
class Place:
    """A chosen base pose."""

    x: float
    y: float
    yaw: float
    torso_height: float


def main() -> None:
    """Measure and print everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--samples", type=int, default=1000, help="poses that are judged")
    command_line.add_argument("--queries", type=int, default=100, help="timed queries of each")
    command_line.add_argument("--pictures", type=Path, metavar="FOLDER", help="also draw these")
    options = command_line.parse_args()
    if options.pictures is not None:
        make_folder(options.pictures)
    header("scikit-learn")
    begun = time.process_time()
    arplace = learn(ROBOT)
    seconds = time.process_time() - begun
    row("learn", f"{seconds:.1f} s, with the kernel compiled")
    errors(arplace)
    side_grasps()
    times(arplace, options.queries, seconds)
    comparison(arplace, options.samples)
    if options.pictures is not None:
        for name in ("modes", "reconstruction"):
            save_figure(options.pictures / f"arplace-{name}.png", figure_of(arplace, name))
    save(options)


def between(task: TableTask) -> TableTask:
    """Return the task of the grasps in the middle between those of another one."""

    def halfway(axis: Axis) -> Axis:
        if axis.count == 1:
            return axis
        start = axis.start + 0.5 * axis.step
        return dataclasses.replace(axis, start=start, count=axis.count - 1)

    return dataclasses.replace(
        task,
        distance=halfway(task.distance),
        height=halfway(task.height),
        angle=halfway(task.angle),
    )


def errors(arplace: Arplace) -> None:
    """Record labels that each model gets wrong, at learned grasps and between them."""
    task = arplace.task
    held_out = between(task)
    reached = label(load_robot(ROBOT), held_out).reached
    rows = []
    for representation, rules in (
        ("by-shape", ("linear", "quadratic", "interpolated")),
        ("equidistant", ("linear", "quadratic", "interpolated")),
        ("signed-distance", ("linear", "quadratic", "interpolated")),
    ):
        model = generalised(task, arplace.reached, ModelOptions(representation=representation))
        for rule in rules:
            success = model.success_model_of(rule, model.energy)
            here = Errors.of(model.predicted(task.parameters, success), arplace.reached)
            there = Errors.of(model.predicted(held_out.parameters, success), reached)
            rows.append(
                [
                    *(representation, rule, str(success.kept)),
                    *(of(here.false_inclusions, here), of(here.false_exclusions, here)),
                    *(of(there.false_inclusions, there), of(there.false_exclusions, there)),
                ]
            )
            row(f"{representation}, {rule}", ", ".join(rows[-1][2:]))
    columns = [
        *("regions", "success model", "modes"),
        *("falsely included, learned", "falsely excluded, learned"),
        *("falsely included, between", "falsely excluded, between"),
    ]
    record("errors", columns, rows)


def of(count: int, found: Errors) -> str:
    """Return a number of labels as a percentage of those that are reached."""
    return f"{100.0 * count / found.reached:.1f} %"


def side_grasps() -> None:
    """Record the regions of side grasps over distance and angle, which failed in the thesis."""
    task = TableTask(
        approach="side",
        height=Axis("height", "m", 0.515, 0.0, 1),
        angle=Axis("angle", "deg", -60.0, 30.0, 5),
        below_tool=0.1,
    )
    model = learn(ROBOT, task)
    held_out = between(task)
    reached = label(load_robot(ROBOT), held_out).reached
    here = Errors.of(model.predicted(task.parameters), model.reached)
    there = Errors.of(model.predicted(held_out.parameters), reached)
    counts = [len(boundary) for boundary in model.boundaries]
    cells = {
        "grasps": str(len(task)),
        "no boundary": str(counts.count(0)),
        "one boundary": str(counts.count(1)),
        "several": str(sum(count > 1 for count in counts)),
        "regions": model.representation,
        "success model": model.rule,
        "falsely included, learned": of(here.false_inclusions, here),
        "falsely excluded, learned": of(here.false_exclusions, here),
        "falsely included, between": of(there.false_inclusions, there),
        "falsely excluded, between": of(there.false_exclusions, there),
    }
    row("side grasps", ", ".join(f"{name} {text}" for name, text in cells.items()))
    record("side_grasps", list(cells), [list(cells.values())])


def times(arplace: Arplace, queries: int, seconds: float) -> None:
    """Record the time of learning and of queries by representation."""
    rows = [["learning, labels included", f"{seconds:.1f} s"]]
    for representation in ("by-shape", "equidistant", "signed-distance"):
        options = ModelOptions(representation=representation)
        model = generalised(arplace.task, arplace.reached, options)
        spent = []
        for seed in range(queries + 1):
            covariance = covariance_of((0.05, 0.05, 0.02, 0.0))
            begun = time.process_time()
            query(model, None, covariance, seed=seed)
            spent.append(time.process_time() - begun)
        # The first query loads what all others share.
        text = spread(spent[1:], "ms", 1e3)
        row(f"query, {representation}", text)
        rows.append([f"query of 1,000 samples, {representation}", text])
    record("times", ["", "processor time"], rows)


def comparison(arplace: Arplace, samples: int) -> None:
    """Record the success of the base positions that each method chooses."""
    judge = Judge()
    capability = capability_volume(arplace.torso_height)
    wide = learn(ROBOT, dataclasses.replace(arplace.task, distance=WIDE))
    row("wide", f"{wide.representation}, {np.count_nonzero(wide.simple)} of {len(wide.task)}")
    rows = []
    for distance, std in CASES:
        pose = ObjectPose(distance=distance, height=HEIGHT)
        offsets = std * named_generator(1, "judged poses").standard_normal((samples, 2))
        covariance = covariance_of((std, std, 0.0, 0.0))
        chosen: dict[str, tuple[Place, float, str]] = {
            "ARPlace": arplace_choice(arplace, pose, covariance),
            "ARPlace, distances to 0.65 m": arplace_choice(wide, pose, covariance),
            "TCS under error": tcs_choice(distance, std, arplace, headings=1),
            "TCS under error, eight headings": tcs_choice(distance, std, arplace, headings=8),
        }
        by_map = capability_choice(capability, distance, judge)
        if by_map is not None:
            chosen["capability map"] = by_map
        for method, (place, seconds, expected) in chosen.items():
            count = judge.reached(place, distance, offsets)
            low, high = wilson_interval(count, samples)
            cells = [
                f"{distance:g} m, {std:g} m",
                method,
                f"{place.x:.2f}, {place.y:.2f}, {math.degrees(place.yaw):.0f}, "
                f"{place.torso_height:.3f}",
                expected,
                f"{count / samples:.3f} ({low:.3f} to {high:.3f})",
                f"{1e3 * seconds:.1f} ms" if seconds < 1.0 else f"{seconds:.1f} s",
            ]
            row(f"{cells[0]}, {method}", ", ".join(cells[2:]))
            rows.append(cells)
    columns = [
        *("distance, error", "method", "x, y [m], yaw [deg], torso [m]", "expected success"),
        *("success, 95 % interval", "processor time"),
    ]
    record("comparison", columns, rows)


class Judge:
    """The kernel with the table of the comparison."""

    def __init__(self) -> None:
        """Build the scene."""
        self.task = TableTask(height=Axis("height", "m", HEIGHT, 0.0, 1))
        self.robot = load_robot(ROBOT)
        self.scene, _ = table_scene(self.robot, self.task)

    @property
    def environment(self) -> EnvironmentFile:
        """The environment with the table."""
        return self.scene.spec.environment

    def reached(self, place: Place, distance: float, offsets: np.ndarray) -> int:
        """Return the number of poses of the object that are reached from a base pose."""
        axes = (
            Axis("base_x", "m", place.x, 0.0, 1),
            Axis("base_y", "m", place.y, 0.0, 1),
            Axis("base_yaw", "deg", math.degrees(place.yaw), 0.0, 1),
            Axis("torso", "m", place.torso_height, 0.0, 1),
        )
        lowered = lower(self.scene, None, Grid(axes))
        count = len(offsets)
        p = np.column_stack([distance + offsets[:, 0], offsets[:, 1], np.full(count, HEIGHT)])
        R = np.tile(grasp_rotation(self.task, 0.0), (count, 1, 1))
        arrays = lowered.arrays._replace(goal_R=R[None], goal_p=p[None])
        scores = score_rows(build_problem(arrays), grid_rows(lowered.grid))
        return int(np.count_nonzero(scores.reason == REACHED))


def arplace_choice(
    arplace: Arplace, pose: ObjectPose, covariance: np.ndarray
) -> tuple[Place, float, str]:
    """Return the best base position of a model, its time and expected success."""
    spent = []
    for _ in range(11):
        begun = time.process_time()
        found = query(arplace, pose, covariance)
        spent.append(time.process_time() - begun)
    place = Place(found.x, found.y, 0.0, arplace.torso_height)
    return place, statistics.median(spent), f"{found.success:.3f}"


def tcs_choice(
    distance: float, std: float, arplace: Arplace, *, headings: int
) -> tuple[Place, float, str]:
    """Return the base pose of the greatest success under error, its time and expected success."""
    rotation = grasp_rotation(arplace.task, 0.0)
    # The tool points down: a rotation by 90 deg about y.
    np.testing.assert_allclose(rotation[:, 0], [0.0, 0.0, -1.0], atol=1e-12)
    half = math.sqrt(0.5)
    goal = {
        "body_frame": "object",
        "position": [0.0, 0.0, 0.0],
        "quaternion_wxyz": [half, 0.0, half, 0.0],
        "weight": 1,
    }
    named = {"name": "grasp", "title": "A top grasp", "source": "ours"}
    box = Judge().environment.obstacles[0]
    grid = {
        "base_x": arplace.task.base_x,
        "base_y": arplace.task.base_y,
        "base_yaw": Axis("base_yaw", "deg", 0.0, 360.0 / headings, headings),
        "torso": Axis("torso", "m", arplace.torso_height, 0.0, 1),
    }
    environment = {
        **named,
        "origin": "on the floor, below the table's edge",
        "models": [{"name": "object", "file": "object.sdf", "xyz": [distance, 0.0, HEIGHT]}],
        "obstacles": [{"name": "table", "box": list(box.box), "xyz": list(box.xyz)}],
        "body_frames": {"object": "object::grasp"},
        "grid": {
            name: {key: value for key, value in axis.to_dict().items() if key != "name"}
            for name, axis in grid.items()
        },
    }
    normal = ErrorDistribution(distribution="normal", std=std)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "object.sdf").write_text(OBJECT, encoding="utf-8")
        (folder / "table.yaml").write_text(yaml.safe_dump(environment), encoding="utf-8")
        task = {**named, "environments": ["grasp"], "tool": "the robot's own", "goals": [goal]}
        (folder / "grasp.yaml").write_text(yaml.safe_dump(task), encoding="utf-8")
        begun = time.process_time()
        file = score(folder / "grasp.yaml", folder / "table.yaml", ROBOT, max_members=1, paper=True)
        file = robustify(file, errors={"object_x": normal, "object_y": normal})
        seconds = time.process_time() - begun
    success = file.tables[0].success
    best = int(np.argmax(success.low))
    configuration = Grid.from_dict(file.grid).configuration(int(success.members[best, 0]))
    place = Place(
        configuration.base_x, configuration.base_y, configuration.base_yaw, configuration.torso
    )
    return place, seconds, f"{success.success[best]:.3f}"


def capability_volume(torso_height: float) -> MapVolume:
    """Return the ICM of top grasps."""
    reach = Reach.load(ROBOT, torso_height=torso_height)
    return MapVolume(map_from_ik(reach, MapGrid.of(0.05, 16, "top"), map_type="ICM"), "fixed")


def capability_choice(
    volume: MapVolume, distance: float, judge: Judge
) -> tuple[Place, float, str] | None:
    """Return the best base pose of the capability map that is feasible with the table.

    None if `Surroundings` finds none.
    """
    grasps = (Grasp(0.0, "top"),)
    task = GraspTask("grasp", (GraspPosition(0.0, 0.0, HEIGHT, grasps),))
    around = Surroundings(judge.robot, judge.environment, (distance, 0.0, 0.0))
    begun = time.process_time()
    try:
        base, _ = around.best(merge(volume, task))
    except SelectionError as error:
        row("capability map", str(error))
        return None
    seconds = time.process_time() - begun
    place = Place(distance + base.x, base.y, base.yaw, base.torso_height)
    return place, seconds, "–"


if __name__ == "__main__":
    main()
