"""How long a path of very many poses holds whoever makes it: its longest pieces, and the memory.

Run it as ``python -m benchmarks.long_paths 100000 1000000``; it prints a row for each step from the
bytes of a nav_msgs/Path to the path as driven. Where a virtual machine has given memory back to its
host, the first use of a large page takes 5 ms; ``NUMPY_MADVISE_HUGEPAGE=0`` has small ones used.
"""

from __future__ import annotations

import gc
import resource
import struct
import sys
from typing import TypeVar

import numpy as np

from testing.pieces import timed
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.path import polyline_from
from tri_glide_kinematics.ros.inputs import path_points

Result = TypeVar("Result")

START = (0.02, 0.0, 0.27)
TURNS = 50
TOLERANCE = 1e-4  # m
# Of a pose after the first: stamp, an empty frame, three bytes to fill up, seven numbers.
POSE = np.dtype(
    {"names": ["frame", "numbers"], "formats": ["u1", "7<f8"], "offsets": [8, 16], "itemsize": 72}
)


def message(count: int) -> bytes:
    """Return a serialized nav_msgs/Path of ``count`` poses on a helix."""
    poses = np.zeros(count, POSE)
    angles = np.linspace(0.0, 2.0 * np.pi * TURNS, count)
    poses["frame"] = 1
    numbers = poses["numbers"]
    numbers[:, 0], numbers[:, 1] = 0.02 * np.cos(angles), 0.02 * np.sin(angles)
    numbers[:, 2], numbers[:, 6] = np.linspace(0.28, 0.3, count), 1.0
    head = b"\0\1\0\0" + struct.pack("<iII", 0, 0, 1) + bytes(4) + struct.pack("<I", count)
    first = struct.pack("<iII", 0, 0, 1) + b"\0"
    first += bytes(-(len(head) - 4 + len(first)) % 8)
    return head + first + poses.tobytes()[16:]


def told(what: str, computation: Interruptible[Result]) -> Result:
    """Return the result, and print the processor time of the longest pieces."""
    pieces: list[float] = []
    result = at_once(timed(computation, pieces))
    longest = ", ".join(f"{1000.0 * piece:.2f}" for piece in sorted(pieces)[-3:])
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000.0
    print(
        f"{what:<20} {len(pieces):>7} pieces, {1000.0 * sum(pieces):8.1f} ms, "
        f"longest {longest} ms, {memory:.0f} MB"
    )
    return result


def main() -> None:
    """Make a path of each number of poses that is given."""
    for count in map(int, sys.argv[1:]):
        reading = path_points(message(count), "")
        gc.collect()
        points = told(f"read {count}", reading)
        del reading
        path = told("put together", polyline_from(START, points, TOLERANCE))
        del points
        told("rounded", path.driven_in_pieces())


if __name__ == "__main__":
    main()
