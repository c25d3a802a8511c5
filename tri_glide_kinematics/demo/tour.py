"""The targets and the path of the demonstration, one after the other."""

from __future__ import annotations

from tri_glide_kinematics.demo.client import DemoClient, MachineSettings
from tri_glide_kinematics.demo.leg import Leg
from tri_glide_kinematics.demo.report import in_millimetres, say
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.vectors import Vector3

POSES: tuple[tuple[str, Vector3], ...] = (
    ("A", (0.00, 0.00, 0.30)),
    ("B", (0.08, 0.00, 0.25)),
    ("C", (-0.04, 0.07, 0.22)),
    ("D", (-0.04, -0.07, 0.30)),
    ("E", (0.05, 0.05, 0.27)),
)
JOG_VELOCITY: Vector3 = (-0.10, -0.05, 0.02)  # m/s
JOG_TIME = 0.8  # s
# From home on: corners that are rounded, and an arc.
CORNER_TOLERANCE = 0.004  # m
PATH_SPEED = 0.25  # m/s
PATH = FlatPath.of(
    [SegmentKind.LINE, SegmentKind.LINE, SegmentKind.ARC_THROUGH, SegmentKind.LINE],
    [
        *(0.07, 0.00, 0.25),
        *(0.07, 0.05, 0.25),
        *(0.00, 0.10, 0.25, -0.07, 0.05, 0.25),
        *(-0.07, 0.00, 0.25),
    ],
    [CORNER_TOLERANCE],
    [PATH_SPEED],
    0.0,
)
HOME: tuple[str, Vector3] = ("home", (0.00, 0.00, 0.25))


def drive(client: DemoClient, legs: list[Leg]) -> MachineSettings:
    """Drive to all targets, and append each leg to ``legs`` as it ends.

    Raises:
        DemoError: if one is not reached.
    """
    client.wait_for_machine()
    settings = client.read_settings()
    frame = settings.base_frame
    for name, target in POSES:
        say(f"pose {name} {in_millimetres(target)} mm")
        legs.append(client.move(name, target, frame))
    say(f"jog  {in_millimetres(JOG_VELOCITY)} mm/s for {JOG_TIME} s, then silence")
    legs.append(client.jog(JOG_VELOCITY, JOG_TIME, frame))
    say(f"pose {HOME[0]} {in_millimetres(HOME[1])} mm")
    legs.append(client.move(*HOME, frame))
    say(f"path of {len(PATH)} segments, corners rounded by {1e3 * CORNER_TOLERANCE:g} mm at most")
    legs.append(client.follow("path", HOME[1], PATH))
    say(f"path: measured at most {1e3 * legs[-1].deviation:.3f} mm from it as programmed")
    return settings
