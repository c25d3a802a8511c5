"""How a demonstration runs: on this computer alone, with nodes that are patient, until Ctrl-C."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.utilities import ok

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.starting import (
    COMPUTER,
    choose_transport,
    raise_at_signals,
    shut_down,
)
from tri_glide_kinematics.vectors import Vector3

# A busy computer may let the simulated machine wait for longer than a real one ever falls silent,
# and follow from farther behind.
PATIENCE = ("-p", "measured_timeout:=2.0", "-p", "tracking_error_limit:=0.3")


def say(text: str) -> None:
    """Print one line of progress at once."""
    print(f"demo: {text}", flush=True)


def in_millimetres(vector: Vector3) -> str:
    """Return a vector [m] as text [mm]."""
    return "(" + ", ".join(f"{1000.0 * value:7.2f}" for value in vector) + ")"


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
