"""Pictures and the viewer show the model named in the environment file as the person."""

from __future__ import annotations

import pytest

from tcs.model.scene import Scene, SceneSpec, load_environment
from tcs.output.draw import Category
from tcs.output.report.score.scene_solids import environment_parts

COUNTER = """
<sdf version="1.9">
  <model name="counter">
    <link name="top">
      <collision name="board"><geometry><box><size>1 0.6 0.04</size></box></geometry></collision>
    </link>
  </model>
</sdf>
"""


def categories(pr2, path) -> dict[str, set[Category]]:
    """Return the category of the shapes of each model."""
    found: dict[str, set[Category]] = {}
    for part, category in environment_parts(Scene(SceneSpec(pr2, load_environment(path)))):
        found.setdefault(part.name.split("::")[0], set()).add(category)
    return found


@pytest.fixture
def counter(tmp_path):
    """An environment of a counter alone, whose top is a body frame that goals may be fixed to."""
    (tmp_path / "counter.sdf").write_text(COUNTER)
    path = tmp_path / "kitchen.yaml"
    path.write_text(
        "based_on: wheelchair\nname: kitchen\ntitle: A counter\nerrors: {}\npadding: {}\n"
        "models: [{name: counter, file: counter.sdf, xyz: [1, 0, 0.9]}]\n"
        "body_frames: {counter: 'counter::top'}\n"
    )
    return path


def test_a_counter_with_a_body_frame_is_furniture(pr2, counter):
    assert categories(pr2, counter) == {"counter": {Category.FURNITURE}}


def test_the_person_of_the_wheelchair_is_the_person(pr2):
    assert categories(pr2, "wheelchair") == {
        "wheelchair": {Category.FURNITURE},
        "person": {Category.PERSON},
    }


def test_a_file_names_its_person(pr2, counter):
    counter.write_text(counter.read_text() + "person: counter\n")
    assert categories(pr2, counter) == {"counter": {Category.PERSON}}
