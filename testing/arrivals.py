"""When setpoints of the real ``ik_node`` arrive: `python -m testing.arrivals FILE.npz` records it.

A platform moves meanwhile: quietly, and beside two processes that only calculate. Of each setpoint
the file has the time of its arrival less its nominal time [us]; -1 for one that was lost.
"""

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
from testing.machine import PATIENCE, Machine
from testing.processes import launched
from testing.taking import taken
from tri_glide_kinematics.vectors import FloatArray

RATE = 500.0  # of setpoints [1/s]
DURATION = 20.0  # of a recording [s]
NAP = 0.0002  # between two looks [s]
SLOWLY = 0.005  # speed scale of a motion that lasts longer


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
            machine = Machine(client, launcher, listen=False)
            machine.start({**rates, "speed_scale": SLOWLY, **PATIENCE}, rates)
            qos = QoSProfile(depth=5000)
            heard = client.node.create_subscription(JointState, "joint_commands", print, qos)
            client.send_pose((0.0, 0.0, 0.1))
            begin = time.monotonic()
            arrivals: dict[int, float] = {}
            number, last = 0, 0
            while (now := time.monotonic()) < begin + DURATION + 1.0:
                for message in taken(heard):
                    stamp = client.time_of(message)
                    # In motion, only: at rest a stamp may be set.
                    if now > begin + 1.0:
                        number += int(1e-9 * (stamp - last) * RATE + 0.02) if arrivals else 0
                        arrivals[number] = now
                    last = stamp
                time.sleep(NAP)
            assert any(message.velocity), "the motion was too short"
            client.close()
    delays = np.full(number + 1, np.nan)
    delays[list(arrivals)] = list(arrivals.values())
    delays -= np.arange(number + 1) / RATE
    return np.array(delays - np.nanmin(delays))


def main() -> None:
    """Record both, and write them."""
    quiet = recorded()
    busy = [multiprocessing.Process(target=calculate, daemon=True) for _ in range(2)]
    for each in busy:
        each.start()
    loaded = recorded()
    for each in busy:
        each.kill()
    numbers = {
        name: np.where(np.isnan(delays), -1.0, np.round(1e6 * delays)).astype(np.int32)
        for name, delays in (("quiet", quiet), ("loaded", loaded))
    }
    np.savez_compressed(sys.argv[1], quiet=numbers["quiet"], loaded=numbers["loaded"])


if __name__ == "__main__":
    main()
