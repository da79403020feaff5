"""A process that judges one input after the other, and is replaced when it ends or hangs."""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

START_SECONDS = 300.0
"""Most processor time for a worker to start, which may have to compile the kernel [s]."""
WAITING = 10.0
"""Longest time for an answer, as a multiple of the processor time: others use the processor too."""
LOOK_SECONDS = 0.5
"""Longest time between two looks at the processor time of a worker [s]."""


class Worker:
    """A process with a folder of its own that answers each input with one line of JSON."""

    def __init__(self, script: Path, words: Sequence[str], master: Path, seconds: float) -> None:
        """Set what the process runs; the first input starts it.

        Args:
            script: Script that prints "ready" and answers the lines on stdin when it is started
                with `--worker FOLDER` and the words.
            words: Further arguments of the script.
            master: Folder whose files are copied into that of each process.
            seconds: Most processor time for one answer [s]. A process that waits rather than
                computes gets WAITING times as long.
        """
        self._script = script
        self._words = words
        self._master = master
        self._seconds = seconds
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def judge(self, question: object) -> dict[str, Any]:
        """Return outcome, text and processor time [s] of an input, which is sent as JSON."""
        if self._process is None:
            self._start()
        assert self._process is not None
        assert self._process.stdin is not None
        begun = processor_seconds(self._process.pid)
        self._process.stdin.write(json.dumps(question).encode() + b"\n")
        self._process.stdin.flush()
        line = self._line(self._seconds)
        if line:
            answer: dict[str, Any] = json.loads(line)
            return answer
        seconds = processor_seconds(self._process.pid) - begun
        limits = f"{self._seconds:g} s of processor time or {WAITING * self._seconds:g} s"
        outcome, text = "hang", f"no answer within {limits}"
        if line is not None:
            outcome, text = "abort", f"the process ended with code {self._process.wait()}"
        self.close()
        return {"outcome": outcome, "text": text, "seconds": seconds}

    @property
    def runs(self) -> bool:
        """Whether there is a process."""
        return self._process is not None

    def _start(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="tcs-fuzz-")
        for file in self._master.iterdir():
            (Path(self._folder.name) / file.name).write_bytes(file.read_bytes())
        self._process = subprocess.Popen(
            [sys.executable, str(self._script), "--worker", self._folder.name, *self._words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        if self._line(START_SECONDS) != b"ready\n":
            raise SystemExit(f"the worker '{' '.join(self._words)}' does not start")

    def _line(self, seconds: float) -> bytes | None:
        """Return the next line of the worker, b"" if it ended, None if there is none in time.

        Args:
            seconds: Most processor time until then [s].
        """
        assert self._process is not None
        assert self._process.stdout is not None
        latest = time.monotonic() + WAITING * seconds
        most = processor_seconds(self._process.pid) + seconds
        while (left := latest - time.monotonic()) > 0:
            ready, _, _ = select.select(
                [self._process.stdout], [], [], min(left, seconds, LOOK_SECONDS)
            )
            if ready:
                return self._process.stdout.readline()
            if processor_seconds(self._process.pid) > most:
                break
        return None

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                # What a dead process has not read is lost.
                with contextlib.suppress(BrokenPipeError):
                    if stream is not None:
                        stream.close()
        if self._folder is not None:
            self._folder.cleanup()
        self._process = self._folder = None


def processor_seconds(process: int) -> float:
    """Return the processor time of a process by its number [s]; 0 where the system has no /proc."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return 0.0
    # User and system time are fields 14 and 15; the second is a name that may contain spaces.
    user, system = stat.rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")
