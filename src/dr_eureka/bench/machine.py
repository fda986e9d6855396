"""What the machine is on which figures were measured: enough to compare runs, nothing that names it."""

from __future__ import annotations

import importlib
import os
import platform
from pathlib import Path
from typing import Any

_LIBRARIES = ("numpy", "cv2", "torch")
_CPU_INFO = Path("/proc/cpuinfo")


def describe_machine() -> dict[str, Any]:
    """Return the processor's model, the cores this process may use, and the versions of what computes; None if not there."""
    return {
        "cpu": _cpu_model(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        **{name: _version(name) for name in _LIBRARIES},
    }


def _cpu_model() -> str | None:
    """Return the kernel's name of the processor; the standard library knows its architecture only."""
    try:
        lines = _CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.lower().startswith("model name")]
    return names[0] if names else platform.machine() or None


def _version(name: str) -> str | None:
    try:
        return str(importlib.import_module(name).__version__)
    except ImportError:
        return None
