"""Turns messages into plain numbers, or refuses them with a reason."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from time import monotonic
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, PoseStamped
from geometry_msgs.msg import Vector3 as GeometryVector
from rclpy.clock import Clock
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message

from tri_glide_kinematics.checks import normal, zero_if_tiny
from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, Refusal
from tri_glide_kinematics.ros.cdr import PLAIN, STAMP_END, STAMP_OFFSET, aligned, byte_order
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text, vector_text

# Largest part of a unit quaternion that may differ from the identity.
ROTATION_TOLERANCE = 1e-6

# A quaternion whose norm differs from 1 by more than this is none of a rotation.
UNIT_TOLERANCE = 1e-3

# A stamp may be ahead of the clock by this: clocks of one computer, or well synchronised ones [s].
LARGEST_LEAD = 0.01


# Two clocks are read at one time if that takes no longer [s]; so often is that tried.
AT_ONCE, TRIES = 5e-5, 10


# Outputs of programs and paths: who begins to listen later is told the latest ones.
LATEST_OUTPUTS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class RefusedMessageError(KinematicsError):
    """A message asks for something that this machine cannot do, or contradicts itself."""

    def __init__(self, text: str, refusal: Refusal = Refusal.MESSAGE) -> None:
        """Store why, in words and for programs."""
        super().__init__(text)
        self.refusal = refusal


def decoded(data: bytes, kind: Any) -> Any:
    """Return the message of some ``kind`` that bytes are.

    Raises:
        RefusedMessageError: if they are none, whatever they are.
    """
    try:
        return deserialize_message(data, kind)
    except Exception as error:
        # The error of rclpy depends on the bytes; the sender has made it.
        raise RefusedMessageError(
            f"{len(data)} bytes are no {kind.__name__}: {type(error).__name__}"
        ) from error


class StampedNumbers(NamedTuple):
    """What a message says that is a header and then nothing but numbers.

    Attributes:
        stamp: of the header.
        frame: of the header.
        numbers: all of them, in the order of the message.
    """

    stamp: Time
    frame: str
    numbers: tuple[float, ...]


def told_pose(data: bytes) -> StampedNumbers:
    """Return the position and the orientation in the bytes of a PoseStamped.

    Raises:
        RefusedMessageError: if they are none.
    """
    return _stamped_numbers(data, "pose", 7)


def told_twist(data: bytes) -> StampedNumbers:
    """Return the linear and the angular velocity in the bytes of a TwistStamped.

    Raises:
        RefusedMessageError: if they are none.
    """
    return _stamped_numbers(data, "twist", 6)


def told_state(data: bytes) -> StampedNumbers:
    """Return pose, its covariance, twist and its covariance in the bytes of an Odometry.

    Raises:
        RefusedMessageError: if they are none.
    """
    return _stamped_numbers(data, "state", 7 + 36 + 6 + 36, texts=2)


def _stamped_numbers(data: bytes, what: str, count: int, texts: int = 1) -> StampedNumbers:
    """Return ``count`` numbers behind a stamp and ``texts``, of which the first is the frame.

    rclpy makes each part of a message in Python, which takes 0.1 to 0.2 ms in a cycle.
    """
    frame, end = b"", STAMP_END
    try:
        if data[:2] not in PLAIN:
            raise struct.error
        order = byte_order(data)
        sec, nanosec = struct.unpack_from(f"{order}iI", data, STAMP_OFFSET)
        for index in range(texts):
            end = aligned(end, 4)
            (length,) = struct.unpack_from(f"{order}I", data, end)
            frame = frame if index else data[end + 4 : end + 3 + length]
            end += 4 + length
        numbers = struct.unpack_from(f"{order}{count}d", data, aligned(end, 8))
    except struct.error:
        raise RefusedMessageError(f"{len(data)} bytes are no {what}") from None
    return StampedNumbers(Time(sec=sec, nanosec=nanosec), frame.decode(errors="replace"), numbers)


def pose_numbers(message: PoseStamped) -> StampedNumbers:
    """Return the position and the orientation of a ``message``."""
    turned = message.pose.orientation
    numbers = *vector_of(message.pose.position), turned.x, turned.y, turned.z, turned.w
    return StampedNumbers(message.header.stamp, message.header.frame_id, numbers)


def vector_of(point: Point | GeometryVector) -> Vector3:
    """Return the three numbers of a ``point``, as they are."""
    return point.x, point.y, point.z


def target_position(told: StampedNumbers, base_frame: str) -> Vector3:
    """Return the position that a pose asks for.

    Raises:
        RefusedMessageError: if the frame is neither empty nor ``base_frame``, or the orientation
            is not the identity.
        NotFiniteError: if a number is NaN or infinite.
        OutOfBoundsError: if a number is not zero, but nearer to it than a float can be in full.
    """
    check_frame("target pose", told.frame, (base_frame,))
    position = _position("target pose position", told.numbers[:3])
    _check_no_rotation(told.numbers[3:])
    return position


def target_velocity(told: StampedNumbers, base_frame: str, platform_frame: str) -> Vector3:
    """Return the platform velocity that a twist asks for.

    The platform never rotates: all its points move alike, and its frame has the axes of the base
    frame. So the twist may be given in either frame.

    Raises:
        RefusedMessageError: if the frame is neither empty nor one of the two, or the angular
            velocity is not zero.
        NotFiniteError: if a number is NaN or infinite.
    """
    check_frame("target twist", told.frame, (base_frame, platform_frame))
    velocity = _velocity("target twist linear", told.numbers[:3])
    rotation = _velocity("target twist angular", told.numbers[3:])
    if any(rotation):
        raise RefusedMessageError(
            f"target twist has the angular velocity {vector_text(rotation, scale=0.0)} rad/s: the "
            "platform cannot rotate, it must be 0",
            Refusal.ROTATION,
        )
    return velocity


def moving_target(told: StampedNumbers, base_frame: str) -> tuple[Vector3, Vector3]:
    """Return position and velocity of a moving target in the base frame.

    Its twist is in the child frame, that of the target, as Odometry defines it: where the target is
    turned, so is its velocity. The platform itself follows the position and never turns.

    Raises:
        RefusedMessageError: if the frame of the header is neither empty nor ``base_frame``, or the
            orientation is no unit quaternion.
        NotFiniteError: if a number is NaN or infinite.
        OutOfBoundsError: if a position is not zero, but nearer to it than a float can be in full.
    """
    what = "target state"
    check_frame(what, told.frame, (base_frame,))
    position = _position(f"{what} position", told.numbers[:3])
    vx, vy, vz = _velocity(f"{what} linear velocity", told.numbers[43:46])
    x, y, z, w = told.numbers[3:7]
    norm = math.hypot(x, y, z, w)
    if not abs(norm - 1.0) <= UNIT_TOLERANCE:
        raise RefusedMessageError(
            f"{what} has an orientation of norm {number_text(norm)}, it must be 1"
        )
    # v + 2 q x (q x v + w v), with q the first three parts.
    ux, uy, uz = y * vz - z * vy + w * vx, z * vx - x * vz + w * vy, x * vy - y * vx + w * vz
    return position, (
        vx + 2.0 * (y * uz - z * uy),
        vy + 2.0 * (z * ux - x * uz),
        vz + 2.0 * (x * uy - y * ux),
    )


def age_of_target(stamp: Time, clock: Clock, timeout: float, what: str = "target state") -> float:
    """Return how long ago a moving target was where its state says [s].

    A state that is older than ``timeout`` [s] is of no use.

    Raises:
        RefusedMessageError: if there is no stamp, or one of another clock.
    """
    if not has_stamp(stamp):
        raise RefusedMessageError(
            f"{what} has no stamp: it must say when the target was there", Refusal.STAMP
        )
    age = age_of(stamp, clock)
    if not -LARGEST_LEAD <= age <= timeout:
        relation, limit = ("behind", timeout) if age > 0.0 else ("ahead of", LARGEST_LEAD)
        raise RefusedMessageError(
            f"{what} has a stamp {number_text(abs(age))} s {relation} the clock of this "
            f"node, it must be at most {number_text(limit)} s: are the clocks set alike?",
            Refusal.STAMP,
        )
    return age


def has_stamp(stamp: Time) -> bool:
    """Return whether a message says when it was made."""
    return bool(stamp.sec or stamp.nanosec)


def age_of(stamp: Time, clock: Clock) -> float:
    """Return how long ago a ``stamp`` was, by a ``clock`` [s]."""
    return 1e-9 * (clock.now().nanoseconds - (1_000_000_000 * stamp.sec + stamp.nanosec))


def ahead_of_steady(clock: Clock) -> float:
    """Return by how much a ``clock`` is ahead of time.monotonic() [s].

    A computer that is busy may let this process wait between two clocks: then they are read again.
    """
    for _ in range(TRIES):
        before = monotonic()
        nanoseconds = clock.now().nanoseconds
        after = monotonic()
        if after - before < AT_ONCE:
            break
    return 1e-9 * nanoseconds - 0.5 * (before + after)


def steady_time(stamp: Time, ahead: float) -> float:
    """Return the time.monotonic() of a ``stamp`` of a clock that is so far ``ahead`` of it [s]."""
    return stamp.sec - ahead + 1e-9 * stamp.nanosec


def check_frame(what: str, frame: str, allowed: Sequence[str]) -> None:
    """Check the ``frame`` of a message; ``what`` names that in words. An empty frame is any.

    Raises:
        RefusedMessageError: if it is none of those ``allowed``.
    """
    if frame and frame not in allowed:
        names = " or ".join(repr(name) for name in allowed)
        text = f"{what} has frame_id {frame!r}, it must be {names} or empty"
        raise RefusedMessageError(text, Refusal.WRONG_FRAME)


def set_stamp(stamp: Time, clock: Clock) -> None:
    """Write the present time of ``clock`` into ``stamp``."""
    stamp.sec, stamp.nanosec = divmod(clock.now().nanoseconds, 1_000_000_000)


def _position(name: str, numbers: Sequence[float]) -> Vector3:
    x, y, z = _finite_vector(name, numbers)
    for axis, value in zip("xyz", (x, y, z)):
        normal(f"{name}.{axis}", value, "m")
    return x, y, z


def _velocity(name: str, numbers: Sequence[float]) -> Vector3:
    x, y, z = map(zero_if_tiny, _finite_vector(name, numbers))
    return x, y, z


def _finite_vector(name: str, numbers: Sequence[float]) -> Sequence[float]:
    for axis, value in zip("xyz", numbers):
        if not math.isfinite(value):
            raise NotFiniteError(f"{name}.{axis}", value)
    return numbers


def _check_no_rotation(orientation: Sequence[float]) -> None:
    x, y, z, w = orientation
    # q and -q are the same orientation; written so that NaN fails too.
    if not all(abs(part) <= ROTATION_TOLERANCE for part in (x, y, z, abs(w) - 1.0)):
        parts = ", ".join(f"{name} {number_text(part)}" for name, part in zip("xyzw", (x, y, z, w)))
        raise RefusedMessageError(
            f"target pose has the orientation ({parts}): the "
            f"platform cannot rotate, it must be (0, 0, 0, 1) within {ROTATION_TOLERANCE:g}",
            Refusal.ROTATION,
        )
