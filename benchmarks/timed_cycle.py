"""A node whose cycle is timed: ``python -m benchmarks.timed_cycle FILE NODE``.

NODE is ``ik_node``, or a role of ``bare_nodes`` with a fast timer. At the end, FILE gets one row
for each cycle: when its callback began and how long it took, both in nanoseconds of the steady
clock.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import monotonic_ns
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.timer import Timer

RATE = 1000.0  # 1/s
LONGEST_PERIOD = 0.1  # s; slower timers do other things

Rows = list[tuple[int, int]]


def main(output: Path, name: str) -> None:
    """Run the node until it is interrupted, then write the file."""
    rows: Rows = []
    if name == "ik_node":
        _run_ik_node(rows)
    else:
        _run_bare(name, rows)
    np.save(output, np.array(rows, dtype=np.int64).reshape(-1, 2))


def _run_ik_node(rows: Rows) -> None:
    from tri_glide_kinematics.ros import loop
    from tri_glide_kinematics.ros.starting.run import run

    class TimedLoop(loop.CycleLoop):
        def __init__(self, node: Node, cycle: loop.Cycle, *others: Any) -> None:
            super().__init__(node, replace(cycle, step=_timed(cycle.step, rows)), *others)

    setattr(loop, "CycleLoop", TimedLoop)  # noqa: B010 - mypy knows no other way
    run("tri_glide_kinematics.nodes.ik_node", "IkNode")


def _run_bare(role: str, rows: Rows) -> None:
    from benchmarks import bare_nodes

    create_timer = Node.create_timer

    def create_timed_timer(
        node: Node, period: float, callback: Callable[[], object], *others: Any, **named: Any
    ) -> Timer:
        wanted = _timed(callback, rows) if period < LONGEST_PERIOD else callback
        return create_timer(node, period, wanted, *others, **named)

    setattr(Node, "create_timer", create_timed_timer)  # noqa: B010 - mypy knows no other way
    bare_nodes.main(role, RATE)


def _timed(callback: Callable[[], object], rows: Rows) -> Callable[[], None]:
    def timed() -> None:
        begin = monotonic_ns()
        callback()
        rows.append((begin, monotonic_ns() - begin))

    return timed


if __name__ == "__main__":
    # What is left is for the node, which refuses arguments that it does not know.
    file, name = sys.argv.pop(1), sys.argv.pop(1)
    main(Path(file), name)
