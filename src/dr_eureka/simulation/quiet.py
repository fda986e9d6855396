"""Bullet and its OpenGL plugin write notes to standard output, which belongs to the program's own answers."""
from __future__ import annotations

import ctypes
import os
import sys
from contextlib import contextmanager
from typing import Iterator


@contextmanager
def quiet_stdout() -> Iterator[None]:
    """Send what native code writes to standard output meanwhile to nowhere; standard error is left alone."""
    libc = ctypes.CDLL(None)
    sys.stdout.flush()
    libc.fflush(None)
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
        # C buffers its output: what was written in here must also leave in here.
        libc.fflush(None)
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
