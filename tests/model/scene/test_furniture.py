"""The furniture's boxes enclose its meshes, within the padding."""

from __future__ import annotations

import numpy as np
import pytest

from tests.model.scene.environments import EnvironmentAlone, numbers, rows


@pytest.mark.parametrize("model", ["bed", "wheelchair"])
def test_boxes_enclose_the_meshes(model):
    environment = EnvironmentAlone(model)
    link_of = {
        part.geometry: environment.plant.get_body(part.body).name() for part in environment.parts
    }
    ours = {part.geometry for part in environment.parts if part.name.startswith(f"{model}::")}
    outside = {}
    points = [row for row in rows("furniture_surface.csv") if row["model"] == model]
    assert len(points) > 700
    for row in points:
        distances = [
            found.distance
            for found in environment.query().ComputeSignedDistanceToPoint(
                numbers(row, "x", "y", "z")
            )
            if found.id_G in ours and link_of[found.id_G] == row["link"]
        ]
        link = f"{model}::{row['link']}"
        outside[link] = max(outside.get(link, -np.inf), min(distances))
    # The mesh of the bed's frame is shifted by 0.3 mm; points are given to a tenth of that.
    assert max(outside.values()) < 4e-4
    assert {link: d for link, d in outside.items() if d > environment.file.padding[link]} == {}
    assert len(outside) == (5 if model == "bed" else 1)
