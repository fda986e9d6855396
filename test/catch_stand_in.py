"""A world without physics for the tests of the catcher: a ball on a known path, exact cameras, joints at limited speed."""

import numpy as np
from ball_flights import Flight

from dr_eureka.catching.arm_network import SaikaNetwork
from dr_eureka.catching.ball_track import View
from dr_eureka.catching.catch_report import CatchPhase
from dr_eureka.catching.catcher import Catcher
from dr_eureka.catching.catcher_settings import CatcherSettings
from dr_eureka.catching.localisation import camera_model
from dr_eureka.catching.prediction import GRAVITY_M_S2
from dr_eureka.catching.saika import LEFT_ARM, NECK, SaikaArm, SaikaHead
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.kinematics.transforms import invert

SAIKA, SETTINGS = SaikaSettings.load(), CatcherSettings.load()
ARM, HEAD, NETWORK = SaikaArm(SAIKA), SaikaHead(SAIKA), SaikaNetwork.load(SAIKA)
CAMERA = camera_model(SAIKA.cameras)
CYCLE_S = 0.008
RELEASE_S = 0.1


def thrown_to(place, flight_s=0.7, start=(0.1, 2.0, 0.1)):
    """Return the flight from `start` that comes to `place` (3,) [m] after so many seconds."""
    start = np.array(start, float)
    fall = 0.5 * np.array([0.0, 0.0, -GRAVITY_M_S2]) * flight_s**2
    return Flight(start, (np.array(place, float) - start - fall) / flight_s)


def seen_ball(place, base_from_camera):
    """Return the ball at (3,) [m] in base as a camera sees it, None when it is out of the picture."""
    x, y, depth = (invert(base_from_camera) @ [*place, 1.0])[:3]
    if depth < 0.1:
        return None
    column, row = CAMERA.project(np.array([x, y, depth]))
    if not (0 <= column < CAMERA.width and 0 <= row < CAMERA.height):
        return None
    return SeenBall((float(column), float(row)), SAIKA.ball_diameter_m * SAIKA.cameras.focal_px / depth, 1.0)


class StandIn:
    """Lets a catcher live; `places(elapsed_s)` are the balls' places since the release, `alter(view)` spoils views."""

    def __init__(
        self, ball="thrown", feedback=True, method="ballistic", alter=lambda view: view, arm_speed_share=1.0, latency_s=0.0
    ):
        self.catcher = Catcher(SETTINGS.with_method(method), SAIKA, NETWORK, ball, feedback)
        self.joints = self.catcher.waiting.joints.copy()
        self.tilt = self.catcher.waiting.camera_tilt
        self.now_s, self.alter = 0.0, alter
        self.goals, self.latency_s, self.late = [], latency_s, []
        self.speeds = np.array([3.0, 3.0, *[4.0 * arm_speed_share] * 10])

    def run(self, places, in_basket=False, limit_s=6.0):
        """Let the balls fly until the catcher has reported one more; return its report, None when it never does."""
        known = len(self.catcher.reports)
        released_s = self.now_s + RELEASE_S
        number = 0
        while self.now_s < released_s + limit_s and len(self.catcher.reports) == known:
            self.now_s += CYCLE_S
            elapsed_s = self.now_s - released_s
            # 60 views a second, the cameras in turn
            if int(self.now_s * 60.0) > number:
                number = int(self.now_s * 60.0)
                side = ("left", "right")[number % 2]
                present = [] if elapsed_s < 0.0 else list(places(elapsed_s))
                if in_basket and self.catcher.phase == CatchPhase.JUDGING:
                    present = [self.basket - [0.0, 0.0, 0.05]]
                self.late.append(self.view(side, present))
            while self.late and not self.late[0].time_s > self.now_s - self.latency_s:
                self.catcher.see(self.late.pop(0))
            self.advance()
        return self.catcher.reports[-1] if len(self.catcher.reports) > known else None

    @property
    def basket(self):
        """Where the basket is (3,) [m]."""
        return ARM.basket_centre(self.joints[LEFT_ARM])

    def view(self, side, places):
        """Return what a camera sees of balls at these places, altered."""
        pose = HEAD.base_from_camera(side, (0.0, self.tilt), self.joints[NECK])
        balls = tuple(ball for ball in (seen_ball(place, pose) for place in places) if ball)
        return self.alter(View(self.now_s, side, balls, pose))

    def advance(self):
        """Have the catcher decide, and the joints follow."""
        posture = self.catcher.step(self.now_s, self.joints)
        self.goals.append(posture.joints[LEFT_ARM].copy())
        reach = self.speeds * CYCLE_S
        self.joints = np.clip(posture.joints, self.joints - reach, self.joints + reach)
        self.tilt = posture.camera_tilt
