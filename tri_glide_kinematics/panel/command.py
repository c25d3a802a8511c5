"""The command ``panel``: a simulated machine, and the page that shows it."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.processes import NodeProcesses, default_parameter_file
from tri_glide_kinematics.ros.transport import COMPUTER, choose_transport

# A busy computer may let the simulated machine wait for longer than a real one ever falls silent.
PATIENCE = ("-p", "measured_timeout:=2.0")
NODES = ("simulator_node", "ik_node", "fk_node", "mechanism_node")
LOOK_PERIOD = 0.2  # s between two looks whether all of them run


def serve(port: int, points_file: str) -> int:
    """Start the nodes and the page, and return the exit code when one of them has ended."""
    # A namespace of its own keeps it away from a machine on this computer.
    namespace = f"/tri_glide_panel_{os.getpid()}"
    space = ["-r", f"__ns:={namespace}"]
    quiet = ["--log-level", "WARN"]
    file = ["--params-file", str(default_parameter_file())]
    with NodeProcesses() as processes:
        for name in NODES:
            # What stands last wins; mechanism_node has no parameters.
            parameters = file if name != "mechanism_node" else ()
            patience = PATIENCE if name == "ik_node" else ()
            processes.start(name, [*space, *quiet, *parameters, *patience])
        page = ["-p", f"port:={port}", "-p", f"points_file:={points_file}"]
        processes.start("panel_node", [*space, *page])
        while not (ended := processes.ended()):
            time.sleep(LOOK_PERIOD)
    return ended[0].returncode or 1


def main() -> int:
    """Run until Ctrl-C."""
    parser = argparse.ArgumentParser(prog="panel", description=__doc__)
    parser.add_argument("--port", type=int, default=8080, help="of the page on this computer")
    parser.add_argument(
        "--points", default="taught_points.yaml", help="file in which taught points are saved"
    )
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        print(f"panel: {choose_transport(COMPUTER).text}", flush=True)
        return serve(options.port, options.points)
    except KeyboardInterrupt:
        print("panel: interrupted; all nodes are stopped", flush=True)
        return 128 + signal.SIGINT
    except (KinematicsError, OSError) as error:
        print(f"panel: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
