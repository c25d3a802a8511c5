"""The command ``demo``: a simulated machine is driven over the topics, measured, and judged."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rclpy
from rclpy.utilities import ok

from tri_glide_kinematics.demo.client import TOLERANCE, DemoClient, Leg, MachineSettings
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limit_use import LIMIT_TOLERANCE, CommandStream, LimitUse
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.motion.trajectory import QUANTITIES, SliderLimits
from tri_glide_kinematics.ros.starting import (
    COMPUTER,
    NodeProcesses,
    choose_transport,
    default_parameter_file,
    raise_at_signals,
    shut_down,
)
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
    legs.append(client.follow("path", HOME[1], PATH, settings.joints))
    say(f"path: setpoints at most {1e3 * legs[-1].deviation:.3f} mm from it as programmed")
    return settings


def say(text: str) -> None:
    """Print one line of progress at once."""
    print(f"demo: {text}", flush=True)


def in_millimetres(vector: Vector3) -> str:
    """Return a vector [m] as text [mm]."""
    return "(" + ", ".join(f"{1000.0 * value:7.2f}" for value in vector) + ")"


def is_good(leg: Leg, use: LimitUse, tolerance: float) -> bool:
    """Return whether a target was reached and a path kept to ``tolerance`` [m], and all limits."""
    is_there = leg.error < tolerance and leg.deviation < leg.tolerance + tolerance
    return is_there and use.part(leg.first, leg.end).is_within


def table(legs: Sequence[Leg], use: LimitUse, stream: CommandStream, limits: SliderLimits) -> str:
    """Return one line for each leg: target, measured position, and what is nearest to a limit."""
    heads = "".join(f" {f'{quantity} [{unit}]':>21}" for quantity, unit in QUANTITIES)
    start = f"{'':5} {'target [mm]':27} {'reached [mm]':27} {'error':>9} {'time':>7}"
    return "\n".join([start + heads, *(_line(leg, use, stream, limits) for leg in legs)])


def _line(leg: Leg, use: LimitUse, stream: CommandStream, limits: SliderLimits) -> str:
    target = in_millimetres(leg.target) if leg.target else "(by twist)"
    line = f"{leg.name:5} {target:27} {in_millimetres(leg.reached):27}"
    line += f" {1e6 * leg.error:6.1f} µm" if leg.target else f" {'':9}"
    line += f" {leg.duration:5.2f} s"
    part = use.part(leg.first, leg.end)
    derivatives = (stream.velocities, stream.accelerations, stream.jerks)
    for index, derivative in enumerate(derivatives):
        slider = int(part.parts[:, index].max(axis=0).argmax())
        largest = float(np.abs(derivative[leg.first : leg.end, slider]).max())
        limit = limits.table[index, slider]
        kept = part.largest[index] <= 1.0 + LIMIT_TOLERANCE
        line += f" {largest:9.3f} {'<' if kept else '>'} {limit:7.2f}  "
    return line


# A busy computer may let the simulated machine wait for longer than a real one ever falls silent,
# and follow from farther behind.
PATIENCE = ("-p", "measured_timeout:=2.0", "-p", "tracking_error_limit:=0.3")


@contextmanager
def ros_that_ctrl_c_ends() -> Iterator[None]:
    """Use rclpy, and leave Ctrl-C to it: an exception raised within its C++ code may get lost.

    Raises:
        KeyboardInterrupt: if the signal came, whatever else went wrong then.
    """
    # rclpy calls the handler that it finds beside its own.
    before = signal.signal(signal.SIGINT, lambda *_: None)
    rclpy.init()
    try:
        yield
    except Exception:
        if ok():
            raise
    finally:
        interrupted = not ok()
        shut_down()
        signal.signal(signal.SIGINT, before)
    if interrupted:
        raise KeyboardInterrupt


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
            stream = client.stream(settings)
    use = LimitUse.of(stream, settings.limits)
    print(f"\n{table(legs, use, stream, settings.limits)}\n")
    good = all(is_good(leg, use, TOLERANCE) for leg in legs)
    # Drawing is imported late: it takes as long as starting the nodes.
    from tri_glide_kinematics.demo.pictures import save_picture

    picture = save_picture(folder, legs, np.array(client.path), stream, settings)
    say(f"picture: {picture}")
    say("every target reached, no limit broken" if good else "FAILED: see the table")
    return 0 if good else 1


def run_command(name: str, demonstrate: Callable[[], int]) -> int:
    """Run a demonstration on this computer alone, and return the exit code of its command."""
    raise_at_signals()
    try:
        # For this process and the nodes that it starts.
        say(choose_transport(COMPUTER).text)
        return demonstrate()
    except KeyboardInterrupt:
        say("interrupted; all nodes are stopped")
        return 128 + signal.SIGINT
    except (KinematicsError, OSError) as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 1


def main() -> int:
    """Run the demonstration from the command line."""
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out"), help="folder of the picture")
    folder = parser.parse_args().output
    return run_command("demo", lambda: demonstrate(folder))


if __name__ == "__main__":
    sys.exit(main())
