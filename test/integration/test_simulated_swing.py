"""A simulated machine that swings, as an accelerometer and the true pose show it."""

import itertools
import signal

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Imu

from tri_glide_kinematics.calibration.ringdown import Quantity, Recording, find_modes

FREQUENCIES = (15.0, 22.0, 0.0)  # Hz
RATE = 100.0  # 1/s, of ik_node
PERIOD = 1.0 / RATE  # s
START, TARGET = (-0.08, 0.05, 0.25), (0.08, -0.05, 0.25)
GRAVITY = 9.80665  # m/s^2
# Samples without one missing; a busy computer gets so many rounds for them.
ENOUGH, ROUNDS = 150, 10
# The drives' own setpoints: what the machine does then is the same on a busy computer.
SWINGING = {
    # More than twice the frequencies by far.
    "rate": 200.0,
    "setpoint_period": PERIOD,
    "swing_frequencies": FREQUENCIES,
    "swing_dampings": [0.02],
}


@pytest.fixture
def imus(client):
    return client.record(Imu, "imu/data_raw")


@pytest.fixture
def poses(client):
    return client.record(PoseStamped, "true_pose")


def unbroken(client, imus):
    """Return the longest part of them in which none is missing: a busy computer loses some."""
    times = np.array([client.time_of(imu) for imu in imus])
    broken = np.flatnonzero(np.diff(times) != round(1e9 * PERIOD)) + 1
    first, last = max(
        itertools.pairwise((0, *broken, len(imus))), key=lambda part: part[1] - part[0]
    )
    return imus[first:last]


def felt(imus):
    """Return what an accelerometer has told. Shape (n, 3) [m/s^2]."""
    return np.array([(a.x, a.y, a.z) for a in (imu.linear_acceleration for imu in imus)])


def places(poses):
    """Return true places. Shape (n, 3) [m]."""
    return np.array([(p.x, p.y, p.z) for p in (pose.pose.position for pose in poses)])


def modes_in(client, imus):
    """Return what was found of the modes; samples may be missing."""
    times = 1e-9 * np.array([client.time_of(imu) for imu in imus])
    return find_modes(Recording(times, felt(imus), Quantity.ACCELERATION))


def frequencies_of(found):
    return sorted(mode.frequency for mode in found.modes)


def collected(client, messages, count=300):
    """Wait until so many messages have come from now on, and return them."""
    first = len(messages)
    client.wait_for(lambda: len(messages) >= first + count, "messages")
    return messages[first : first + count]


def test_an_accelerometer_tells_the_frequencies_and_drives_do_not(machine, client, imus, poses):
    machine.start({"rate": RATE}, {**SWINGING, "accelerometer_noise": 0.01})
    client.wait_for(lambda: imus, "an accelerometer")
    imu = imus[0]
    assert imu.header.frame_id == "tri_glide_platform"
    # REP 145: neither orientation nor angular velocity is estimated.
    assert imu.orientation_covariance[0] == imu.angular_velocity_covariance[0] == -1.0
    assert imu.linear_acceleration_covariance == pytest.approx(np.diag([1e-4] * 3).ravel())
    # At rest it feels gravity, as if it were accelerated upwards.
    resting = felt(collected(client, imus, 100))
    assert resting.mean(axis=0) == pytest.approx((0.0, 0.0, GRAVITY), abs=0.005)
    assert resting.std(axis=0) == pytest.approx((0.01,) * 3, rel=0.3)

    for _ in range(ROUNDS):
        machine.move(START)
        machine.move(TARGET)
        machine.wait_for_measured_rest()
        first = len(machine.measured)
        collected(client, imus)
        # The swing from its start: later, there is more noise than swing.
        moved = [client.time_of(m) for m in machine.measured if max(map(abs, m.velocity)) > 1e-6]
        swung = unbroken(client, [imu for imu in imus if client.time_of(imu) > moved[-1]][:250])
        if len(swung) >= ENOUGH:
            break
    assert frequencies_of(modes_in(client, swung)) == pytest.approx(FREQUENCIES[:2], rel=0.01)
    assert np.abs(felt(swung)[:, 2] - GRAVITY).max() < 0.1
    # The platform swings, and the sliders rest.
    swing = places([pose for pose in poses if client.time_of(pose) > moved[-1]])
    assert np.ptp(swing[:, :2], axis=0).min() > 1e-5
    heights = np.array([machine.heights(message) for message in machine.measured[first:]])
    assert np.ptp(heights, axis=0).max() < 3e-6


def test_where_time_passes_by_the_clock_a_stall_leaves_samples_out_and_the_swing_goes_on(
    machine, client, imus
):
    machine.start({"rate": RATE}, {**SWINGING, "setpoint_period": 0.0, "accelerometer_noise": 0.01})
    client.wait_for(lambda: imus, "an accelerometer")
    machine.move(START)
    machine.move(TARGET)
    first = len(imus)
    client.wait_for(lambda: len(imus) >= first + 100, "a swing")
    machine.simulator.process.send_signal(signal.SIGSTOP)
    client.spin_for(0.1)
    machine.simulator.process.send_signal(signal.SIGCONT)
    told = imus[first : first + 100] + collected(client, imus, 250)
    assert np.diff([client.time_of(imu) for imu in told]).max() > 0.05e9
    found = modes_in(client, told)
    assert frequencies_of(found) == pytest.approx(FREQUENCIES[:2], rel=1e-3)
    assert found.unexplained < 1e-3
