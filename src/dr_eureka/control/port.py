"""What the control engine sees of a robot: joint positions in, joint goals out."""

from __future__ import annotations

from typing import Mapping, Protocol

from dr_eureka.kinematics.arms import arm_joint_names

HEAD_JOINTS = ("head_y", "head_p")


def grip_joint(hand: str) -> str:
    """Name the driven finger joint of one hand."""
    return f"{hand[0]}_arm_grip"


CONTROLLED_JOINTS = (
    *arm_joint_names("left"),
    *arm_joint_names("right"),
    grip_joint("left"),
    grip_joint("right"),
    *HEAD_JOINTS,
    "torso_y",
)


class RobotPort(Protocol):
    """One control cycle's way to a robot, real (ROS topics) or simulated (same process)."""

    def read(self) -> tuple[float, Mapping[str, float]]:
        """Return the time [s] and the present position [rad] of every joint by name."""

    def write(self, goals: Mapping[str, float]) -> None:
        """Send the joint goals [rad] of this cycle."""
