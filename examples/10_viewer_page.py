"""Export a set as one page that opens offline.

`tcs view FILE --export PAGE` does the same; this example shows the single steps.
"""

from __future__ import annotations

from pathlib import Path

import tcs
from tcs.output.view import SceneObjects, ViewedSet, export_page, open_meshcat
from tcs.placement.scoring import rebuild_scenes


def main(folder: Path = Path("out/examples")) -> None:
    """Score feeding, and export the best set as a page."""
    folder.mkdir(parents=True, exist_ok=True)
    # At one height of the torso, to be quick.
    file = tcs.score("feeding", only=("torso = 0.3 m",))
    # The scene is rebuilt from the models of the file; their digest must be the stored one.
    ((job, scene, _),) = rebuild_scenes(file)
    # Without an observed state, table 0 is the only one.
    viewed = ViewedSet.of(file, 0, tcs.select(file).indices)
    objects = SceneObjects(scene, job.task, viewed, meshes=False)
    text = export_page(open_meshcat(), objects, viewed, title="Feeding in the wheelchair, PR2")
    path = folder / "feeding.html"
    path.write_text(text, encoding="utf-8")
    print(f"wrote {path}, {len(text) / 1e6:.1f} MB: open it in a browser")


if __name__ == "__main__":
    main()
