"""The same work on many items, shared by processes."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from typing import TypeVar

from dr_eureka.bench.report import progress

_Item = TypeVar("_Item")
_Done = TypeVar("_Done")


def shared_out(
    work: Callable[[_Item], _Done],
    items: Sequence[_Item],
    processes: int | None,
    label: str,
    prepare: Callable[[], None] | None = None,
    at_a_time: int = 1,
) -> list[_Done]:
    """Return what `work` makes of each item, in order, under a progress bar.

    `processes`: how many work, None for one a core; one alone works in this process. `prepare` is called once in each before
    it works. `at_a_time`: how many items a process takes at once.
    """
    count = min(processes or len(os.sched_getaffinity(0)), len(items))
    if count <= 1:
        if prepare is not None:
            prepare()
        return list(progress(map(work, items), len(items), label))
    # A fork would share the state of physics, renderer and torch's threads; a new interpreter starts clean.
    with multiprocessing.get_context("spawn").Pool(count, prepare) as pool:
        return list(progress(pool.imap(work, items, at_a_time), len(items), label))
