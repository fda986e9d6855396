"""Dark-to-bright steps along many short lines at once, to a fraction of a pixel."""

from __future__ import annotations

import cv2
import numpy as np


def sample(image: np.ndarray, points: np.ndarray, beyond: float) -> np.ndarray:
    """Return the brightness (n, m) of a float32 picture at points (n, m, 2) [px], `beyond` outside of it."""
    columns, rows = (np.ascontiguousarray(points[..., axis], dtype=np.float32) for axis in (0, 1))
    return cv2.remap(image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=beyond)


def rising_edges(
    profiles: np.ndarray, offsets: np.ndarray, reach_px: float, smallest_step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Find the steepest dark-to-bright step of each profile.

    Args:
        profiles: (n, m) brightness along n lines.
        offsets: (m,) evenly spaced places along each line [px].
        reach_px: half the length over which a step is measured; about the width of the blur.
        smallest_step: least rise over that length.

    Returns:
        Whether there is a step (n,), and where (n,) [px]: the centre of gravity of the rise round its steepest place,
        which a symmetric blur does not move. Where there is no step the place means nothing.
    """
    reach = round(reach_px / (offsets[1] - offsets[0]))
    rise = profiles[:, 2 * reach :] - profiles[:, : -2 * reach]
    at = offsets[reach:-reach]
    steepest = np.argmax(rise, axis=1)
    near = np.abs(np.arange(len(at)) - steepest[:, None]) <= reach
    mass = np.where(near, np.maximum(rise, 0.0), 0.0)
    return rise.max(axis=1) > smallest_step, (mass * at).sum(axis=1) / np.maximum(mass.sum(axis=1), 1e-9)
