"""Score a task: `python scripts/score_task.py shaving --environment wheelchair`.

The same as `tcs score`, with the same options: it runs the installed entry point.
"""

from __future__ import annotations

import runpy
import sys

if __name__ == "__main__":
    sys.argv[:1] = ["tcs", "score"]
    runpy.run_module("tcs", run_name="__main__", alter_sys=False)
