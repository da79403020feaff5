"""A spherical-shoulder arm, from robot file to verified answers: a Panda on a pedestal."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tcs.kernel.analytic.solver import LAST
from tcs.kernel.problem import build_problem
from tcs.model.robots.urdf.kinematic import kinematic_urdf
from tcs.placement.scoring import load_job, score, verify

PANDA = "package://example-robot-data/robots/panda_description/urdf/panda.urdf"
PEDESTAL = """
  <link name="pedestal" />
  <joint name="pedestal_joint" type="fixed">
    <origin xyz="0 0 0.6" rpy="0 0 0" />
    <parent link="pedestal" />
    <child link="panda_link0" />
  </joint>
</robot>
"""
# Capsules of about the links' size (radius, length between cap centres, centre) [m]: for what is
# tested here they need not enclose the meshes.
CAPSULES = {
    "pedestal": (0.1, 0.4, (0, 0, 0.3), 0.0),
    "panda_link1": (0.06, 0.2, (0, 0, -0.1), 0.0),
    "panda_link3": (0.06, 0.1, (0, 0, -0.1), 0.0),
    "panda_link5": (0.05, 0.2, (0, 0.02, -0.15), 0.0),
    "panda_link7": (0.04, 0.05, (0, 0, 0.03), 0.0),
    "panda_hand": (0.03, 0.12, (0, 0, 0.04), np.pi / 2),
}
ENVIRONMENT = """
based_on: wheelchair
name: small-wheelchair
title: The wheelchair, seen from a few places
grid:
  base_x: {unit: m, start: -1.0, step: 0.2, count: 11}
  base_y: {unit: m, start: -1.0, step: 0.2, count: 11}
  base_yaw: {unit: deg, start: 0, step: 90, count: 4}
  torso: {unit: m, start: 0, step: 0.1, count: 1}
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Paths of a robot file and of an environment file."""
    folder = tmp_path_factory.mktemp("panda")
    urdf = kinematic_urdf(PANDA).replace("</robot>", PEDESTAL)
    (folder / "panda.urdf").write_text(urdf)
    rows = ["body,kind,size_a,size_b,size_c,x,y,z,qw,qx,qy,qz"]
    for body, (radius, length, (x, y, z), roll) in CAPSULES.items():
        turn = f"{np.cos(roll / 2):.9f},{np.sin(roll / 2):.9f},0,0"
        rows.append(f"{body},capsule,{radius},{length},,{x},{y},{z},{turn}")
    (folder / "capsules.csv").write_text("\n".join(rows) + "\n")
    neighbours = [f"- [{a}, {b}]" for a, b in itertools.pairwise(CAPSULES)]
    joints = "\n".join(f"- panda_joint{i}" for i in range(1, 8))
    (folder / "panda.yaml").write_text(
        "name: panda-on-pedestal\ntitle: Franka Panda on a pedestal\nurdf: panda.urdf\n"
        "root_body: pedestal\narm_base: panda_link0\ntool_frame: panda_hand_tcp\n"
        f"arm_joints:\n{joints}\nstanding_bodies: [pedestal]\nprimitives: capsules.csv\n"
        "source: panda_description as packaged in example-robot-data\n"
        "disabled_groups:\n- reason: 'neighbours along the arm'\n  pairs:\n  "
        + "\n  ".join(neighbours)
        + "\n"
    )
    (folder / "environment.yaml").write_text(ENVIRONMENT)
    return folder / "panda.yaml", folder / "environment.yaml"


def test_the_arm_is_solved_in_reverse(files):
    robot, environment = files
    job = load_job("feeding", environment, robot, paper=True)
    lowered = job.lowered(job.scene())
    assert build_problem(lowered.arrays).arm.free == LAST


def test_drake_confirms_what_is_scored_and_the_dense_scan_finds_little_more(files):
    robot, environment = files
    file = score("feeding", environment, robot, paper=True)
    assert np.count_nonzero(file.nominal.scores.reached) > 100
    found = verify(file, pairs=100, dense=20)
    assert found.checked == 100
    # Few pairs are left unreached: the pedestal keeps clear of the chair, or the goal is too far.
    assert found.dense_checked > 10
    assert found.is_sound
    # Some twenty unreached pairs to several hundred reached ones: two or three missed would show.
    assert found.recall > 0.99
