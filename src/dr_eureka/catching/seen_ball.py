"""A ball as one picture shows it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SeenBall:
    """One ball in one picture.

    centre_px: (column, row) to which the ball's middle projects; this is not the middle of its outline, an ellipse.
    diameter_px: the apparent size n for which the paper's Equation 1, l = d f / n, gives the middle's depth exactly.
    confidence: 0..1, share of the outline that was seen and agrees with a ball.
    """

    centre_px: tuple[float, float]
    diameter_px: float
    confidence: float
