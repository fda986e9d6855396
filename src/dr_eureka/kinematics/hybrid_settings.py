"""Settings of the hybrid inverse kinematics: our defaults, and the paper's values beside them."""

from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.resources import load_yaml
from dr_eureka.settings import build

PAPER = "config/hybrid_paper.yaml"
_POSITIVE = {"min": 1e-9}
_NOT_NEGATIVE = {"min": 0.0}


@dataclass(frozen=True)
class HybridSettings:
    """Numbers of the hybrid solver; lengths [m], angles [rad], times [s].

    network_distance: farther from the target than this, the network moves the hand. network_step, network_rotation: the
    longest step it is asked for. network_joint_step: a network step that turns a joint more than this is a jump, and
    refused. jacobian_step, jacobian_rotation: the longest step of the damped Jacobian. jacobian_joint_step: the most a joint
    may turn in such a step. damping: of the pseudo-inverse, as lambda in J^T (J J^T + lambda^2 I)^-1. rest_gain: share of
    the way to the rest posture that the self-motion of the arm may take each step. rest_cycles: such steps once the target
    is reached, so that the posture hardly depends on the start. rotation_length: how many metres of distance one radian of
    rotation error is worth when two poses are compared. position_tolerance, orientation_tolerance: when a solve is done.
    max_cycles: per attempt; stall_cycles: cycles without progress that end an attempt. restarts: further attempts from other
    starts. max_seconds: of a whole solve, a safety net far above the usual. reach: farther from the first joint's origin
    than this no pose is tried. limit_slack: how far outside its limits a joint may start (measured joints lie a little
    outside). path_joint_step: the most a joint may turn between neighbouring poses of a path.
    """

    network_distance: float = field(default=0.06, metadata=_POSITIVE)
    network_step: float = field(default=0.15, metadata=_POSITIVE)
    network_rotation: float = field(default=0.4, metadata=_POSITIVE)
    network_joint_step: float = field(default=1.0, metadata=_POSITIVE)
    jacobian_step: float = field(default=0.05, metadata=_POSITIVE)
    jacobian_rotation: float = field(default=0.3, metadata=_POSITIVE)
    jacobian_joint_step: float = field(default=0.3, metadata=_POSITIVE)
    damping: float = field(default=0.01, metadata=_NOT_NEGATIVE)
    rest_gain: float = field(default=0.6, metadata={"min": 0.0, "max": 1.0})
    rest_cycles: int = field(default=5, metadata={"min": 0})
    rotation_length: float = field(default=0.2, metadata=_POSITIVE)
    position_tolerance: float = field(default=0.0002, metadata=_POSITIVE)
    orientation_tolerance: float = field(default=0.002, metadata=_POSITIVE)
    max_cycles: int = field(default=150, metadata={"min": 1})
    stall_cycles: int = field(default=8, metadata={"min": 1})
    restarts: int = field(default=8, metadata={"min": 0})
    max_seconds: float = field(default=5.0, metadata=_POSITIVE)
    reach: float = field(default=0.70, metadata=_POSITIVE)
    limit_slack: float = field(default=0.05, metadata=_NOT_NEGATIVE)
    path_joint_step: float = field(default=0.35, metadata=_POSITIVE)

    @classmethod
    def paper(cls) -> HybridSettings:
        """Return the paper's numbers (section 4.3: 10 cm beyond 12 cm, 0.5 cm nearer), from config/hybrid_paper.yaml."""
        return build(cls, load_yaml(PAPER), PAPER)
