"""Where head, arms and cameras are to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dr_eureka.catching.description import SIDES
from dr_eureka.catching.saika import JOINTS

#: Pan and tilt of each camera in the head.
CAMERA_JOINTS = tuple(f"{side}_camera_{axis}" for side in SIDES for axis in ("pan", "tilt"))


@dataclass(frozen=True, eq=False)
class Posture:
    """Goals of the joints (12,) in the order of `catching.saika.JOINTS` and the tilt of both cameras in the head [rad]."""

    joints: np.ndarray
    camera_tilt: float

    def by_name(self) -> dict[str, float]:
        """Return every joint's goal [rad] by name, the cameras' among them."""
        cameras = {name: self.camera_tilt if name.endswith("tilt") else 0.0 for name in CAMERA_JOINTS}
        return {**dict(zip(JOINTS, self.joints.tolist())), **cameras}
