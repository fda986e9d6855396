"""How an arm differs from its drawing, from poses of its hand seen from outside."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from dr_eureka.kinematics.chain import Chain

_POSITIVE = {"min": 1e-9}
# Far below what a camera can tell, and far quicker than scipy's own.
_PRECISION = 1e-5


@dataclass(frozen=True)
class ArmFitSettings:
    """Standard deviations: of a seen hand's place [m] and turn [rad], of a joint's zero [rad] and a link's length [m]."""

    seen_place: float = field(metadata=_POSITIVE)
    seen_turn: float = field(metadata=_POSITIVE)
    joint: float = field(metadata=_POSITIVE)
    link: float = field(metadata=_POSITIVE)


def fit_arm(
    chain: Chain, joints: np.ndarray, root_from_tip: np.ndarray, settings: ArmFitSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets (n,) [rad] and stretches (n,) [m], as `Chain.adjusted` takes them, that explain seen hands best.

    joints (k, n) [rad] as reported, root_from_tip (k, 4, 4) as seen. Maximum a posteriori: what the poses do not tell
    apart stays near the drawing. Source: Hollerbach, Khalil and Gautier, "Model Identification", Springer Handbook of
    Robotics, open-loop case.
    """
    count = len(chain)
    seen_turns = Rotation.from_matrix(root_from_tip[:, :3, :3])

    def misfits(values: np.ndarray) -> np.ndarray:
        found = chain.adjusted(values[:count] * settings.joint, values[count:] * settings.link).forward(joints)
        places = (found[:, :3, 3] - root_from_tip[:, :3, 3]) / settings.seen_place
        turns = (seen_turns.inv() * Rotation.from_matrix(found[:, :3, :3])).as_rotvec() / settings.seen_turn
        return np.concatenate([places.ravel(), turns.ravel(), values])

    values = least_squares(misfits, np.zeros(2 * count), ftol=_PRECISION, xtol=_PRECISION).x
    return values[:count] * settings.joint, values[count:] * settings.link
