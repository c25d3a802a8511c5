"""Errors of a mechanism, or of its file."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.wording import number_text


class NotAssemblableError(KinematicsError):
    """Four links cannot be joined to a linkage that moves: one is too long for the others."""

    def __init__(self, link: str, length: float, rest: float) -> None:
        """Store the too long ``link``, its ``length`` and the ``rest`` of the links, in [m]."""
        super().__init__(
            f"{link} = {number_text(length, scale=0.0)} m must be shorter than the other three "
            f"links together, which are {number_text(rest, scale=0.0)} m"
        )
        self.link = link
        self.length = length
        self.rest = rest


class CrankLimitError(KinematicsError):
    """A crank angle at which the linkage cannot be closed."""

    def __init__(self, crank_angle: float, ranges: tuple[tuple[float, float], ...]) -> None:
        """Store the ``crank_angle`` and the ``ranges`` that the crank can reach, in [rad]."""
        reach = " or ".join(
            f"from {number_text(low)} to {number_text(high)} rad" for low, high in ranges
        )
        super().__init__(
            f"crank_angle = {number_text(crank_angle)} rad is beyond the crank's limits: it "
            f"reaches {reach}"
        )
        self.crank_angle = crank_angle
        self.ranges = ranges


class SelfMotionError(KinematicsError):
    """The platform can move while all cranks stand still, so that it has no definite positions."""

    def __init__(self, crank_angle: float) -> None:
        """Store the ``crank_angle`` [rad] at which this happens."""
        super().__init__(
            f"crank_angle = {number_text(crank_angle)} rad: the platform can move while the cranks "
            "stand still (self-motion), so it has no finite number of positions"
        )
        self.crank_angle = crank_angle


class DegenerateLinkageError(KinematicsError):
    """Points or lengths of a mechanism leave a part of it undetermined at every crank angle."""

    def __init__(self, reason: str) -> None:
        """Store the ``reason`` in words."""
        super().__init__(reason)
        self.reason = reason


class NotAPoseError(KinematicsError):
    """A pose does not belong to the mechanism at the given crank angle."""

    def __init__(self, crank_angle: float, gap: float) -> None:
        """Store the ``crank_angle`` [rad] and the rod length ``gap`` [m] that is left there."""
        super().__init__(
            f"pose is not a position of this mechanism at crank_angle = "
            f"{number_text(crank_angle)} rad: a rod length is wrong by {number_text(gap, 3)} m"
        )
        self.crank_angle = crank_angle
        self.gap = gap


class MechanismFileError(KinematicsError):
    """A file that should describe a mechanism does not."""

    def __init__(self, path: str, key: str, reason: str) -> None:
        """Store the ``path``, the ``key`` in it that is wrong (or nothing), and the ``reason``."""
        super().__init__(f"{path}: {key}: {reason}" if key else f"{path}: {reason}")
        self.path = path
        self.key = key
        self.reason = reason
