"""The endless crops that a card detector learns from, all drawn, and all following from a seed."""

from __future__ import annotations

import cv2
import numpy as np

from dr_eureka.vision.card_finder import CROP_PX
from dr_eureka.vision.card_renderer import BALL_COLOURS, CardDrawing, draw_card
from dr_eureka.vision.card_scenes import clutter, decoy, rectified_sample
from dr_eureka.vision.card_style import sample_style
from dr_eureka.vision.card_views import TRAINING_VIEWS, ViewRanges, degrade, sample_view

_TEXTURE_PX = 256
_COUNTS = [(a, b, 6 - a - b) for a in range(5) for b in range(5) if 0 <= 6 - a - b <= 4]


class CardStream:
    """Crops of cards in all 1710 states, of some impossible cards, and of some other things.

    A pool of drawn cards is kept and renewed: each is seen in many views.
    """

    def __init__(self, rng: np.random.Generator, pool: int, look: str = "training",
                 views: ViewRanges = TRAINING_VIEWS) -> None:
        self._rng = rng
        self._look = look
        self._views = views
        self._pool = [self._draw() for _ in range(pool)]

    def _draw(self) -> CardDrawing:
        if self._rng.random() < 0.06:
            return decoy(self._rng, _TEXTURE_PX)
        if self._rng.random() < 0.8:
            order = "".join(self._rng.permutation(list("RRGGPP")))
            first, second, _ = _COUNTS[self._rng.integers(len(_COUNTS))]
            tubes = order[:first], order[first:first + second], order[first + second:]
        else:
            tubes = ["".join(self._rng.choice(list(BALL_COLOURS), self._rng.integers(5))) for _ in range(3)]
        return draw_card("|".join(tubes), self._rng, _TEXTURE_PX, sample_style(self._rng, self._look))

    def renew(self) -> None:
        """Draw a new card in place of one of the pool."""
        self._pool[self._rng.integers(len(self._pool))] = self._draw()

    def sample(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a crop (416, 416, 3) uint8, its balls (n, 4) and its feet (m, 2), as rectified_sample does."""
        if self._rng.random() < 0.03:
            side = int(self._rng.integers(60, 200))
            scene = clutter(self._rng, side, side, int(self._rng.integers(0, 12)))
            seen = degrade(scene, sample_view(self._rng, self._views), self._rng)
            return cv2.resize(seen, (CROP_PX, CROP_PX)), np.zeros((0, 4)), np.zeros((0, 2))
        return rectified_sample(self._pool[self._rng.integers(len(self._pool))], self._rng, self._views)
