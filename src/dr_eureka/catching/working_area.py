"""The part of space in which the left hand catches."""

from __future__ import annotations

import numpy as np
from scipy.cluster.vq import kmeans2

from dr_eureka.catching.saika import SaikaArm
from dr_eureka.catching.settings import WorkingAreaSettings

# What belongs to one of the spread places shrinks toward the middle of the area; so much wider, they reach its edges.
_WIDENING = 1.15
_DRAWN_FOR_SPREADING = 20_000
_ROUNDING = 1e-9  # [m]


class WorkingArea:
    """A box in base, as far as it is within reach of the shoulder."""

    def __init__(self, settings: WorkingAreaSettings, arm: SaikaArm) -> None:
        """Take the shoulder from the arm."""
        self.lower, self.upper = np.array([settings.x_m, settings.y_m, settings.z_m]).T
        self.most_reach_m = settings.most_reach_m
        self.shoulder = arm.shoulder

    def contains(self, positions: np.ndarray) -> np.ndarray:
        """Tell which positions (..., 3) [m] in base are in the area; one that is not finite is not."""
        positions = np.asarray(positions, dtype=float)
        in_box = np.all((positions >= self.lower - _ROUNDING) & (positions <= self.upper + _ROUNDING), axis=-1)
        return in_box & (np.linalg.norm(positions - self.shoulder, axis=-1) <= self.most_reach_m + _ROUNDING)

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return places (count, 3) [m], equally likely everywhere in the area."""
        found = np.empty((0, 3))
        while len(found) < count:
            drawn = rng.uniform(self.lower, self.upper, (2 * count, 3))
            found = np.vstack([found, drawn[self.contains(drawn)]])
        return found[:count]

    def spread(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return places (count, 3) [m] that leave no part of the area far from one of them, some at its very edge.

        They are the means of k-means clusters of many drawn places (Lloyd's algorithm), moved a little outward.
        """
        drawn = self.draw(_DRAWN_FOR_SPREADING, rng)
        size = self.upper - self.lower
        first = drawn[rng.choice(len(drawn), count, replace=False)]
        means, _ = kmeans2(drawn / size, first / size, iter=30, minit="matrix")
        middle = drawn.mean(axis=0)
        return self._pulled_in(middle + _WIDENING * (means * size - middle))

    def _pulled_in(self, positions: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) moved into the area, toward the shoulder where they are too far from it."""
        from_shoulder = np.clip(positions, self.lower, self.upper) - self.shoulder
        reach = np.linalg.norm(from_shoulder, axis=1, keepdims=True)
        return self.shoulder + from_shoulder * np.minimum(1.0, self.most_reach_m / reach)
