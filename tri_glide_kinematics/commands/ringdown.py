"""The command ``ringdown``: its option ``--machine`` lets ``calibration_node`` record the swings.

ROS is loaded for this option only. Ctrl-C stops the machine; once more ends the command at once,
while the platform may still move.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tri_glide_kinematics.commands import ringdown_of_files
from tri_glide_kinematics.errors import KinematicsError

if TYPE_CHECKING:
    from rclpy.node import Node

SERVICE = "calibration_node/find_modes"
# Of the files in the folder of calibration_node.
NAME = "swing"

# Completion is made of it.
make_parser = ringdown_of_files.make_parser

# Until the service is found, and until it is taken to be gone [s].
START_TIMEOUT = 10.0
SILENCE = 3.0
# How long one listens before one looks up [s].
NAP = 0.05


class NotMeasuredError(KinematicsError):
    """There are no recordings; the text says why."""


def main() -> int:
    """Find modes from the command line; the exit code is that of the command."""
    arguments = sys.argv[1:]
    if "--ros-args" in arguments:
        arguments = arguments[: arguments.index("--ros-args")]
    return ringdown_of_files.main(arguments, _measured)


def _measured(by_heights: bool) -> Sequence[Path]:
    """Let the machine swing, and return the files of its recordings.

    Raises:
        NotMeasuredError: if there are none.
        KeyboardInterrupt: after a signal, when the platform rests.
    """
    import rclpy
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    from tri_glide_kinematics.ros.starting import EndSignals, choose_transport, shut_down

    choose_transport()
    # rclpy's handlers would end all talk with the machine before it is told to stop.
    signals = EndSignals()
    signals.call(lambda: None)
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        return _asked(Node("ringdown"), by_heights, signals.came)
    finally:
        shut_down()


def _asked(node: Node, by_heights: bool, signals: Sequence[int]) -> Sequence[Path]:
    """Ask for a search; ``signals`` are those that have come."""
    from std_srvs.srv import Trigger

    from tri_glide_interfaces.srv import FindModes
    from tri_glide_kinematics.ros.loop import OtherTurns

    turns = OtherTurns(node)
    client = node.create_client(FindModes, SERVICE)
    stop = node.create_client(Trigger, "calibration_node/stop")
    end = time.monotonic() + START_TIMEOUT
    while not client.service_is_ready():
        if signals:
            raise KeyboardInterrupt
        if time.monotonic() > end:
            raise NotMeasuredError(
                f"nobody offers {client.srv_name} after {START_TIMEOUT:g} s: is calibration_node "
                "running, in this domain and this namespace?"
            )
        turns.spin_once(NAP)
    request = FindModes.Request(recordings=NAME)
    if by_heights:
        request.source = FindModes.Request.MEASURED_HEIGHTS
    print("the machine moves and is listened to: about half a minute", flush=True)
    answer = client.call_async(request)
    heard = time.monotonic()
    is_stopped = False
    while not answer.done():
        now = time.monotonic()
        heard = now if client.service_is_ready() else heard
        if now - heard > SILENCE:
            raise NotMeasuredError("calibration_node is gone")
        if len(signals) > 1:
            raise KeyboardInterrupt
        if signals and not is_stopped:
            is_stopped = True
            stop.call_async(Trigger.Request())
        turns.spin_once(NAP)
    if signals:
        raise KeyboardInterrupt
    found = answer.result()
    if not found.files:
        raise NotMeasuredError(found.message)
    return [Path(file) for file in found.files]


if __name__ == "__main__":
    sys.exit(main())
