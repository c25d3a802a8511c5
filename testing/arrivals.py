"""When setpoints of the real ``ik_node`` arrive: `python -m testing.arrivals FILE.npz` records it.

A platform goes to and fro meanwhile: quietly, and beside two processes that only calculate. Of each
setpoint the file has the time of its arrival less its nominal time [us], from zero.
"""

from __future__ import annotations

import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from testing.client import Client
from testing.domain import own_context, own_domain
from testing.machine import Machine
from testing.processes import launched
from testing.taking import taken
from tri_glide_kinematics.vectors import FloatArray

RATE = 500.0  # of setpoints [1/s]
DURATION = 20.0  # of a recording [s]
NAP = 0.0002  # between two looks [s]
TURNING = 0.6  # time to go to one side [s]


def calculate() -> None:
    """Do nothing else, for ever."""
    while True:
        pass


def recorded() -> FloatArray:
    """Return the delays of arrivals in one recording. Shape (n,) [s]."""
    with own_domain(), own_context() as context, tempfile.TemporaryDirectory() as folder:
        with launched(Path(folder), "/arrivals") as launcher:
            client = Client(context, "/arrivals")
            rates = {"rate": RATE}
            machine = Machine(client, launcher, listen=False).start(rates, rates)
            qos = QoSProfile(depth=5000)
            heard = client.node.create_subscription(JointState, "joint_commands", print, qos)
            arrivals: list[float] = []
            begin = turn = time.monotonic()
            side = 0.05
            while (now := time.monotonic()) < begin + DURATION + 1.0:
                if now > turn:
                    client.send_pose((side, 0.0, 0.3))
                    turn, side = now + TURNING, -side
                arrivals += [time.monotonic() for _ in taken(heard)]
                time.sleep(NAP)
            client.close()
            del machine
    times = np.array(arrivals)
    delays = times - times[0] - np.arange(len(times)) / RATE
    count = int(RATE)
    return np.array(delays[count:] - delays[count:].min())


def main() -> None:
    """Record both, and write them."""
    quiet = recorded()
    busy = [multiprocessing.Process(target=calculate, daemon=True) for _ in range(2)]
    for each in busy:
        each.start()
    loaded = recorded()
    for each in busy:
        each.kill()
    for name, delays in (("quiet", quiet), ("loaded", loaded)):
        steps = np.diff(delays)
        print(name, len(delays), "longest step [ms]", 1e3 * steps.max(), "end", delays[-1] * 1e3)
    np.savez_compressed(
        sys.argv[1],
        quiet=np.round(1e6 * quiet).astype(np.int32),
        loaded=np.round(1e6 * loaded).astype(np.int32),
    )


if __name__ == "__main__":
    main()
