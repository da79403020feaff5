"""Measure the viewer: the time to open it, the time of a slider, the size of its pages.

Usage: python benchmarks/viewer.py [--scores DIR] [--repeats 3] [--moves 20]

Score files are read from DIR, where missing ones are written. No kernel is compiled or run while
something is measured. Nothing here is a test: tests never depend on time.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from table import cell, header, parser, row, save, spread

import tcs
from tcs.files.writing import make_folder
from tcs.output.view import Viewer, make_score_view, open_meshcat, write_score_view
from tcs.output.view.controls import Controls
from tcs.placement.scoring import default_path

VIEWED = (("shaving", "bed", "pr2"), ("feeding", "wheelchair", "pr2"))
PAGES = (
    *((*VIEWED[0], False), *((*VIEWED[1], meshes) for meshes in (False, True))),
    ("feeding", "wheelchair", "tiago", True),
)


def main() -> None:
    """Measure, print and record everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--scores", type=Path, default=Path("out/scores"))
    command_line.add_argument("--repeats", type=int, default=3)
    command_line.add_argument("--moves", type=int, default=20, help="moves of each slider")
    options = command_line.parse_args()
    header()
    make_folder(options.scores)
    files = {
        job: score_file(job, options.scores)
        for job in dict.fromkeys([*VIEWED, *(page[:3] for page in PAGES)])
    }
    for job in VIEWED:
        opening(job, files[job], options.repeats)
    for job in VIEWED:
        sliders(job, files[job], options.moves)
    for *job, meshes in PAGES:
        page_size(tuple(job), files[tuple(job)], meshes=meshes)
    save(options)


def score_file(job: tuple[str, str, str], folder: Path) -> Path:
    """Return the path of a score file; a missing one is scored first."""
    path = folder / default_path(*job)
    if not path.exists():
        tcs.save(path, tcs.score(*job, paper=True))
    return path


def opening(job: tuple[str, str, str], path: Path, repeats: int) -> None:
    """Measure the whole command, and within a process from the file to Meshcat."""
    command = [sys.executable, "-m", "tcs", "view", str(path), "--meshcat"]
    command += ["--no-browser", "--duration", "0"]
    measured(
        f"{name_of(job)}: the whole command `tcs view --meshcat`",
        [
            timed(lambda: subprocess.run(command, check=True, capture_output=True))
            for _ in range(repeats)
        ],
    )
    measured(
        f"{name_of(job)}: from the file until everything is in Meshcat, modules loaded",
        [timed(lambda: viewer_of(path)) for _ in range(repeats)],
    )


def viewer_of(path: Path) -> tuple[Viewer, Controls, object]:
    """Return a viewer with meshes, its controls and its Meshcat, once everything is sent."""
    view = make_score_view(tcs.load(path), meshes=True)
    meshcat = open_meshcat()
    viewer = Viewer(meshcat, view.objects, view.viewed, lambda _: None)
    meshcat.Flush()
    return viewer, Controls(view.viewed), meshcat


def sliders(job: tuple[str, str, str], path: Path, moves: int) -> None:
    """Measure each slider: moved to random values until the change is sent."""
    viewer, controls, meshcat = viewer_of(path)
    rng = np.random.default_rng(0)
    taken: dict[str, list[float]] = {}
    for slider in controls.sliders:
        places = np.arange(slider.low, slider.high + 0.5 * slider.tick, slider.tick)
        for place in rng.choice(places, moves):
            meshcat.SetSliderValue(slider.name, float(place))
            begun = time.perf_counter()
            if viewer.update():
                meshcat.Flush()
                taken.setdefault(slider.name, []).append(time.perf_counter() - begun)
    medians = [statistics.median(seconds) for seconds in taken.values()]
    every = [1e3 * seconds for each in taken.values() for seconds in each]
    text = f"{1e3 * max(medians):.1f} ms, {max(every):.1f} ms (of {len(every)} moves)"
    record(
        f"{name_of(job)}: a slider moved until it is sent, slowest slider's median, slowest", text
    )


def page_size(job: tuple[str, str, str], path: Path, *, meshes: bool) -> None:
    """Measure an exported page."""
    with tempfile.TemporaryDirectory() as folder:
        view = make_score_view(tcs.load(path), meshes=meshes)
        size = write_score_view(view, Path(folder) / "page.html")["bytes"]
    line = f"{name_of(job)}, {'meshes' if meshes else 'collision shapes'}"
    row(f"page: {line}", f"{size / 1e6:.1f} MB")
    cell("pages", line, "size [MB]", f"{size / 1e6:.1f}")


def name_of(job: tuple[str, str, str]) -> str:
    """Return task, environment and robot."""
    return ", ".join(job)


def timed(run: Callable[[], object]) -> float:
    """Return the wall time of a call [s]."""
    begun = time.perf_counter()
    run()
    return time.perf_counter() - begun


def measured(name: str, seconds: list[float]) -> None:
    """Print and record a duration."""
    record(name, spread(seconds))


def record(name: str, text: str) -> None:
    """Print and record one value."""
    row(name, text)
    cell("times", name, "time", text)


if __name__ == "__main__":
    main()
