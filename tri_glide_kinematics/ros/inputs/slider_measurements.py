"""Reads the sliders from the bytes of JointState messages.

To make a message of bytes, rclpy makes each of its parts, and their parts, in Python. That takes
longer than all that is done with a measurement. Messages of one publisher differ in their numbers
only: so it is looked up once where these stand.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from struct import Struct
from typing import NamedTuple

from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from tri_glide_kinematics.checks import zero_if_tiny
from tri_glide_kinematics.ros.cdr import (
    KIND,
    MARKS,
    PLAIN,
    STAMP_END,
    STAMP_OFFSET,
    aligned,
    byte_order,
    offset_of,
)
from tri_glide_kinematics.ros.messages import RefusedMessageError, decoded
from tri_glide_kinematics.vectors import Vector3

# More kinds of messages than these are all read part by part.
MOST_LAYOUTS = 8


class StampedReading(NamedTuple):
    """The slider data of a JointState, with their time; heights may still be NaN.

    Attributes:
        heights: true ones. Shape (3,) [m].
        velocities: Shape (3,) [m/s], or None if they are not given.
        seconds: of the stamp.
        nanoseconds: of the stamp, beyond the seconds.
    """

    heights: Vector3
    velocities: Vector3 | None
    seconds: int
    nanoseconds: int

    @property
    def stamp(self) -> float:
        """Stamp as one number [s]."""
        return self.seconds + 1e-9 * self.nanoseconds


@dataclass(frozen=True)
class _Layout:
    """The offsets of the numbers in all messages of some length that begin alike.

    Attributes:
        kind: of the encoding.
        mask: which bits between stamp and positions have a meaning; the others fill up words, and
            hold whatever was in the memory.
        head: these bits: frame, names, number of positions.
        positions: offset of the first one.
        velocity_count: what follows the positions.
        velocities: offset of the first one, None if there are none.
        stamp: as it is packed.
        numbers: positions, or velocities, as they are packed.
        indices: places of the sliders among the joints, None if they are not there.
        offsets: true heights minus those in the messages. Shape (3,) [m].
    """

    kind: bytes
    mask: int
    head: int
    positions: int
    velocity_count: bytes
    velocities: int | None
    stamp: Struct
    numbers: Struct
    indices: tuple[int, int, int] | None
    offsets: Vector3

    def fits(self, data: bytes) -> bool:
        """Tell whether a message of the right length has this layout."""
        end = self.positions + self.numbers.size
        return (
            _as_number(data[STAMP_END : self.positions]) & self.mask == self.head
            and data[end : end + 4] == self.velocity_count
            and data[KIND] == self.kind
        )

    def reading(self, data: bytes) -> StampedReading | None:
        """Return what a message that fits says."""
        if self.indices is None:
            return None
        position = self.numbers.unpack_from(data, self.positions)
        velocity = None
        if self.velocities is not None:
            velocity = self.numbers.unpack_from(data, self.velocities)
        stamp = self.stamp.unpack_from(data, STAMP_OFFSET)
        return _reading(self.indices, position, velocity, self.offsets, stamp)


class SliderMeasurements:
    """Finds the sliders in serialized JointState messages, as ``reading_of`` does in others.

    Here, and nowhere else, heights that are reported become true ones.
    """

    def __init__(self, joint_names: Sequence[str], offsets: Vector3 = (0.0, 0.0, 0.0)) -> None:
        """Look for three names; ``offsets`` [m] are added to the heights in messages."""
        self._offsets = offsets
        self._names = tuple(joint_names)
        self._layouts: dict[int, _Layout] = {}

    def read(self, data: bytes) -> StampedReading | None:
        """Return the state of the sliders, or None if the message is about other joints only.

        Raises:
            RefusedMessageError: if the bytes are no such message, or lack a slider or a number.
        """
        layout = self._layouts.get(len(data))
        if layout is not None and layout.fits(data):
            return layout.reading(data)
        _check_sizes(data)
        message = decoded(data, JointState)
        reading = reading_of(message, self._names, self._offsets)
        layout = self._layout_of(message, data, reading is not None)
        if layout is not None and (len(data) in self._layouts or len(self._layouts) < MOST_LAYOUTS):
            self._layouts[len(data)] = layout
        return reading

    def _layout_of(self, message: JointState, data: bytes, has_sliders: bool) -> _Layout | None:
        """Return the layout of a message that could be read, None if that is not found out."""
        count, velocity_count = len(message.position), len(message.velocity)
        if not count or count + velocity_count > len(MARKS) or velocity_count not in (0, count):
            return None
        marks, more_marks = MARKS[:count], MARKS[count : count + velocity_count]
        position, velocity = message.position, message.velocity
        message.position, message.velocity = array("d", marks), array("d", more_marks)
        marked = serialize_message(message)
        order = byte_order(data)
        numbers = Struct(f"{order}{count}d")
        positions = offset_of(marked, marks)
        velocities = offset_of(marked, more_marks) if velocity_count else None
        end = positions + numbers.size
        mask = _head_mask(message)
        # The sender may have another byte order than this computer.
        if (
            marked[KIND] != data[KIND]
            or len(mask) != positions - STAMP_END
            or data[positions:end] != numbers.pack(*position)
            or (
                velocities
                and data[velocities : velocities + numbers.size] != numbers.pack(*velocity)
            )
        ):
            return None
        indices = tuple(map(message.name.index, self._names)) if has_sliders else None
        return _Layout(
            kind=data[KIND],
            mask=_as_number(mask),
            head=_as_number(data[STAMP_END:positions]) & _as_number(mask),
            positions=positions,
            velocity_count=data[end : end + 4],
            velocities=velocities,
            stamp=Struct(f"{order}iI"),
            numbers=numbers,
            indices=indices,
            offsets=self._offsets,
        )


def reading_of(
    message: JointState, joint_names: Sequence[str], offsets: Vector3 = (0.0, 0.0, 0.0)
) -> StampedReading | None:
    """Return the state of three sliders, in any order, beside any other joints.

    Velocities of which one is NaN count as not given: a broadcaster fills in NaN for what the
    hardware does not measure. The ``offsets`` are added to the heights [m].

    Returns:
        None if the message is about other joints only.

    Raises:
        RefusedMessageError: if all names, a slider or a number is missing.
    """
    names = message.name
    if message.position and not names:
        raise RefusedMessageError(
            f"joint state has {len(message.position)} positions, but no names"
        )
    missing = [name for name in joint_names if name not in names]
    if len(missing) == len(joint_names):
        return None
    if missing:
        raise RefusedMessageError(f"joint state lacks {', '.join(missing)}")
    for name in joint_names:
        if names.count(name) > 1:
            raise RefusedMessageError(f"joint state names {name} {names.count(name)} times")
    count, position, velocity = len(names), message.position, message.velocity
    if len(position) != count:
        raise RefusedMessageError(f"joint state has {count} names, but {len(position)} positions")
    if len(velocity) not in (0, count):
        raise RefusedMessageError(f"joint state has {count} names, but {len(velocity)} velocities")
    i, j, k = map(names.index, joint_names)
    stamp = message.header.stamp
    return _reading((i, j, k), position, velocity, offsets, (stamp.sec, stamp.nanosec))


def _reading(
    indices: tuple[int, int, int],
    position: Sequence[float],
    velocity: Sequence[float] | None,
    offsets: Vector3,
    stamp: Sequence[int],
) -> StampedReading:
    """Return the numbers of the joints with these ``indices``."""
    i, j, k = indices
    first, second, third = offsets
    # A filter of the sender that fades out goes through numbers that are nearly zero.
    x, y, z = map(zero_if_tiny, (position[i], position[j], position[k]))
    heights = (x + first, y + second, z + third)
    velocities = None
    if velocity and not any(map(math.isnan, found := (velocity[i], velocity[j], velocity[k]))):
        vx, vy, vz = map(zero_if_tiny, found)
        velocities = (vx, vy, vz)
    return StampedReading(heights, velocities, *stamp)


def _check_sizes(data: bytes) -> None:
    """Check that all texts and sequences of a JointState end inside its bytes.

    rclpy finds that out, too, but tells it in lines on the standard error that nothing bounds, and
    first makes as many texts as a sequence says that it has, which takes seconds and gigabytes.

    Raises:
        RefusedMessageError: if one does not, or the encoding is none of those of ROS.
    """
    if data[:2] not in PLAIN:
        raise RefusedMessageError(
            f"joint state is in the encoding {data[:2].hex()}: ROS writes 0000 or 0001"
        )
    size = Struct(f"{byte_order(data)}I")
    end = STAMP_END

    def skip(width: int) -> int:
        """Skip a text, or a sequence of numbers ``width`` bytes wide; return how many it has."""
        nonlocal end
        end = aligned(end, 4)
        if end + 4 > len(data):
            raise RefusedMessageError(f"joint state of {len(data)} bytes ends too early")
        (count,) = size.unpack_from(data, end)
        end += 4
        if count and width:
            end = aligned(end, width) + width * count
        if end > len(data):
            raise RefusedMessageError(
                f"joint state of {len(data)} bytes ends before {count} numbers or characters"
            )
        return int(count)

    skip(1)
    for _ in range(skip(0)):
        skip(1)
    for _ in ("positions", "velocities", "efforts"):
        skip(8)


def _head_mask(message: JointState) -> bytes:
    """Return ones for all bytes between stamp and positions that have a meaning.

    A text is its length, its bytes and a zero; words of 4 and 8 bytes begin at multiples of these.
    """
    mask = bytearray()

    def align(size: int) -> None:
        # The stamp before it has 8 bytes.
        mask.extend(bytes(-len(mask) % size))

    for texts in ([message.header.frame_id], message.name):
        for text in texts:
            align(4)
            mask.extend(b"\xff" * (4 + len(text.encode()) + 1))
        # The number of names, or of positions.
        align(4)
        mask.extend(b"\xff" * 4)
    align(8)
    return bytes(mask)


def _as_number(data: bytes) -> int:
    return int.from_bytes(data, "little")
