"""One posture for each place of the hand: the paper's two conditions that make inverse kinematics unique (section 5.1).

Four joints place a hand in three dimensions, so the elbow may swing about the line from shoulder to hand. The paper asks for
the least norm of the joint angles where the hand is further out than the shoulder, and for an arm clear of the torso where
it is further in. We take the least norm of all postures within the limits whose upper arm does not lean toward the torso:
where the hand is out, that is the first condition; where it is in, the upper arm then moves in the plane that it hangs in, a
hand's breadth beside the torso, which is the second condition and leaves one posture only.
"""

from __future__ import annotations

import numpy as np

from dr_eureka.catching.saika import SaikaArm

_SWINGS = 361
_REFINEMENTS = 3
_ROUNDING = 1e-9  # [rad]


class PostureChooser:
    """The unique posture of the left arm for a place of its hand."""

    def __init__(self, arm: SaikaArm) -> None:
        self._arm = arm
        self._lower = np.array([arm.lower[0], 0.0, *arm.lower[2:4]])

    def joints(self, positions: np.ndarray) -> np.ndarray:
        """Return a, b, c, d (n, 4) [rad] for places of the hand (n, 3) [m] in base; NaN where no posture is allowed.

        The swing of the elbow is searched on a grid, which is then refined three times about its best point.
        """
        positions = np.atleast_2d(np.asarray(positions, dtype=float))
        swings = np.broadcast_to(np.linspace(-np.pi, np.pi, _SWINGS), (len(positions), _SWINGS))
        spacing = 2.0 * np.pi / (_SWINGS - 1)
        for _ in range(_REFINEMENTS + 1):
            joints = self._postures(positions, swings)
            cost = np.where(self._allowed(joints), np.sum(joints**2, axis=-1), np.inf)
            best = np.argmin(cost, axis=1)
            rows = np.arange(len(positions))
            chosen = np.where(np.isfinite(cost[rows, best])[:, None], joints[rows, best], np.nan)
            swings = swings[rows, best][:, None] + spacing * np.linspace(-1.0, 1.0, 41)
            spacing /= 20.0
        return chosen

    def _postures(self, positions: np.ndarray, swings: np.ndarray) -> np.ndarray:
        """Return a, b, c, d (n, m, 4) for elbows swung by (n, m) [rad] about the line from shoulder to hand (n, 3)."""
        upper, fore = self._arm.upper_arm_m, self._arm.elbow_to_hand_m
        to_hand = positions - self._arm.shoulder
        reach = np.linalg.norm(to_hand, axis=1)
        with np.errstate(invalid="ignore"):  # NaN where the hand cannot get
            bend = np.arccos((reach**2 - upper**2 - fore**2) / (2.0 * upper * fore))
            at_shoulder = np.arccos((reach**2 + upper**2 - fore**2) / (2.0 * upper * reach))
        line = to_hand / reach[:, None]
        outward = np.cross(line, [0.0, 0.0, 1.0])
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        below = np.cross(outward, line) * -1.0
        ring = np.cos(swings)[..., None] * below[:, None] + np.sin(swings)[..., None] * outward[:, None]
        upper_arm = np.cos(at_shoulder)[:, None, None] * line[:, None] + np.sin(at_shoulder)[:, None, None] * ring
        forearm = (to_hand[:, None] - upper * upper_arm) / fore
        # The upper arm hangs along -z and points along (-sin b, sin a cos b, -cos a cos b) when pitched by a and rolled by
        # b.
        pitch = np.arctan2(upper_arm[..., 1], -upper_arm[..., 2])
        roll = np.arcsin(np.clip(-upper_arm[..., 0], -1.0, 1.0))
        # In the frame of the rolled upper arm the forearm points along (-sin c sin d, cos c sin d, -cos d).
        forward = np.cos(pitch) * forearm[..., 1] + np.sin(pitch) * forearm[..., 2]
        up = np.cos(pitch) * forearm[..., 2] - np.sin(pitch) * forearm[..., 1]
        sideways = np.cos(roll) * forearm[..., 0] - np.sin(roll) * up
        yaw = np.arctan2(-sideways, forward)
        return np.stack([pitch, roll, yaw, np.broadcast_to(bend[:, None], pitch.shape)], axis=-1)

    def _allowed(self, joints: np.ndarray) -> np.ndarray:
        """Tell which postures (..., 4) are within the limits and have the upper arm hang straight or lean outward."""
        return np.all((joints >= self._lower - _ROUNDING) & (joints <= self._arm.upper[:4] + _ROUNDING), axis=-1)
