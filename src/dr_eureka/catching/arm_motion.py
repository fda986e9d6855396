"""Moving the arm to a goal that changes while it moves, within limits of speed, acceleration and jerk."""

from __future__ import annotations

import numpy as np
from ruckig import InputParameter, Ruckig, RuckigError, Synchronization, Trajectory

# A goal that differs by less is the same [rad].
_SAME_RAD = 1e-6


class ArmMotion:
    """The quickest motion of each joint, however fast it is now, to rest at a goal (ruckig; Berscheid and Kroeger 2021).

    speed (n,) [rad/s]; acceleration [rad/s^2] and jerk [rad/s^3] hold for each joint.
    """

    def __init__(self, speed: np.ndarray, acceleration: float, jerk: float):
        self._speed, self._count = np.asarray(speed, float), len(speed)
        self._acceleration, self._jerk = [acceleration] * self._count, [jerk] * self._count
        self._ruckig = Ruckig(self._count)
        self._trajectory: Trajectory | None = None
        self._target: tuple[np.ndarray, float] | None = None
        self._travelled_s = 0.0

    def start(self, joints: np.ndarray) -> None:
        """Be at rest at joints (n,) [rad]."""
        joints, zeros = np.array(joints, float), np.zeros(self._count)
        self._plan(joints, zeros, zeros, joints, 1.0)

    @property
    def started(self) -> bool:
        """Whether it is known where the joints are."""
        return self._trajectory is not None

    def step(self, goal: np.ndarray, elapsed_s: float, share: float = 1.0) -> np.ndarray:
        """Return the joints (n,) [rad] after `elapsed_s` more on the way to `goal` (n,), at a share of the largest speed.

        A goal that is not finite changes nothing.
        """
        known, known_share = self._target
        changed = share != known_share or np.abs(np.asarray(goal) - known).max() > _SAME_RAD
        if changed and np.isfinite(goal).all():
            joints, speeds, accelerations = (np.array(values) for values in self._trajectory.at_time(self._travelled_s))
            self._plan(joints, speeds, accelerations, np.array(goal, float), share)
        self._travelled_s += elapsed_s
        return np.array(self._trajectory.at_time(self._travelled_s)[0])

    def _plan(
        self, joints: np.ndarray, speeds: np.ndarray, accelerations: np.ndarray, goal: np.ndarray, share: float
    ) -> None:
        """Plan from a state to rest at a goal; the plan before stays where the library finds none, for rounding."""
        wanted, trajectory = InputParameter(self._count), Trajectory(self._count)
        wanted.synchronization = Synchronization.No
        wanted.current_position, wanted.current_velocity = joints.tolist(), speeds.tolist()
        wanted.current_acceleration = accelerations.tolist()
        wanted.target_position = goal.tolist()
        wanted.max_velocity = (share * self._speed).tolist()
        wanted.max_acceleration, wanted.max_jerk = self._acceleration, self._jerk
        try:
            self._ruckig.calculate(wanted, trajectory)
        except RuckigError:
            if self._trajectory is None:
                raise
            return
        self._trajectory, self._target, self._travelled_s = trajectory, (goal, share), 0.0
