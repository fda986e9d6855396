"""What the engine knows of its own body and of the tubes while it works."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping

import numpy as np

from dr_eureka.control.arm import Arm
from dr_eureka.control.arm_calibration import ArmCalibration
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.collision import CollisionChecker, Hit, Tubes
from dr_eureka.control.motion import Follow
from dr_eureka.control.port import grip_joint
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.pieces import Pieces

# [s] how finely a motion is sampled before it is checked for collisions: at its fastest 10 mm of the hand at most. A motion
# that is asked to take longer than this many samples is slow, and is sampled more coarsely.
_SAMPLE_S, _MOST_SAMPLES = 0.002, 5000


@dataclass(frozen=True)
class Held:
    """A tube in a hand: which one, and how it sits, end_from_tube (4, 4)."""

    tube: str
    end_from_tube: np.ndarray


@dataclass
class Body:
    """Both arms, the tubes standing and held, and the joints as measured and as commanded last."""

    settings: ControlSettings
    pieces: Pieces
    arms: dict[str, Arm]
    collisions: CollisionChecker
    places: dict[str, np.ndarray] = field(default_factory=dict)
    held: dict[str, Held] = field(default_factory=dict)
    joints: Mapping[str, float] = field(default_factory=dict)
    goals: dict[str, float] = field(default_factory=dict)
    pour_ready: tuple[str, str] | None = None
    """(source hand, method) while both tubes are at that pour's ready pose."""
    upright: dict[str, np.ndarray] = field(default_factory=dict)
    """Joint angles (7,) by hand from which the tubes were brought to the ready pose: the way back."""

    @classmethod
    def build(
        cls,
        settings: ControlSettings,
        pieces: Pieces,
        network: ArmNetwork | None,
        calibrations: Mapping[str, ArmCalibration],
    ) -> Body:
        """Make the body with its two arms; one without a calibration is as drawn."""
        arms = {hand: Arm(hand, settings.kinematics, network, calibrations.get(hand)) for hand in HANDS}
        return cls(settings, pieces, arms, CollisionChecker(settings.collision, pieces, arms))

    def commanded(self, hand: str) -> np.ndarray:
        """Return the arm's joint angles (7,) as last commanded: where the next trajectory must start."""
        return self.arms[hand].positions(self.goals)

    def hit(self, motion: Follow) -> Hit | None:
        """Return where a motion that begins now would bring two bodies too near to one another, or None."""
        samples = min(max(2, int(np.ceil(motion.duration / _SAMPLE_S)) + 1), _MOST_SAMPLES)
        times = np.linspace(0.0, motion.duration, samples)
        # Fingers that a tube stops are where they are measured, not where they are sent.
        grips = {grip_joint(hand): self.joints[grip_joint(hand)] for hand in HANDS}
        tubes = Tubes(self.places, {hand: (held.tube, held.end_from_tube) for hand, held in self.held.items()})
        return self.collisions.first_hit({**self.goals, **grips}, times, motion.sampled(times), tubes, motion.may_touch)

    def place_of(self, tube: str) -> np.ndarray:
        """Return where a tube stands, foot (3,) [m] in base; raise ControlError if it is not known to stand anywhere."""
        if tube not in self.places:
            problem = f"tube {tube!r} is not known to stand on the sheet; standing: {sorted(self.places)}"
            raise ControlError(EngineCode.INVALID_ACTION, problem)
        return self.places[tube]

    def held_poses(self) -> dict[str, np.ndarray]:
        """Return base_from_tube (4, 4) of each tube in a hand, by name, as the measured joints have it."""
        return {held.tube: self.arms[hand].pose(self.joints) @ held.end_from_tube for hand, held in self.held.items()}

    def held_in(self, hand: str, tube: str) -> Held:
        """Return the tube held in a hand; raise ControlError if that hand holds another or none."""
        held = self.held.get(hand)
        if held is None or held.tube != tube:
            holds = held.tube if held else "nothing"
            raise ControlError(EngineCode.INVALID_ACTION, f"{hand} hand should hold tube {tube!r} but holds {holds}")
        return held

    def check_grip(self, hand: str, code: str, moment: str) -> None:
        """Raise ControlError with `code` unless the finger angle says that a tube is between the fingers."""
        low, high = self.settings.grip.on_tube
        angle = self.joints[grip_joint(hand)]
        if not low <= angle <= high:
            expected = f"expected {low:.3f} to {high:.3f} with a tube between them"
            raise ControlError(code, f"{hand} hand {moment}: fingers at {angle:.3f} rad, {expected}")
