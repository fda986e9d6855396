"""Looking whether the ball is in the basket."""

from __future__ import annotations

import numpy as np

from dr_eureka.catching.ball_track import View
from dr_eureka.catching.catcher_settings import JudgingSettings
from dr_eureka.catching.localisation import LocalisationError, eye_at, locate_by_size
from dr_eureka.catching.settings import SaikaSettings


class BasketLook:
    """Collects views of the basket that were taken while head and arm were still."""

    def __init__(self, settings: JudgingSettings, saika: SaikaSettings, began_s: float):
        self._settings, self._saika, self._began_s = settings, saika, began_s
        self._still_s: float | None = None
        self._sights: list[bool] = []

    def be_still(self, now_s: float) -> None:
        """Note that head and arm are where they look from; they stay there."""
        self._still_s = now_s if self._still_s is None else self._still_s

    def add(self, view: View, basket_centre: np.ndarray) -> None:
        """Take a view, the middle of the rim being at (3,) [m] in base; one from before all was at rest does not count."""
        if self._still_s is not None and view.time_s >= self._still_s + self._settings.rest_s:
            self._sights.append(self._shows_ball(view, basket_centre))

    def decided(self, now_s: float) -> bool:
        """Tell whether there are views enough, or no more time."""
        return len(self._sights) >= self._settings.views or now_s - self._began_s > self._settings.limit_s

    @property
    def seen(self) -> bool:
        """Whether any view showed the basket."""
        return bool(self._sights)

    @property
    def ball_in_basket(self) -> bool:
        """Whether half of the views or more show a ball in the basket."""
        return self.seen and sum(self._sights) >= 0.5 * len(self._sights)

    def _shows_ball(self, view: View, basket_centre: np.ndarray) -> bool:
        eye = eye_at(self._saika, view.base_from_camera)
        bottom = basket_centre - [0.0, 0.0, 0.5 * self._saika.body.basket_depth_m]
        for ball in view.balls:
            try:
                place, _ = locate_by_size(np.array(ball.centre_px), ball.diameter_px, eye)
            except LocalisationError:
                continue
            if np.linalg.norm(place - bottom) < self._settings.within_m:
                return True
        return False
