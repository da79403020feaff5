"""Score a task: `python scripts/score_task.py shaving --environment wheelchair`.

The same as `tcs score`, with the same options.
"""

from __future__ import annotations

import sys

from tcs.cli import main

if __name__ == "__main__":
    sys.argv[:1] = ["tcs", "score"]
    main()
