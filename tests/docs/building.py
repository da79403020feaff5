"""Building the site, as `make docs` does."""

import os
import subprocess
import sys
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
DOCS = CHECKOUT / "docs"


def build(source: Path, out: Path) -> subprocess.CompletedProcess[str]:
    """Build as `make docs` does, with an unreachable proxy, so that nothing can be fetched."""
    command = "-m sphinx --quiet --fail-on-warning --keep-going --builder html".split()
    unreachable = dict.fromkeys(("http_proxy", "https_proxy", "all_proxy"), "http://127.0.0.1:9")
    return subprocess.run(
        [sys.executable, *command, "--conf-dir", str(DOCS), str(source), str(out)],
        env={**os.environ, **unreachable},
        capture_output=True,
        text=True,
        check=False,
    )
