"""Limits of the service: what it holds in memory and on disk, and how much waits in its queue."""

from __future__ import annotations

from dataclasses import dataclass

SMALL_REQUEST = 1024
"""Most bytes of a request that is read where all requests are answered; larger ones are read, and
answered from score files, in a process of their own."""
MOST_VERTICES = 5000
"""Most vertices of all regions of a request."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of an engine and of its HTTP server."""

    file_bytes: int = 64 * 1024**2
    """Most bytes of a score file that is sent: fifteen times the largest of the paper's rows."""
    stored_bytes: int = 512 * 1024**2
    """Most bytes of all score files in the temporary folder; the least recently used go first."""
    loaded_files: int = 8
    """Most score files in memory, each of up to some hundred megabytes."""
    queued_jobs: int = 8
    """Most jobs that wait; one runs at a time, and uses all threads."""
    kept_jobs: int = 100
    """Most finished jobs whose result is kept."""
    job_seconds: float = 1800.0
    """Longest duration of a job [s]; it is checked where a job reports its progress."""
    threads: int = 2
    """Threads of a job; the results do not depend on it."""
    request_bytes: int = 1024**2
    """Most bytes of a request other than a score file."""
    content_bytes: int = 256 * 1024**2
    """Most bytes of the contents of all requests that arrive or are answered at the same time."""
    parse_seconds: float = 20.0
    """Longest time in which a large request or a score file that was sent is read [s]."""
    parse_bytes: int = 1024**3
    """Most memory that reading it takes."""
    decoded_bytes: int = 256 * 1024**2
    """Most memory of the arrays of a score file that was sent; reading takes up to four times as
    much for a moment, also where requests are answered."""
    parsing: int = 2
    """Processes that read."""
    scene_bytes: int = 4 * 1024**3
    """Most memory of the process that builds and scores scenes that clients describe."""
    document_bytes: int = 32 * 1024**2
    """Most bytes of the task and environment files that are kept; the oldest go first."""
    requests_at_once: int = 128
    """Most requests that are answered at the same time."""
    request_seconds: float = 30.0
    """Longest wait for the content of a request [s]."""
    streams: int = 32
    """Most streams of events at the same time."""
