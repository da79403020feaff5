"""The command `tcs arplace learn`: make a model."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.arplace.groups import GeneralisationOptions, TaskOptions
from tcs.cli.option_groups import expand_options
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import arplace_tables


@expand_options
def learn(
    out: Annotated[Path, typer.Option(help="Model to write.")],
    task: TaskOptions,
    generalisation: GeneralisationOptions,
    robot: options.Robot = "tiago",
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Learn from which base positions grasps on a table are reached.

    The kernel labels every base position for every grasp; contacts with the table count. The
    defaults are the task of Appendix D of the ITCM thesis.
    """
    from tcs.capability.arplace import learn as learn_arplace
    from tcs.capability.arplace import save_arplace

    check_writable(out)
    begun = time.perf_counter()
    with terminal.progress_bar("labels") as on_progress:
        arplace = learn_arplace(
            robot, task.task(), generalisation.options(), jobs=jobs, on_progress=on_progress
        )
    seconds = time.perf_counter() - begun
    save_arplace(out, arplace)
    result = {**arplace_tables.model_result(out, arplace), "seconds": round(seconds, 3)}
    terminal.print_result(result, arplace_tables.report_learned, as_json=as_json)
