"""Thrown balls and what both cameras see of them, without physics: points for predictions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dr_eureka.catching.ball_track import BallTrack, MethodSettings, View
from dr_eureka.catching.catcher_settings import THROWN, CatcherSettings
from dr_eureka.catching.prediction import CatchingPlane, PredictionRefused
from dr_eureka.catching.saika import SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.bodies import GRAVITY
from dr_eureka.simulation.saika_cameras import AnalyticCamera
from dr_eureka.simulation.saika_settings import SaikaWorldSettings
from dr_eureka.simulation.throws import REACH, Throw, draw_throw, load_throws

_BLIND_S = 0.02


@dataclass(frozen=True, eq=False)
class Flight:
    """One thrown ball, its stamped views of both cameras, and where and when it truly comes down [m, s]."""

    throw: Throw
    views: tuple[View, ...]
    place: np.ndarray
    time_s: float

    def at(self, times_s: np.ndarray) -> np.ndarray:
        """Return the true places (n, 3) [m]."""
        t = np.asarray(times_s, float)[:, None]
        return self.throw.position + self.throw.velocity * t - 0.5 * np.array([0.0, 0.0, GRAVITY]) * t**2


@dataclass(frozen=True)
class Step:
    """One prediction: on how many points, how far off the place [m] and the time [s], and the place's stated sigma [m]."""

    points: int
    place_m: float
    time_s: float
    sigma_m: float


def draw_flight(saika: SaikaSettings, settings: CatcherSettings, seed: int, index: int) -> Flight:
    """Draw a thrown ball and what both cameras, which look as they do while waiting, see of it."""
    rng = np.random.default_rng([seed, 3, index])
    throw = draw_throw(load_throws()[THROWN], REACH, rng)
    flight_s = float(max(np.roots([-0.5 * GRAVITY, throw.velocity[2], throw.position[2] - throw.aim[2]]).real))
    flight = Flight(throw, (), throw.aim, flight_s)
    camera = AnalyticCamera(saika, SaikaWorldSettings.load().sensor, rng)
    gaze = settings.stances[THROWN].gaze
    tilt, neck = np.radians(gaze.camera_tilt_deg), np.radians((gaze.neck_pan_deg, gaze.neck_tilt_deg))
    head, first_s = SaikaHead(saika), float(rng.uniform(0.0, saika.cameras.period_s))
    views = []
    for side, lag_s in (("left", 0.0), ("right", saika.cameras.lag_s)):
        pose = head.base_from_camera(side, (0.0, tilt), neck)
        times = np.arange((first_s + lag_s) % saika.cameras.period_s, flight_s - _BLIND_S, saika.cameras.period_s)
        views += [View(float(t), side, camera.balls(pose, [place]), pose) for t, place in zip(times, flight.at(times))]
    return replace(flight, views=tuple(sorted(views, key=lambda view: view.time_s)))


def follow(flight: Flight, method: MethodSettings, saika: SaikaSettings, plane: CatchingPlane) -> list[Step]:
    """Return what is predicted after each view that gives a prediction."""
    track, steps = BallTrack(method, saika), []
    for view in flight.views:
        try:
            if not track.add(view):
                continue
            prediction = track.predict(plane)
        except PredictionRefused:
            continue
        off_m = float(np.linalg.norm(prediction.position - flight.place))
        steps.append(Step(prediction.points, off_m, abs(prediction.time_s - flight.time_s), prediction.sigma_m))
    return steps
