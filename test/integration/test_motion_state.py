"""What ik_node tells a few times a second: the machine as it is led, and as it is measured."""

import math
import signal

import numpy as np
import pytest

from testing.commands import KINEMATICS, LIMITS
from tri_glide_interfaces.msg import MotionState

TARGET = (0.05, -0.03, 0.3)
OFFSETS = (0.0011, -0.0008, 0.0005)
RATE = 50.0
# Of the encoders, in the worst direction.
ROUNDING = 3e-6


def is_known(numbers):
    return all(map(math.isfinite, numbers))


def test_the_motion_of_the_sliders_is_told_in_motion_at_rest_and_in_a_fault(machine, client):
    told = client.record(MotionState, "ik_node/motion_state")
    offsets = {"height_offsets": OFFSETS}
    machine.start({**offsets, "state_publish_rate": RATE}, offsets)
    client.wait_for(lambda: told, "the motion")
    count = len(told)
    machine.move(TARGET)
    client.wait_for(
        lambda: math.dist(told[-1].measured_heights, told[-1].commanded_heights) < ROUNDING,
        "the sliders at the target",
    )
    client.spin_for(0.5)
    # By the stamps of ik_node, and their median: a processor that is busy delays some messages.
    period = 1e-9 * float(np.median(np.diff([client.time_of(message) for message in told])))
    assert 0.9 / RATE <= period <= 1.1 / RATE

    # True heights, which here are others than those in joint_commands.
    last = told[-1]
    assert last.commanded_heights == pytest.approx(KINEMATICS.inverse(TARGET), abs=1e-9)
    assert last.measured_heights == pytest.approx(last.commanded_heights, abs=ROUNDING)
    # Setpoints that were sent, with the accelerations of the plan.
    moving = [message for message in told[count:] if any(message.commanded_velocities)]
    sent = {tuple(message.velocity) for message in machine.commands}
    assert {tuple(message.commanded_velocities) for message in moving} <= sent
    accelerations = np.array([message.commanded_accelerations for message in moving])
    assert accelerations.any()
    assert (np.abs(accelerations) <= np.array(LIMITS.acceleration) * (1.0 + 1e-9)).all()

    machine.simulator.signal(signal.SIGINT)
    client.wait_for(lambda: not is_known(told[-1].measured_heights), "the end of measurements")
    machine.wait_for_state("fault")
    client.wait_for(lambda: not is_known(told[-1].commanded_heights), "no setpoint")
    machine.start_simulator(offsets)
    client.wait_for(lambda: is_known(told[-1].measured_heights), "measurements while in a fault")
    assert not is_known(told[-1].commanded_heights)
