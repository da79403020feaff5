"""Write the answer as one page that opens offline, to look at and to pass on.

`tcs view FILE --export PAGE` does the same; here it is step by step.
"""

from __future__ import annotations

from pathlib import Path

import tcs
from tcs.output.view import SceneObjects, ViewedSet, export_page, open_meshcat
from tcs.placement.scoring import rebuild_scene


def main(folder: Path = Path("out/examples")) -> None:
    """Score feeding, and write the best set at work as a page."""
    folder.mkdir(parents=True, exist_ok=True)
    file = tcs.score("feeding")
    # The scene is built anew from the file, which names its models and knows their digest.
    job, scene, _ = rebuild_scene(file)
    # What came of each configuration; table 0 is the only one where nothing is observed.
    answers = ViewedSet.of(file, 0, file.nominal.sets.best)
    props = SceneObjects(scene, job.task, answers, meshes=False)
    text = export_page(open_meshcat(), props, answers, title="Feeding in the wheelchair, PR2")
    path = folder / "feeding.html"
    path.write_text(text, encoding="utf-8")
    print(f"wrote {path}, {len(text) / 1e6:.1f} MB: open it in a browser")


if __name__ == "__main__":
    main()
