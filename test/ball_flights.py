"""Balls in flight for the tests of catching: exact places, and points as two cameras would see them."""

import numpy as np

from dr_eureka.catching.prediction import GRAVITY_M_S2, BallPoint

EYES = {"left": np.array([-0.06, 0.09, 0.187]), "right": np.array([0.06, 0.09, 0.187])}
FOCAL_PX, BALL_M = 820.0, 0.070


class Flight:
    """A ball thrown at time 0 s from `start` (3,) [m] with `velocity` (3,) [m/s]."""

    def __init__(self, start=(0.1, 2.0, 0.1), velocity=(-0.4, -2.8, 2.2)):
        self.start, self.velocity = np.array(start, float), np.array(velocity, float)

    def at(self, times_s):
        """Return places (..., 3) [m]."""
        t = np.asarray(times_s, float)[..., None]
        return self.start + self.velocity * t + 0.5 * np.array([0.0, 0.0, -GRAVITY_M_S2]) * t**2

    def crossing_s(self, plane):
        """Return when the ball crosses a plane, a height from above [s]."""
        gap, speed = plane.offset_m - self.start[plane.axis], self.velocity[plane.axis]
        if plane.kind == "depth":
            return gap / speed
        return max(np.roots([-0.5 * GRAVITY_M_S2, speed, -gap]).real)


def points_of(flight, times_s, sigma_m=0.0, rng=None):
    """Return points with errors alike in all directions."""
    errors = np.zeros((len(times_s), 3)) if rng is None else rng.normal(0.0, sigma_m, (len(times_s), 3))
    spread = max(sigma_m, 1e-4) ** 2 * np.eye(3)
    return [BallPoint(float(t), place, spread) for t, place in zip(times_s, flight.at(times_s) + errors)]


def seen_by_eyes(flight, times_s, rng, centre_px=0.1, diameter_px=0.2):
    """Return points as eyes in turn see them: exact across the ray but for `centre_px`, unsure of depth by the size."""
    points = []
    for index, t in enumerate(times_s):
        side = ("left", "right")[index % 2]
        ray = flight.at(t) - EYES[side]
        distance = np.linalg.norm(ray)
        ray /= distance
        size_px = FOCAL_PX * BALL_M / distance + rng.normal(0.0, diameter_px)
        seen_m = FOCAL_PX * BALL_M / size_px
        across = np.linalg.svd(ray[None])[2][1:]
        direction = ray + across.T @ rng.normal(0.0, centre_px / FOCAL_PX, 2)
        across_m, along_m = seen_m * centre_px / FOCAL_PX, seen_m**2 * diameter_px / (FOCAL_PX * BALL_M)
        outer = np.outer(direction, direction) / (direction @ direction)
        spread = along_m**2 * outer + across_m**2 * (np.eye(3) - outer)
        points.append(BallPoint(float(t), EYES[side] + seen_m * direction / np.linalg.norm(direction), spread, side))
    return points
