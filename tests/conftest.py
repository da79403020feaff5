"""Fixtures that several packages share; scenes take a second to build, so once a session."""

from __future__ import annotations

import functools
import signal
from pathlib import Path

import numpy as np
import pytest
import typer.main
import typer.testing

from tcs.kernel import second_process
from tcs.model.grid import Grid
from tcs.model.robots import load_robot
from tcs.model.scene import Scene, SceneSpec, load_environment, lower
from tcs.model.scene import scene as scene_module
from tcs.model.scene.plant import build_plant
from tcs.model.tasks import load_task
from tcs.motion import recheck

HERE = Path(__file__).parent
FIRST = (
    "shapes/test_enclosure.py",
    "kernel/test_sweep.py",
    "shapes/test_fitting.py",
    "kernel/test_numeric_sweep.py",
    "shapes/test_splitting.py",
    "kernel/approach/test_approach.py",
    "kernel/test_together.py",
    "kernel/test_real_scene.py",
    "output/report/test_score_report.py",
    "shapes/test_self_collision.py",
    "placement/robustness/test_trials.py",
    "placement/refinement/test_surest.py",
    "cli/test_refine.py",
    "motion/test_tours_in_report.py",
    "placement/scoring/test_together.py",
    "kernel/test_freedom.py",
)
"""Files that `make test` begins with: one process fits shapes while the other compiles the kernel,
so that neither compiles what the other is compiling. A process is given two files, and the next one
when it has finished the first: the third and fifth are for the one that fits shapes. The sixth
compiles approaches, before the many files that score with them. The others take longest: last, they
would keep one process busy alone."""


def pytest_collection_modifyitems(items):
    """Move the tests of FIRST to the front; the others keep their order."""
    places = {HERE / file: place for place, file in enumerate(FIRST)}
    items.sort(key=lambda item: places.get(item.path, len(FIRST)))


@pytest.fixture(autouse=True, scope="session")
def _interruptible():
    """Restore signals that some tests send: shells make background jobs ignore Ctrl-C, and `nohup`
    makes its command ignore the end of a terminal."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(autouse=True, scope="session")
def _plants_are_built_once():
    """Share finalized plants, which nothing changes, between the scenes of one specification.

    A plant takes most of the time that a scene does; each scene has a context of its own. Those of
    the latest specifications only: a plant in which contacts were sought holds 100 MB.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene_module, "build_plant", functools.lru_cache(maxsize=8)(build_plant))
        yield


@pytest.fixture(autouse=True, scope="session")
def _commands_are_built_once():
    """Share the tree of commands, which takes longer to build than most commands to run."""
    built = functools.cache(typer.main.get_command)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", built)
        patch.setattr(typer.testing, "_get_command", built)
        yield


@pytest.fixture(autouse=True, scope="session")
def _coarse_recheck():
    """Postures of the re-check are 4 cm apart: Drake takes ten milliseconds for each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recheck, "LARGEST_STEP", 0.04)
        yield


@pytest.fixture(autouse=True, scope="session")
def _no_second_process():
    """Compile in the processes of the tests alone, of which there are as many as processors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(second_process, "_processors", lambda: 1)
        yield


@pytest.fixture(scope="session")
def wheelchair():
    """The wheelchair environment file."""
    return load_environment("wheelchair")


@pytest.fixture(scope="session")
def pr2():
    """The PR2 robot file."""
    return load_robot("pr2")


@pytest.fixture(scope="session")
def spec(pr2, wheelchair):
    """PR2 and wheelchair."""
    return SceneSpec(pr2, wheelchair)


@pytest.fixture(scope="session")
def _one_scene(spec):
    return Scene(spec)


@pytest.fixture
def scene(_one_scene):
    """A scene of PR2 and wheelchair, in its initial state before and after each test."""
    before = _one_scene.positions()
    yield _one_scene
    _one_scene.restore(before)


@pytest.fixture(scope="session")
def full_grid(wheelchair):
    """The paper's grid of the wheelchair environment."""
    return Grid.from_spec(wheelchair.grid)


@pytest.fixture(scope="session")
def shaving():
    """The shaving task at exact poses."""
    return load_task("shaving").exact()


@pytest.fixture(scope="session")
def lowered(spec, shaving, full_grid):
    """Shaving in the wheelchair, as arrays."""
    return lower(Scene(spec), shaving, full_grid)


@pytest.fixture
def rng():
    """A random generator with a fixed seed."""
    return np.random.default_rng(0)
