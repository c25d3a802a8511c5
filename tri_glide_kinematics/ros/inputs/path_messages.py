"""Reads paths out of messages, without holding a control cycle.

To make a message of the bytes of a nav_msgs/Path, rclpy makes each of its parts in Python: 10,000
poses take 0.2 s. Their numbers stand in the bytes, at places that are known once a frame is read.
"""

from __future__ import annotations

import math
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.checks import SMALLEST, normal
from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, Refusal, WrongShapeError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine import PathOutputs
from tri_glide_kinematics.motion.path import FlatPath, check_count
from tri_glide_kinematics.ros.cdr import PLAIN, aligned, byte_order
from tri_glide_kinematics.ros.messages import (
    ROTATION_TOLERANCE,
    RefusedMessageError,
    check_frame,
)
from tri_glide_kinematics.vectors import FloatArray

# In the bytes: what kind of encoding it is, then the parts; each begins at a multiple of its size.
ENCODING = 4
STAMP = 8
POSE = 7 * 8

# Poses that are read in a piece: where all frames are alike at most, and else at least.
AT_A_TIME = 4000
PIECE = 30


def flat_path(request: Any, base_frame: str, tolerance: float) -> FlatPath:
    """Return the segments of a goal of FollowPath, with ``tolerance`` where it gives none [m].

    Raises:
        RefusedMessageError: if they are in another frame.
        KinematicsError: if they can be no path.
    """
    check_frame("path", request.header.frame_id, (base_frame,))
    for index in np.flatnonzero(_are_tiny(np.asarray(request.numbers)))[:1].tolist():
        normal(f"numbers[{index}]", request.numbers[index])
    return FlatPath.of(
        request.kinds, request.numbers, request.tolerances, request.speeds, tolerance
    )


def path_outputs(request: Any, count: int) -> PathOutputs | None:
    """Return what a goal of FollowPath of ``count`` segments tells on its way; None for nothing.

    Raises:
        WrongShapeError: if there are not as many outputs as segments at which they change.
        OutOfBoundsError: if such a segment is none of the goal, or comes before the last one.
        NotFiniteError: if a value is NaN or infinite.
    """
    segments, outputs = request.output_segments, request.outputs
    if len(segments) != len(outputs):
        shape = f"({len(outputs)},), one for each of outputs"
        raise WrongShapeError("output_segments", (len(segments),), shape)
    least = 0
    for index, (segment, output) in enumerate(zip(segments, outputs)):
        name = f"output_segments[{index}]"
        if segment >= count:
            raise OutOfBoundsError(name, segment, f"at most {count - 1}, the last segment")
        if segment < least:
            raise OutOfBoundsError(name, segment, f"at least {least}, as the one before it")
        least = segment
        if not math.isfinite(output.value):
            raise NotFiniteError(f"outputs[{index}].value", output.value)
    return PathOutputs(segments.tolist(), outputs, count) if len(outputs) else None


def path_points(data: bytes, base_frame: str) -> Interruptible[FloatArray]:
    """Return the positions of a serialized nav_msgs/Path, whatever its stamps. Shape (n, 3) [m].

    Raises:
        RefusedMessageError: if a frame is neither empty nor ``base_frame``, an orientation is
            not the identity, or the bytes are no such message.
        TooManySegmentsError: if there are more poses than a path may have segments.
    """
    if data[:2] not in PLAIN:
        raise RefusedMessageError(
            f"target path is in the encoding {data[:2].hex()}: ROS writes 0000 or 0001"
        )
    try:
        return (yield from _points(data, base_frame))
    except IndexError as error:
        raise RefusedMessageError("target path ends before its last pose") from error


def _points(data: bytes, base_frame: str) -> Interruptible[FloatArray]:
    """Return the positions of all poses. Shape (n, 3) [m]."""
    order = byte_order(data)
    size = Struct(f"{order}I")

    def text(offset: int) -> tuple[bytes, int]:
        """Return a text and the offset of what follows it."""
        if offset + 4 > len(data):
            raise IndexError
        (length,) = size.unpack_from(data, offset)
        end = offset + 4 + length
        if not 0 < length <= len(data):
            raise IndexError
        return data[offset + 4 : end - 1], end

    frame, end = text(ENCODING + STAMP)
    _check_path_frame(frame, base_frame)
    offset = aligned(end, 4)
    if offset + 4 > len(data):
        raise IndexError
    (count,) = size.unpack_from(data, offset)
    if not count:
        return np.empty((0, 3))
    check_count(count)
    if count * (STAMP + 4 + POSE) > len(data):
        raise IndexError
    points = np.empty((count, 3))
    done, told, end, window = 0, 0, offset + 4, AT_A_TIME
    while done < count:
        frame, end = text(aligned(end, 4) + STAMP)
        _check_path_frame(frame, base_frame)
        begin = aligned(end, 8)
        # A pose follows the one before it at a fixed distance as long as all frames are alike.
        stride = POSE + 8 * -(-(STAMP + 4 + len(frame) + 1) // 8)
        most = min(count - done, window, (len(data) - begin - POSE) // stride + 1)
        if most < 1:
            raise IndexError
        alike = 1
        if most > 1:
            same = np.frombuffer(size.pack(len(frame) + 1) + frame + b"\0", np.uint8)
            shape, place = (most - 1, len(same)), begin + POSE + STAMP
            others = (np.ndarray(shape, np.uint8, data, place, (stride, 1)) != same).any(axis=1)
            alike += int(others.argmax()) if others.any() else most - 1
        rows = np.ndarray((alike, 7), f"{order}f8", data, begin, (stride, 8))
        points[done : done + alike] = _checked(rows.astype(np.float64), done)
        done, end = done + alike, begin + (alike - 1) * stride + POSE
        window = AT_A_TIME if alike == most else PIECE
        if done >= told + PIECE:
            told = done
            yield
    return points


def _check_path_frame(frame: bytes, base_frame: str) -> None:
    check_frame("target path", frame.decode(errors="replace"), (base_frame,))


def _checked(rows: FloatArray, first: int) -> FloatArray:
    """Return the positions of poses from the index ``first`` on, if no orientation is a rotation.

    The ``rows`` are positions and orientations. Shape (n, 7).
    """
    parts = np.abs(rows[:, 3:])
    parts[:, 3] -= 1.0
    turned = ~(np.abs(parts) <= ROTATION_TOLERANCE).all(axis=1)
    if turned.any():
        index = first + int(turned.argmax())
        raise RefusedMessageError(
            f"pose {index + 1} of the target path is turned: the platform cannot rotate, its "
            f"orientation must be (0, 0, 0, 1) within {ROTATION_TOLERANCE:g}",
            Refusal.ROTATION,
        )
    for index, axis in np.argwhere(_are_tiny(rows[:, :3]))[:1].tolist():
        name = f"position.{'xyz'[axis]} of pose {first + index + 1} of the target path"
        normal(name, float(rows[index, axis]), "m")
    return rows[:, :3]


def _are_tiny(numbers: FloatArray) -> NDArray[np.bool_]:
    """Tell which numbers are refused by ``normal``."""
    return np.asarray((numbers != 0.0) & (np.abs(numbers) < SMALLEST))
