"""The three nodes of a machine in one process, each with its cycle in a thread of its own.

Run it as ``python -m benchmarks.one_process``, with arguments of ROS, in place of three processes.
"""

from __future__ import annotations

import gc
import signal
import sys
import threading

import rclpy

from tri_glide_kinematics.nodes.fk_node import FkNode
from tri_glide_kinematics.nodes.ik_node import IkNode
from tri_glide_kinematics.nodes.simulator_node import SimulatorNode
from tri_glide_kinematics.ros.loop import CycleLoop


def main() -> None:
    """Run until SIGINT or SIGTERM."""
    rclpy.init()
    nodes = [kind() for kind in (SimulatorNode, IkNode, FkNode)]
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    loops = [CycleLoop(node, node.cycle, _survive) for node in nodes]
    gc.freeze()
    threads = [threading.Thread(target=loop.spin) for loop in loops]
    for thread in threads:
        thread.start()
    ended.wait()
    for loop in loops:
        loop.stop()
    for thread in threads:
        thread.join()
    for loop in loops:
        loop.close()
    # Or ruckig tells of all that is still there at the end.
    gc.unfreeze()
    rclpy.try_shutdown()


def _survive(error: Exception) -> None:
    print(error, file=sys.stderr)


if __name__ == "__main__":
    main()
