"""One ball followed from view to view: which seen ball it is, where that is, and what its path will be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from dr_eureka.catching.ballistic_fit import BallisticFit
from dr_eureka.catching.falling_fit import FallingFit
from dr_eureka.catching.localisation import LocalisationError, Rig, eye_at, locate_by_parallax, locate_by_size
from dr_eureka.catching.prediction import LEAST_POINTS, BallPoint, CatchingPlane, Prediction, PredictionRefused, Predictor
from dr_eureka.catching.reliability_fit import ReliabilityFit
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings

BALLISTIC, PAPER_THROWN, PAPER_FALLING = "ballistic", "paper_thrown", "paper_falling"
METHODS = (BALLISTIC, PAPER_THROWN, PAPER_FALLING)
#: More balls than one in a view, and no path yet that tells which is meant.
TWO_BALLS = "TWO_BALLS"
#: No seen ball is where the path says.
OFF_PATH = "OFF_PATH"


class TrackRefused(PredictionRefused):
    """A view that adds nothing to the path; `reason` is TWO_BALLS, OFF_PATH or a reason of localisation or prediction."""


@dataclass(frozen=True, eq=False)
class View:
    """What one camera saw at one time [s]: its side, the balls found, and base_from_camera (4, 4) [m] then."""

    time_s: float
    side: str
    balls: tuple[SeenBall, ...]
    base_from_camera: np.ndarray


@dataclass(frozen=True)
class MethodSettings:
    """How the path is found; see config/ball_catcher.yaml."""

    name: str = field(metadata={"choices": METHODS})
    reliability: float = field(metadata={"min": 0.01, "max": 1.0})
    outlier_chance: float = field(metadata={"min": 1e-12, "max": 0.5})
    gate_m: float = field(metadata={"min": 0.0, "max": 5.0})
    pair_s: float = field(metadata={"min": 0.0, "max": 0.2})


def make_predictor(settings: MethodSettings) -> Predictor:
    """Return a predictor without points for the method."""
    makers: dict[str, Callable[[], Predictor]] = {
        BALLISTIC: lambda: BallisticFit(settings.outlier_chance),
        PAPER_THROWN: lambda: ReliabilityFit(settings.reliability),
        PAPER_FALLING: lambda: FallingFit(settings.reliability),
    }
    return makers[settings.name]()


class BallTrack:
    """Turns views into points, and points into a prediction.

    `ballistic` and `paper_thrown` localise by size in every view, each camera's (paper 4.2); `paper_falling` by the parallax
    of two views that were taken within `pair_s` (paper 4.1).
    """

    def __init__(self, settings: MethodSettings, saika: SaikaSettings):
        self._settings, self._saika = settings, saika
        self._predictor = make_predictor(settings)
        self._other: View | None = None
        self._points: list[BallPoint] = []

    @property
    def points(self) -> int:
        """How many points the path rests on."""
        return self._predictor.points

    @property
    def observed(self) -> tuple[BallPoint, ...]:
        """All points that were localised, also those that the path leaves out."""
        return tuple(self._points)

    def add(self, view: View) -> bool:
        """Take a view; return whether it gave a point. Raises TrackRefused with the reason why it could not be used."""
        if not view.balls:
            return False
        try:
            candidates = self._located(view)
            if not candidates:
                return False
            point = self._chosen(candidates)
            self._points.append(point)
            self._predictor.add(point)
        except (LocalisationError, PredictionRefused) as refusal:
            raise TrackRefused(refusal.reason, str(refusal).partition(": ")[2]) from refusal
        return True

    def predict(self, plane: CatchingPlane) -> Prediction:
        """Return where and when the ball crosses the plane. Raises PredictionRefused."""
        return self._predictor.predict(plane)

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the fitted path (n, 3) [m] at times (n,) [s]. Raises PredictionRefused."""
        return self._predictor.positions(times_s)

    def _located(self, view: View) -> list[BallPoint]:
        """Return every ball of the view as a point; by parallax none until the other camera's view has come, too."""
        eye = eye_at(self._saika, view.base_from_camera)
        if self._settings.name != PAPER_FALLING:
            return [
                BallPoint(view.time_s, *locate_by_size(np.array(ball.centre_px), ball.diameter_px, eye), view.side)
                for ball in view.balls
            ]
        other, self._other = self._other, view
        if other is None or other.side == view.side or abs(view.time_s - other.time_s) > self._settings.pair_s:
            return []
        if len(view.balls) > 1 or len(other.balls) > 1:
            raise TrackRefused(TWO_BALLS, "more balls than one in a pair of views; expected one")
        self._other = None
        pair = {seen.side: seen for seen in (view, other)}
        left, right = pair["left"], pair["right"]
        rig = Rig(eye_at(self._saika, left.base_from_camera), eye_at(self._saika, right.base_from_camera))
        pixels = (np.array(seen.balls[0].centre_px) for seen in (left, right))
        return [BallPoint(0.5 * (left.time_s + right.time_s), *locate_by_parallax(*pixels, rig))]

    def _chosen(self, candidates: list[BallPoint]) -> BallPoint:
        """Return the one that lies on the path; before there is a path, the only one."""
        if self._predictor.points < LEAST_POINTS:
            if len(candidates) > 1:
                raise TrackRefused(TWO_BALLS, f"{len(candidates)} balls in one view and no path yet; expected one")
            return candidates[0]
        expected = self._predictor.positions(np.array([candidates[0].time_s]))[0]
        nearest = min(candidates, key=lambda point: float(np.linalg.norm(point.position - expected)))
        off_m = float(np.linalg.norm(nearest.position - expected))
        if len(candidates) > 1 and off_m > self._settings.gate_m:
            gate_m = self._settings.gate_m
            raise TrackRefused(OFF_PATH, f"no ball within {gate_m:g} m of the path; the nearest is {off_m:.2f} m off")
        return nearest
