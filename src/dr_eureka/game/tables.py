"""Tables that take seconds to make, kept in a folder of the user's and checked by SHA-256 when loaded."""
from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Optional

import numpy as np

from dr_eureka.resources import WeightsError, load_weights, save_weights

_FILE = "table.npz"


def cache_folder() -> Optional[Path]:
    """Return `dr_eureka` under `XDG_CACHE_HOME`, by default `.cache` at home; None for a user without a home."""
    root = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not root.is_absolute():
        # The XDG specification has relative paths ignored.
        try:
            root = Path.home() / ".cache"
        except RuntimeError:
            return None
    return root / "dr_eureka"


def table_key(*parts: Any) -> str:
    """Return a name for what is made from these arrays, texts and bytes: another for any other input."""
    digest = hashlib.sha256()
    for part in parts:
        content = part if isinstance(part, bytes) else np.asarray(part).tobytes()
        digest.update(len(content).to_bytes(8, "big") + content)
    return digest.hexdigest()[:16]


def load_or_make(name: str, make: Callable[[], dict[str, np.ndarray]], folder: Optional[Path]) -> dict[str, np.ndarray]:
    """Load the arrays called `name` from a folder, or make them and keep them there.

    A missing or altered file is made again. A folder that cannot be written to costs time only: nothing is kept.
    """
    if folder is None:
        return make()
    own = folder / name
    try:
        return load_weights(_FILE, own)
    except WeightsError:
        shutil.rmtree(own, ignore_errors=True)
    arrays = make()
    try:
        save_weights(_FILE, arrays, own)
    except OSError:
        pass
    return arrays
