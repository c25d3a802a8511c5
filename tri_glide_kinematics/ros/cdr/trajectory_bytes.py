"""Joint trajectories as bytes, with their points straight out of arrays.

A path brings a trajectory with a hundred points for each of its parts, in mid-motion. To make those
points in Python, and bytes of them, takes as long as a control cycle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tri_glide_kinematics.motion.trajectory import SampledPlan
from tri_glide_kinematics.ros.cdr.message_bytes import (
    align,
    begun,
    write_count,
    write_header,
    write_text,
)

SLIDERS = 3

# A point, from its first position to what stands before the first position of the next one. Each
# list of numbers is led by its count; efforts are none.
POINT = np.dtype(
    {
        "names": [
            *("positions", "velocity_count", "velocities", "acceleration_count", "accelerations"),
            *("effort_count", "seconds", "nanoseconds", "next_count"),
        ],
        "formats": ["3<f8", "<u4", "3<f8", "<u4", "3<f8", "<u4", "<i4", "<u4", "<u4"],
        "offsets": [0, 24, 32, 56, 64, 88, 92, 96, 100],
        "itemsize": 104,
    }
)


def joint_trajectory(names: Sequence[str], frame: str, plan: SampledPlan) -> bytes:
    """Return a serialized JointTrajectory with the stamp 0.

    Args:
        names: of the sliders. Shape (3,).
        frame: of its header.
        plan: setpoints at one time at least, and all derivatives that they have.
    """
    written = begun()
    write_header(written, frame)
    write_count(written, len(names))
    for name in names:
        write_text(written, name)
    times, heights, velocities, accelerations = plan
    points = np.zeros(len(times), POINT)
    points["positions"], points["velocities"] = heights, velocities
    points["accelerations"] = accelerations
    for count in ("velocity_count", "acceleration_count", "next_count"):
        points[count] = SLIDERS
    whole = np.rint(1e9 * times).astype(np.int64)
    points["seconds"], points["nanoseconds"] = np.divmod(whole, 1_000_000_000)
    write_count(written, len(times))
    write_count(written, SLIDERS)
    align(written, 8)
    # Behind the last point there is none.
    written += points.tobytes()[: -POINT["next_count"].itemsize]
    return bytes(written)
