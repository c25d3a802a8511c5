"""The command ``demo``: a simulated machine is driven over the topics, measured, and judged."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rclpy
from rclpy.utilities import ok

from tri_glide_kinematics.demo.client import TOLERANCE, DemoClient
from tri_glide_kinematics.demo.leg import Leg
from tri_glide_kinematics.demo.report import is_good, say, table
from tri_glide_kinematics.demo.tour import drive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limit_use import LimitUse
from tri_glide_kinematics.ros.starting import (
    COMPUTER,
    NodeProcesses,
    choose_transport,
    default_parameter_file,
    shut_down,
)

# A busy computer may let the simulated machine wait for longer than a real one ever falls silent.
PATIENCE = ("-p", "measured_timeout:=2.0")


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
    from tri_glide_kinematics.demo.picture import save_picture

    picture = save_picture(folder, legs, np.array(client.path), stream, settings)
    say(f"picture: {picture}")
    say("every target reached, no limit broken" if good else "FAILED: see the table")
    return 0 if good else 1


def main() -> int:
    """Run the demonstration from the command line."""
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out"), help="folder of the picture")
    folder = parser.parse_args().output
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        # For this process and the nodes that it starts.
        say(choose_transport(COMPUTER).text)
        return demonstrate(folder)
    except KeyboardInterrupt:
        say("interrupted; all nodes are stopped")
        return 128 + signal.SIGINT
    except (KinematicsError, OSError) as error:
        print(f"demo: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
