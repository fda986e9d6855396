"""A serial chain of revolute joints read from a URDF: forward kinematics and Jacobian."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Iterator, Mapping, Sequence

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.kinematics.transforms import rotation_about, rpy_to_matrix, skew, transform


class ChainError(DrEurekaError):
    """Report a robot description from which the wanted chain cannot be built."""


class Chain:
    """Serial chain from a root link to a tip link; its moving joints are in order from the root.

    Fixed joints are folded into the constant transforms between moving joints. A joint's local transform is
    constant + sin(q) * sine_part + cos(q) * cosine_part (Rodrigues with the joint's origin multiplied in), which makes all
    joints of a batch three array operations.
    """

    def __init__(
        self,
        joint_names: Sequence[str],
        axes: np.ndarray,
        origins: np.ndarray,
        tip: np.ndarray,
        limits: np.ndarray,
        links: Mapping[str, tuple[int, np.ndarray]],
    ) -> None:
        """Precompute the constant parts.

        joint_names: n names. axes: (n, 3) unit, in the joint's frame. origins: (n, 4, 4) from the previous joint's frame
        (root for the first) to the joint's. tip: (4, 4) last joint's frame from tip. limits: (n, 3) lower, upper [rad],
        speed [rad/s]. links: link name -> (number of joints before it, (4, 4) that joint's frame from the link).
        """
        self.joint_names = tuple(joint_names)
        self.lower, self.upper, self.velocity = (np.array(column) for column in np.asarray(limits, dtype=float).T)
        self._axes = np.asarray(axes, dtype=float)
        self._axis_columns = self._axes[:, :, None]
        self._tip = np.asarray(tip, dtype=float)
        self._links = dict(links)
        self._origins, self._limits = np.asarray(origins, dtype=float), np.asarray(limits, dtype=float)
        along = np.zeros((len(self.joint_names), 4, 4))
        sine = np.zeros_like(along)
        cosine = np.zeros_like(along)
        along[:, 3, 3] = 1.0
        for index, axis in enumerate(self._axes):
            along[index, :3, :3] = np.outer(axis, axis)
            sine[index, :3, :3] = skew(axis)
            cosine[index, :3, :3] = np.eye(3) - np.outer(axis, axis)
        self._constant, self._sine, self._cosine = origins @ along, origins @ sine, origins @ cosine
        self._first_origin = np.array(origins[0][:3, 3])

    @classmethod
    def from_urdf(cls, source: str | Path, root: str, tip: str, held: Mapping[str, float] | None = None) -> "Chain":
        """Read the chain from `root` to `tip` out of a URDF file or text.

        held: joints kept at a fixed angle [rad] and so not part of the chain. Raises ChainError for unreadable XML, an
        unknown link, a tip that does not hang from the root, or a joint that is neither fixed, revolute nor continuous.
        """
        held = dict(held or {})
        path = _joints_between(_parse(source), root, tip)
        unknown = sorted(set(held) - {joint.get("name") for joint in path})
        if unknown:
            raise ChainError(f"held joints {unknown} are not between '{root}' and '{tip}'")
        names, axes, origins, limits = [], [], [], []
        links: dict[str, tuple[int, np.ndarray]] = {root: (0, np.eye(4))}
        since_joint = np.eye(4)
        for joint in path:
            name, kind = joint.get("name"), joint.get("type")
            since_joint = since_joint @ _origin(joint)
            if name in held:
                since_joint = since_joint @ transform(rotation_about(_axis(joint), held[name]))
            elif kind in ("revolute", "continuous"):
                names.append(name)
                axes.append(_axis(joint))
                origins.append(since_joint)
                limits.append(_limits(joint))
                since_joint = np.eye(4)
            elif kind != "fixed":
                raise ChainError(f"joint '{name}' is '{kind}', expected fixed, revolute or continuous")
            links[joint.find("child").get("link")] = (len(names), since_joint)
        if not names:
            raise ChainError(f"no moving joint between '{root}' and '{tip}'")
        return cls(names, np.array(axes), np.array(origins), since_joint, np.array(limits), links)

    def __len__(self) -> int:
        return len(self.joint_names)

    def adjusted(self, offsets: np.ndarray, stretches: np.ndarray) -> Chain:
        """Return the chain of an arm that is not quite as drawn.

        offsets (n,) [rad]: a joint that reports q stands at q + offset. stretches (n,) [m]: how much farther each joint
        sits from the one before it (from the root, for the first), in the same direction; where both are in one place,
        there is no such direction and the stretch is left out.
        """
        turns = [transform(rotation_about(axis, angle)) for axis, angle in zip(self._axes, offsets)]
        origins = self._origins @ np.array(turns)
        lengths = np.linalg.norm(self._origins[:, :3, 3], axis=1)
        shares = np.divide(stretches, lengths, out=np.zeros(len(self)), where=lengths > 0.0)
        origins[:, :3, 3] *= 1.0 + shares[:, None]
        return Chain(self.joint_names, self._axes, origins, self._tip, self._limits, self._links)

    @property
    def first_joint_origin(self) -> np.ndarray:
        """Where the first joint sits, (3,) [m] in the root frame; all reach is measured from here."""
        return self._first_origin.copy()

    def clip(self, joints: np.ndarray) -> np.ndarray:
        """Return joints (..., n) [rad] moved into the limits."""
        return np.minimum(np.maximum(joints, self.lower), self.upper)

    def within_limits(self, joints: np.ndarray, tolerance: float = 0.0) -> bool:
        """Tell whether joints (n,) [rad] are all inside the limits, give or take `tolerance` [rad]."""
        return bool(np.all(joints >= self.lower - tolerance) and np.all(joints <= self.upper + tolerance))

    def forward(self, joints: np.ndarray) -> np.ndarray:
        """Return root_from_tip (..., 4, 4) [m] of joints (..., n) [rad]."""
        angles = self._checked(joints)
        if angles.ndim == 1:
            return self._joint_frames(angles)[-1] @ self._tip
        for frames in self._frames_of_batch(angles.reshape(-1, len(self))):
            pass  # only the last one matters here, and keeping the others in memory takes longer than making them
        return _stack(*self._tip_of_batch(*frames)).reshape(angles.shape[:-1] + (4, 4))

    def forward_all(self, joints: np.ndarray) -> dict[str, np.ndarray]:
        """Return root_from_link (4, 4) of every link between root and tip, by name, for joints (n,) [rad]."""
        frames = self._joint_frames(self._checked(joints))
        return {
            name: frames[count - 1] @ offset if count else offset.copy() for name, (count, offset) in self._links.items()
        }

    def jacobian(self, joints: np.ndarray) -> np.ndarray:
        """Return the geometric Jacobian (..., 6, n) of the tip: rows linear [m/rad] then angular, both in the root frame."""
        return self.forward_and_jacobian(joints)[1]

    def forward_and_jacobian(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return root_from_tip (..., 4, 4) and the Jacobian (..., 6, n), at the price of one pass along the chain."""
        angles = self._checked(joints)
        # rotating about an axis leaves it in place, so the frame behind a joint gives its axis as well as the one before it
        if angles.ndim == 1:
            frames = self._joint_frames(angles)
            root_from_tip = frames[-1] @ self._tip
            axes = (frames[:, :3, :3] @ self._axis_columns)[:, :, 0].T
            return root_from_tip, _jacobian(axes, (root_from_tip[:3, 3] - frames[:, :3, 3]).T)
        shape = angles.shape[:-1]
        axes, origins = np.empty((2, 3, len(self), angles.size // len(self)))
        for index, (rotation, origin) in enumerate(self._frames_of_batch(angles.reshape(-1, len(self)))):
            axes[:, index], origins[:, index] = np.einsum("ijn,j->in", rotation, self._axes[index]), origin
        rotation, position = self._tip_of_batch(rotation, origin)
        jacobians = _jacobian(axes, position[:, None] - origins)
        poses = _stack(rotation, position).reshape(shape + (4, 4))
        return poses, jacobians.transpose(2, 0, 1).reshape(shape + (6, len(self)))

    def geometry(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return axes (n, 3) in their joint's frame, previous_joint_from_joint (n, 4, 4) at zero, last_joint_from_tip."""
        return self._axes.copy(), self._origins.copy(), self._tip.copy()

    def local_parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return constant, sine and cosine parts (n, 4, 4) of the local transforms, and last_joint_from_tip (4, 4)."""
        return self._constant.copy(), self._sine.copy(), self._cosine.copy(), self._tip.copy()

    def _checked(self, joints: np.ndarray) -> np.ndarray:
        angles = np.asarray(joints, dtype=float)
        if angles.shape[-1:] != (len(self.joint_names),):
            raise ChainError(f"joints have shape {angles.shape}, expected (..., {len(self.joint_names)})")
        return angles

    def _joint_frames(self, angles: np.ndarray) -> np.ndarray:
        """Return root_from_joint (n, 4, 4) of one posture, each frame turned by its own joint."""
        frames = self._constant + np.sin(angles)[:, None, None] * self._sine + np.cos(angles)[:, None, None] * self._cosine
        for index in range(1, len(frames)):
            np.matmul(frames[index - 1], frames[index].copy(), out=frames[index])
        return frames

    def _frames_of_batch(self, angles: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield rotation (3, 3, batch) and origin (3, batch) of root_from_joint for angles (batch, n), joint by joint.

        The batch is the last axis, where numpy runs along memory: some twenty times faster than products of (batch, 4, 4).
        """
        rotation, origin = np.eye(3)[:, :, None], np.zeros((3, 1))
        for index, (sine, cosine) in enumerate(zip(np.sin(angles.T), np.cos(angles.T))):
            constant, along_sine, along_cosine = (
                part[index, :3, :3, None] for part in (self._constant, self._sine, self._cosine)
            )
            origin = origin + np.einsum("ijn,j->in", rotation, self._constant[index, :3, 3])
            rotation = np.einsum("ijn,jkn->ikn", rotation, constant + along_sine * sine + along_cosine * cosine)
            yield rotation, origin

    def _tip_of_batch(self, rotation: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3, batch) and position (3, batch) of root_from_tip, given those of the last joint."""
        position = origin + np.einsum("ijn,j->in", rotation, self._tip[:3, 3])
        return np.einsum("ijn,jk->ikn", rotation, self._tip[:3, :3]), position


def _jacobian(axes: np.ndarray, levers: np.ndarray) -> np.ndarray:
    """Return the Jacobian (6, n, ...) of joint axes (3, n, ...) and levers (3, n, ...) [m] from joint to tip."""
    jacobian = np.empty((6,) + axes.shape[1:])
    (x, y, z), (u, v, w) = axes, levers
    jacobian[0] = y * w - z * v
    jacobian[1] = z * u - x * w
    jacobian[2] = x * v - y * u
    jacobian[3:] = axes
    return jacobian


def _stack(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Return transforms (batch, 4, 4) of rotations (3, 3, batch) and positions (3, batch)."""
    result = np.zeros((rotation.shape[-1], 4, 4))
    result[:, :3, :3] = rotation.transpose(2, 0, 1)
    result[:, :3, 3] = position.T
    result[:, 3, 3] = 1.0
    return result


def _parse(source: str | Path) -> ElementTree.Element:
    text, where = str(source), "the given text"
    if not text.lstrip().startswith("<"):
        where = text
        try:
            text = Path(source).read_text(encoding="utf-8")
        except OSError as error:
            raise ChainError(f"cannot read robot description {where}: {error.strerror}") from error
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ChainError(f"robot description in {where} is not XML: {error}") from error


def _joints_between(robot: ElementTree.Element, root: str, tip: str) -> list[ElementTree.Element]:
    """Return the joint elements from root to tip, following parents upward from the tip."""
    link_names = {link.get("name") for link in robot.findall("link")}
    for link in (root, tip):
        if link not in link_names:
            raise ChainError(f"robot description has no link '{link}', it has {', '.join(sorted(link_names))}")
    joint_above = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    path: list[ElementTree.Element] = []
    link = tip
    while link != root:
        if link not in joint_above or len(path) > len(joint_above):
            raise ChainError(f"link '{tip}' does not hang from link '{root}'")
        path.append(joint_above[link])
        link = joint_above[link].find("parent").get("link")
    return path[::-1]


def _numbers(element: ElementTree.Element | None, attribute: str, default: str) -> np.ndarray:
    return np.array([float(word) for word in (element.get(attribute, default) if element is not None else default).split()])


def _origin(joint: ElementTree.Element) -> np.ndarray:
    origin = joint.find("origin")
    return transform(rpy_to_matrix(_numbers(origin, "rpy", "0 0 0")), _numbers(origin, "xyz", "0 0 0"))


def _axis(joint: ElementTree.Element) -> np.ndarray:
    axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
    length = np.linalg.norm(axis)
    if length == 0.0:
        raise ChainError(f"joint '{joint.get('name')}' has an axis of length zero")
    return axis / length


def _limits(joint: ElementTree.Element) -> tuple[float, float, float]:
    """Return lower, upper [rad] and speed [rad/s]; a continuous joint is without lower and upper limit."""
    limit = joint.find("limit")
    velocity = float(limit.get("velocity", "inf")) if limit is not None else np.inf
    if joint.get("type") == "continuous":
        return -np.inf, np.inf, velocity
    if limit is None:
        raise ChainError(f"revolute joint '{joint.get('name')}' has no limit element")
    return float(limit.get("lower", "0")), float(limit.get("upper", "0")), velocity
