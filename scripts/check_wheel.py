"""Build the wheel, install it in a clean environment, and run every example with it.

Usage: python scripts/check_wheel.py --out out/wheel

The examples run in an empty folder away from the checkout, so that nothing but the wheel and its
dependencies can be imported. The exit code is 1 when one of them fails.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]


def main() -> int:
    """Build, install, run; return 1 when an example fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for wheel and environment")
    out: Path = parser.parse_args().out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    pip = ["-m", "pip", "--disable-pip-version-check"]
    run([sys.executable, *pip, "wheel", "--quiet", "--no-deps", "-w", str(out), str(CHECKOUT)])
    (wheel,) = out.glob("tcs-*.whl")
    venv.create(out / "venv", with_pip=True)
    python = str(out / "venv" / "bin" / "python")
    run([python, *pip, "install", "--quiet", str(wheel)])
    with tempfile.TemporaryDirectory() as folder:
        examples = Path(shutil.copytree(CHECKOUT / "examples", Path(folder) / "examples"))
        where = run(
            [python, "-c", "import tcs, tcs_shapes, tcs_studies; print(tcs.__file__)"], cwd=examples
        ).strip()
        if not Path(where).is_relative_to(out):
            print(f"tcs was imported from '{where}', not from the wheel.", file=sys.stderr)
            return 1
        print(f"{wheel.name} in a clean environment, imported from {where}")
        failed = [path.name for path in sorted(examples.glob("*.py")) if not passes(python, path)]
    print(f"{len(failed)} of the examples failed" if failed else "every example ran with the wheel")
    return 1 if failed else 0


def passes(python: str, example: Path) -> bool:
    """Run one example in its folder; return whether it succeeded."""
    done = subprocess.run(
        [python, example.name], cwd=example.parent, env=clean(), text=True, capture_output=True
    )
    print(f"{'ok' if done.returncode == 0 else 'FAILED'}  {example.name}", flush=True)
    if done.returncode:
        print(done.stderr, file=sys.stderr)
    return done.returncode == 0


def run(command: list[str], cwd: Path | None = None) -> str:
    """Run a command away from the checkout's modules; return what it prints."""
    return subprocess.run(
        command, cwd=cwd, env=clean(), text=True, check=True, stdout=subprocess.PIPE
    ).stdout


def clean() -> dict[str, str]:
    """Return the environment without anything that would let the checkout be imported."""
    return {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}


if __name__ == "__main__":
    sys.exit(main())
