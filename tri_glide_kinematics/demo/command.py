"""The command ``demo``: a simulated machine is driven over the topics, measured, and judged."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tri_glide_kinematics.demo.client import TOLERANCE, DemoClient, Leg, MachineSettings
from tri_glide_kinematics.demo.running import (
    PATIENCE,
    demo_parser,
    in_millimetres,
    ros_that_ctrl_c_ends,
    run_command,
    say,
)
from tri_glide_kinematics.motion.limit_use import LIMIT_TOLERANCE, CommandStream, LimitUse
from tri_glide_kinematics.motion.limits import QUANTITIES, SliderLimits
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.picture_commands import save_figure
from tri_glide_kinematics.ros.starting import NodeProcesses, default_parameter_file
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from tri_glide_kinematics.figures import Span

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

MOST_LOST = 0.1  # part of the commands before which others were lost: with more, nothing is judged

TARGET_STYLE = {"marker": "o", "color": "tab:red", "markersize": 4}
START_STYLE = {"marker": "^", "color": "tab:green", "markersize": 7, "markerfacecolor": "none"}
END_STYLE = {"marker": "s", "color": "tab:green", "markersize": 6, "markerfacecolor": "none"}


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
    legs.append(client.follow("path", HOME[1], PATH, settings.joints))
    say(f"path: setpoints at most {1e3 * legs[-1].deviation:.3f} mm from it as programmed")
    return settings


def is_good(leg: Leg, use: LimitUse, tolerance: float) -> bool:
    """Return whether a target was reached and a path kept to ``tolerance`` [m], and all limits."""
    is_there = leg.error < tolerance and leg.deviation < leg.tolerance + tolerance
    return is_there and use.part(leg.first, leg.end).is_within


def table(legs: Sequence[Leg], use: LimitUse, limits: SliderLimits) -> str:
    """Return one line for each leg: target, measured position, and what is nearest to a limit."""
    heads = "".join(f" {f'{quantity} [{unit}]':>21}" for quantity, unit in QUANTITIES)
    start = f"{'':5} {'target [mm]':27} {'reached [mm]':27} {'error':>9} {'time':>7}"
    return "\n".join([start + heads, *(_line(leg, use, limits) for leg in legs)])


def _line(leg: Leg, use: LimitUse, limits: SliderLimits) -> str:
    target = in_millimetres(leg.target) if leg.target else "(by twist)"
    line = f"{leg.name:5} {target:27} {in_millimetres(leg.reached):27}"
    line += f" {1e6 * leg.error:6.1f} µm" if leg.target else f" {'':9}"
    line += f" {leg.duration:5.2f} s"
    part = use.part(leg.first, leg.end)
    for index in range(len(QUANTITIES)):
        slider = int(part.parts[:, index].max(axis=0).argmax())
        limit = limits.table[index, slider]
        kept = part.largest[index] <= 1.0 + LIMIT_TOLERANCE
        line += f" {part.largest[index] * limit:9.3f} {'<' if kept else '>'} {limit:7.2f}  "
    return line


def save_picture(
    folder: Path,
    legs: Sequence[Leg],
    path: FloatArray,
    stream: CommandStream,
    settings: MachineSettings,
) -> Path:
    """Draw the motion and return the path of the picture; its ``folder`` is made if there is none.

    The ``path`` has the measured positions of the platform. Shape (m, 3) [m].
    """
    # Drawing is imported late: it takes as long as starting the nodes.
    from tri_glide_kinematics.figures import Mark, motion_figure

    marks, spans = [], []
    for before, leg in zip((None, *legs), legs):
        if leg.target:
            marks.append(Mark(leg.name, leg.target, TARGET_STYLE))
        else:
            if before:
                marks.append(Mark(f"{leg.name} starts", before.reached, START_STYLE))
            marks.append(Mark(f"{leg.name} ends", leg.reached, END_STYLE))
        if leg.target is None or leg.tolerance:
            spans.append(_span(leg, stream))
    figure = motion_figure(stream, path, settings.limits, settings.travel, marks, spans)
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / "demo.png"
    save_figure(figure, picture, 110)
    return picture


def _span(leg: Leg, stream: CommandStream) -> Span:
    from tri_glide_kinematics.figures import Span

    last = min(leg.end, len(stream.times)) - 1
    return Span(leg.name, float(stream.times[leg.first]), float(stream.times[last]))


def demonstrate(folder: Path) -> int:
    """Start the nodes, drive, and return the exit code."""
    # A namespace of its own keeps the demonstration away from a machine on this computer.
    namespace = f"/tri_glide_demo_{os.getpid()}"
    arguments = ["--params-file", str(default_parameter_file()), "-r", f"__ns:={namespace}"]
    legs: list[Leg] = []
    with NodeProcesses() as processes:
        say("starting simulator_node, ik_node and fk_node as processes")
        for name in ("simulator_node", "ik_node", "fk_node"):
            processes.start(name, [*arguments, *PATIENCE, "--log-level", "WARN"])
        with ros_that_ctrl_c_ends():
            client = DemoClient(namespace)
            settings = drive(client, legs)
            stream, lost = client.stream(settings)
    use = LimitUse.of(stream, settings.limits, lost)
    print(f"\n{table(legs, use, settings.limits)}\n")
    if lost.any():
        say(f"{lost.sum()} gaps in the stream of commands are not judged: this computer is busy")
    good = lost.mean() < MOST_LOST and all(is_good(leg, use, TOLERANCE) for leg in legs)
    picture = save_picture(folder, legs, np.array(client.path), stream, settings)
    say(f"picture: {picture}")
    say("every target reached, no limit broken" if good else "FAILED: see the table")
    return 0 if good else 1


def main() -> int:
    """Run the demonstration from the command line."""
    folder = demo_parser("demo", __doc__).parse_args().output
    return run_command("demo", lambda: demonstrate(folder))


if __name__ == "__main__":
    sys.exit(main())
