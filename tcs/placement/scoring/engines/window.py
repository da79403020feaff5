"""A bounded number of requests under way at a time."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice

from tcs.placement.scoring.blocks import Block
from tcs.placement.scoring.engines.work import Part


def finished_parts(
    submit: Callable[[Part], Future[Block]], parts: Iterable[Part], width: int
) -> Generator[tuple[Part, Block], None, None]:
    """Yield the scores of parts as they are finished.

    Args:
        submit: Requests the scores of a part.
        parts: The parts.
        width: Greatest number of parts that are requested and not yet yielded, which bounds the
            memory of finished ones.

    Raises:
        Exception: As the first future that fails.
    """
    waiting = iter(parts)
    under_way = {submit(part): part for part in islice(waiting, width)}
    while under_way:
        done, _ = wait(under_way, return_when=FIRST_COMPLETED)
        for future in done:
            part = under_way.pop(future)
            yield part, future.result()
            under_way.update((submit(following), following) for following in islice(waiting, 1))
