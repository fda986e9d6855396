"""Kinematics of the two arms: chain from the URDF, Jacobian, the learned step, and the hybrid of both."""
