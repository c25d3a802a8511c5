"""A client that sends targets until it is killed: run as a process by tests.

Arguments: kind of target (one of ``KINDS``, ``path`` or ``tour``), then two places [m] or
velocities [m/s] of three numbers each. SIGUSR1 has it send the one and the other in turn, SIGUSR2
has it cease, which it confirms.
"""

import signal
import sys
import time
from collections.abc import Sequence
from itertools import cycle
from typing import Any

import rclpy
from geometry_msgs.msg import Point, Pose, PoseStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.signals import SignalHandlerOptions

READY, CEASED = "somebody listens", "ceased"
# Topic and type of each kind of target.
KINDS = {
    "pose": ("target_pose", PoseStamped),
    "twist": ("target_twist", TwistStamped),
    "state": ("target_state", Odometry),
}
PATHS = {kind: ("target_path", Path) for kind in ("path", "tour")}
ROUNDS = 2  # of a tour between the two places
PERIOD = 0.02  # s
NAP = 60.0  # s, at most, until something is asked for
# What is sent again and again; a place or a path is sent once.
RENEWED = ("twist", "state")
SEND, CEASE = signal.SIGUSR1, signal.SIGUSR2


def main() -> None:
    """Publish whatever is asked for."""
    # Before the threads of the middleware are there: what is asked for waits until it is looked at.
    signal.pthread_sigmask(signal.SIG_BLOCK, {SEND, CEASE})
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    kind, *numbers = sys.argv[1], *map(float, sys.argv[2:8])
    node = rclpy.create_node("held_client", start_parameter_services=False)
    topic, message_type = {**KINDS, **PATHS}[kind]
    publisher = node.create_publisher(message_type, topic, 10)
    places = Point(**dict(zip("xyz", numbers))), Point(**dict(zip("xyz", numbers[3:])))
    rounds = ROUNDS if kind == "tour" else 0
    messages = cycle(
        _message(message_type(), [place, *(other, place) * rounds])
        for place, other in (places, places[::-1])
    )
    while not publisher.get_subscription_count():
        time.sleep(PERIOD)
    print(READY, flush=True)
    held = None
    while True:
        told = signal.sigtimedwait({SEND, CEASE}, NAP if held is None else PERIOD)
        asked = told and told.si_signo
        if asked == SEND:
            held = next(messages)
        elif asked == CEASE:
            held = None
            print(CEASED, flush=True)
        if held is not None:
            held.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(held)
            held = held if kind in RENEWED else None


def _message(message: Any, places: Sequence[Point]) -> Any:
    """Fill in a target, which is the first of some places, or a path along all of them."""
    first = places[0]
    if isinstance(message, TwistStamped):
        linear = message.twist.linear
        linear.x, linear.y, linear.z = first.x, first.y, first.z
    elif isinstance(message, Path):
        message.poses = [PoseStamped(pose=Pose(position=place)) for place in places]
    elif isinstance(message, PoseStamped):
        message.pose.position = first
    else:
        message.pose.pose.position = first
    return message


if __name__ == "__main__":
    main()
