"""An arm that is not as drawn, and a robot that learns it by looking at its own hand (paper 5.2, Figure 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dr_eureka.catching.arm_training import ArmSamples
from dr_eureka.catching.localisation import LocalisationError, locate_by_parallax, rig_at
from dr_eureka.catching.saika import SaikaArm, SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.saika_cameras import AnalyticCamera
from dr_eureka.simulation.saika_settings import SaikaWorldSettings

# One standard deviation of what the paper names: offsets of the joints' origins, and backlash of the gears, in which a joint
# stops anywhere. The neck has both, too.
_OFFSET_RAD = np.radians(1.5)
_BACKLASH_RAD = np.radians(0.5)
_LOOKS = 6  # of turning the head further toward the hand


@dataclass(frozen=True, eq=False)
class LookedAt:
    """What the robot saw: samples of its own hand, and how many it could not see."""

    samples: ArmSamples
    unseen: int


class ErringSaika:
    """A Saika with hidden errors, holding a ball in the middle of the basket's rim so that its cameras can see the hand."""

    def __init__(self, settings: SaikaSettings, seed: int) -> None:
        """Draw the hidden errors."""
        self._settings, self._rng = settings, np.random.default_rng([seed, 4])
        self._arm, self._head = SaikaArm(settings), SaikaHead(settings)
        self._offsets = self._rng.normal(0.0, _OFFSET_RAD, 4)
        self._neck_offsets = self._rng.normal(0.0, _OFFSET_RAD, 2)
        self._camera = AnalyticCamera(settings, SaikaWorldSettings.load().sensor, self._rng)

    def hand(self, joints: np.ndarray) -> np.ndarray:
        """Return where the hand truly gets (n, 3) [m] in base when joints a, b, c, d (n, 4) [rad] are commanded."""
        backlash = self._rng.uniform(-_BACKLASH_RAD, _BACKLASH_RAD, joints.shape)
        return self._arm.basket_centre(joints + self._offsets + backlash)

    def look_at_hand(self, joints: np.ndarray) -> LookedAt:
        """Return where the cameras see the hand for joints (n, 4) [rad]: the head turns to it, both views locate it."""
        seen = [self._see(hand, expected) for hand, expected in zip(self.hand(joints), self._arm.basket_centre(joints))]
        kept = np.array([place is not None for place in seen])
        places = np.array([place for place in seen if place is not None])
        return LookedAt(ArmSamples(places, joints[kept]), int((~kept).sum()))

    def as_seen(self, hands: np.ndarray) -> np.ndarray:
        """Return true places (n, 3) [m] as the cameras see them: in a base turned by the neck's offsets; NaN when unseen."""
        seen = [self._see(hand, hand) for hand in hands]
        return np.array([np.full(3, np.nan) if place is None else place for place in seen])

    def _see(self, hand: np.ndarray, expected: np.ndarray) -> np.ndarray | None:
        neck = self._turned_to(expected)
        true_neck = neck + self._neck_offsets + self._rng.uniform(-_BACKLASH_RAD, _BACKLASH_RAD, 2)
        left, right = (
            self._camera.balls(self._head.base_from_camera(side, neck=true_neck), [hand]) for side in ("left", "right")
        )
        if not (left and right):
            return None
        try:
            return locate_by_parallax(left[0].centre_px, right[0].centre_px, rig_at(self._settings, self._head, neck))[0]
        except LocalisationError:
            return None

    def _turned_to(self, place: np.ndarray) -> np.ndarray:
        """Return pan and tilt of the neck (2,) [rad] with which both cameras look at a place (3,) [m]."""
        limits = [np.radians(self._settings.joints[name].range_deg) for name in ("neck_pan", "neck_tilt")]
        neck = np.zeros(2)
        for _ in range(_LOOKS):
            middle = np.mean([self._head.base_from_camera(side, neck=neck) for side in ("left", "right")], axis=0)
            right, down, ahead = middle[:3, :3].T @ (place - middle[:3, 3])
            neck = neck - [np.arctan2(right, ahead), np.arctan2(down, np.hypot(right, ahead))]
            neck = np.array([np.clip(angle, *limit) for angle, limit in zip(neck, limits)])
        return neck
