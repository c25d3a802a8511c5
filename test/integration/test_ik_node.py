"""ik_node as a process, with the simulator as its machine: targets, jogs, refusals, restarts."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, TwistStamped
from sensor_msgs.msg import JointState

from testing.commands import KINEMATICS, LIMITS, PERIOD, assert_within_limits, stream_of
from testing.machine import JOINTS


def assert_velocities_fit(machine):
    """Within a period, the mean of both ends and the difference of heights differ by jerk only."""
    published = np.array([message.velocity for message in machine.commands])
    mean = (published[1:] + published[:-1]) / 2.0
    bound = max(LIMITS.jerk) * PERIOD**2
    assert np.allclose(stream_of(machine).velocities[1:], mean, rtol=0.0, atol=bound)


def test_target_is_reached_from_where_the_machine_is(machine):
    start = (0.52, 0.55, 0.58)
    machine.start(None, {"initial_heights": start})
    assert machine.heights(machine.commands[0]) == pytest.approx(start, abs=2e-6)
    assert machine.commands[0].name == list(JOINTS)
    assert machine.commands[0].header.frame_id == "tri_glide_base"
    for target in ((0.05, -0.03, 0.28), (-0.06, 0.04, 0.22)):
        machine.move(target)
        assert machine.heights() == pytest.approx(KINEMATICS.inverse(target), abs=1e-5)
    assert_within_limits(machine)
    assert_velocities_fit(machine)
    machine.client.wait_for(
        lambda: math.dist(machine.heights(machine.measured[-1]), machine.heights()) < 1e-5,
        "the simulated sliders to arrive",
    )


def test_nothing_is_published_before_the_machine_has_been_measured(machine, client):
    ik = machine.start_ik()
    machine.wait_for_state("waiting")
    publisher = client.publisher(JointState, "joint_states")
    client.wait_for_subscribers(publisher)
    publisher.publish(JointState(name=["a", "b", "c"], position=[0.6, 0.6, 0.6]))
    # test/ros/inputs/test_slider_measurements.py has the others that are no measurement.
    outside = JointState(name=JOINTS, position=[0.6, 0.6, 0.95])

    def told():
        publisher.publish(outside)
        return "0.95" in ik.output

    client.wait_for(told, "the reason")
    client.send_pose((0.0, 0.0, 0.25))
    client.wait_for(lambda: "no motion while waiting for the machine" in ik.output, "a refusal")
    assert not machine.commands
    good = JointState(name=JOINTS[::-1], position=[0.61, 0.6, 0.59])

    def started():
        publisher.publish(good)
        return machine.commands

    client.wait_for(started, "the first command")
    assert machine.heights(machine.commands[0]) == pytest.approx((0.59, 0.6, 0.61), abs=0.0)


def test_stamps_of_setpoints_are_nominal_times_near_the_clock(running_machine):
    machine, client = running_machine, running_machine.client
    machine.catch_up()
    heard = client.record(JointState, f"{machine.namespace}/joint_commands")
    client.wait_for(lambda: heard, "setpoints")
    machine.move((0.05, 0.0, 0.3))
    moving = [message for message in heard if any(message.velocity)]
    steps = np.diff([client.time_of(message) for message in moving])
    period = round(1e9 * PERIOD)
    # However late they were sent; a little more where late cycles are caught up, for each of them.
    assert (steps // period >= 1).all()
    assert (steps % period <= steps // period * (period // 16)).all()
    assert (steps // period == 1).mean() > 0.5
    assert abs(client.now() - client.time_of(heard[-1])) < 1e9
    machine.move(KINEMATICS.forward((0.6, 0.6, 0.6)))


def test_a_jog_ends_without_renewal_and_stamps_of_another_clock_change_nothing(running_machine):
    machine, client = running_machine, running_machine.client
    publisher = client.publisher(TwistStamped, "target_twist")
    client.wait_for_subscribers(publisher)
    message = TwistStamped()
    message.twist.linear.z = 0.05
    before = machine.heights()
    for second in (0, 1, 2**31 - 1):
        message.header.stamp.sec = second

        def jogging():
            publisher.publish(message)
            return machine.state == "jogging" and machine.commands[-1].velocity[0] > 0.049

        client.wait_for(jogging, "jogging")
        machine.wait_for_state("idle")
    machine.catch_up()
    assert machine.heights()[0] > before[0] + 0.003
    assert_within_limits(machine)
    assert_velocities_fit(machine)


def test_two_machines_in_one_domain_do_not_disturb_each_other(
    running_machine, other_machine, client
):
    machine, other = running_machine, other_machine
    other.start({}, {"initial_heights": (0.7, 0.7, 0.7)})
    publisher = client.publisher(PoseStamped, f"{other.namespace}/target_pose")
    client.wait_for_subscribers(publisher)
    message = PoseStamped()
    message.pose.position.z = 0.4
    for going, resting, target, send in (
        (machine, other, (0.05, 0.0, 0.3), lambda: machine.client.send_pose((0.05, 0.0, 0.3))),
        (other, machine, (0.0, 0.0, 0.4), lambda: publisher.publish(message)),
    ):
        resting.catch_up()
        first = len(resting.commands) - 1
        going.wait_for_new_state("idle", send)
        going.catch_up()
        assert going.heights() == pytest.approx(KINEMATICS.inverse(target), abs=1e-5)
        resting.catch_up()
        assert len({resting.heights(each) for each in resting.commands[first:]}) == 1
