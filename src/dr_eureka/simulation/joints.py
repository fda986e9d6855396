"""The joints THORMANG3's manager speaks of, and the ones that only the simulated body has."""
from __future__ import annotations

ARM_SUFFIXES = ("sh_p1", "sh_r", "sh_p2", "el_y", "wr_r", "wr_y", "wr_p")
LEG_SUFFIXES = ("hip_y", "hip_r", "hip_p", "kn_p", "an_p", "an_r")

LEG_JOINTS = tuple(f"{side}_leg_{suffix}" for side in "lr" for suffix in LEG_SUFFIXES)
GRIP_JOINTS = ("l_arm_grip", "r_arm_grip")
# A gripper has one motor; the second finger follows mechanically and is unknown to the manager.
GRIP_FOLLOWERS = {joint: joint + "_1" for joint in GRIP_JOINTS}
ARM_JOINTS = tuple(f"{side}_arm_{suffix}" for side in "lr" for suffix in ARM_SUFFIXES)
HEAD_JOINTS = ("head_y", "head_p")
TORSO_JOINT = "torso_y"

SIMULATED_JOINTS = tuple(sorted((*ARM_JOINTS, *GRIP_JOINTS, *HEAD_JOINTS, TORSO_JOINT)))
# The manager publishes its 31 joints in alphabetical order.
ALL_JOINTS = tuple(sorted((*SIMULATED_JOINTS, *LEG_JOINTS)))
