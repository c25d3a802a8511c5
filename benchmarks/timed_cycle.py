"""A node whose timer callback is timed: ``python -m benchmarks.timed_cycle FILE NODE``.

NODE is ``ik_node``, or a role of ``bare_nodes``. At the end, FILE gets one row for each call of the
fastest timer: when it began and how long it took, both in nanoseconds of the steady clock.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from time import monotonic_ns
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.timer import Timer

RATE = 1000.0  # 1/s
LONGEST_PERIOD = 0.1  # s; slower timers do other things


def main(output: Path, name: str) -> None:
    """Run the node until it is interrupted, then write the file."""
    rows: list[tuple[int, int]] = []
    create_timer = Node.create_timer

    def create_timed_timer(
        node: Node, period: float, callback: Callable[[], object], *others: Any, **named: Any
    ) -> Timer:
        def timed() -> None:
            begin = monotonic_ns()
            callback()
            rows.append((begin, monotonic_ns() - begin))

        wanted = timed if period < LONGEST_PERIOD else callback
        return create_timer(node, period, wanted, *others, **named)

    setattr(Node, "create_timer", create_timed_timer)  # noqa: B010 - mypy knows no other way
    if name == "ik_node":
        from tri_glide_kinematics.ros.run import run

        run("tri_glide_kinematics.nodes.ik_node", "IkNode")
    else:
        from benchmarks import bare_nodes

        bare_nodes.main(name, RATE)
    np.save(output, np.array(rows, dtype=np.int64).reshape(-1, 2))


if __name__ == "__main__":
    # What is left is for the node, which refuses arguments that it does not know.
    file, name = sys.argv.pop(1), sys.argv.pop(1)
    main(Path(file), name)
