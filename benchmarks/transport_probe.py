"""What the transport of this process costs a machine: ``python -m benchmarks.transport_probe``.

Prints one JSON object: the median age of a command of ``ik_node`` when it is heard [s], and the
processor time that ``ik_node`` and ``simulator_node`` take per second [s].
"""

from __future__ import annotations

import json
import statistics
import sys
import time

from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from benchmarks.harness import NoAnswerError
from benchmarks.machine import processor_time
from benchmarks.ros_session import session

WARM_UP_TIME = 2.0  # s
TIME = 5.0  # s
AGE, LOAD = "age", "load"


def main() -> int:
    """Measure, and print the result."""
    ages: list[float] = []

    def hear(message: JointState) -> None:
        stamp = message.header.stamp
        ages.append(1e-9 * (time.time_ns() - stamp.nanosec) - stamp.sec)

    with session() as running:
        pids = [running.start_node(name, "/probed") for name in ("simulator_node", "ik_node")]
        running.node.create_subscription(
            JointState, "/probed/joint_commands", hear, qos_profile_sensor_data
        )
        try:
            running.spin_until(lambda: ages, "commands")
        except NoAnswerError as error:
            print(error, file=sys.stderr)
            return 1
        running.spin_for(WARM_UP_TIME)
        ages.clear()
        begin, before = time.monotonic_ns(), sum(map(processor_time, pids))
        running.spin_for(TIME)
        load = (sum(map(processor_time, pids)) - before) / (time.monotonic_ns() - begin)
    print(json.dumps({AGE: statistics.median(ages), LOAD: load}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
