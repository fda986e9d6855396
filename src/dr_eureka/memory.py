"""Keeping freed memory in the process, for programs that ask for the same large arrays again and again."""

from __future__ import annotations

import ctypes

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # names and values of glibc's malloc.h
_LARGEST_BLOCK = 32 * 2**20  # [bytes] as high as glibc lets its own adaptive threshold grow
_KEPT = 256 * 2**20  # [bytes]


def keep_freed_memory() -> bool:
    """Have malloc keep large freed blocks instead of returning each to the system; return whether it will.

    By default glibc maps megabytes anew for every image and layer, and the page faults take as long as the network
    itself (3000 a picture). Does nothing where the C library is another.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and bool(mallopt(_M_MMAP_THRESHOLD, _LARGEST_BLOCK) and mallopt(_M_TRIM_THRESHOLD, _KEPT))
