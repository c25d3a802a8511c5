"""Masses, force limits, a limit of the platform's speed, and the teach mode of a running node."""

import math

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import SetBool

from testing.client import values_of
from testing.commands import KINEMATICS
from tri_glide_kinematics.control import TEACH_SPEED
from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces

LOW, HIGH = (0.0, 0.0, 0.05), (0.02, 0.01, 0.45)
# A shorter way, for slow moves.
NEAR = (0.01, 0.0, 0.2)
MASSES = {
    "carriage_masses": [2.0, 2.0, 2.5],
    "arm_masses": [0.3, 0.3, 0.3],
    "platform_mass": 1.0,
    "payload": 0.5,
}
NO_MASSES = {
    "carriage_masses": [0.0, 0.0, 0.0],
    "arm_masses": [0.0, 0.0, 0.0],
    "platform_mass": 0.0,
    "payload": 0.0,
}
NO_LIMIT = [0.0, 0.0, 0.0]
UP = [45.0, 45.0, 50.0]
ROUNDING = 1e-6
# A slider at rest.
STILL = (0.0, 0.0, 0.0)


def forces(payload):
    arm = Arm(0.3)
    return SliderForces(KINEMATICS, Masses((2.0, 2.0, 2.5), (arm, arm, arm), 1.0, payload))


def weight(payload, heights):
    return forces(payload).forces(heights, STILL, STILL)


def set_up(machine, **values):
    result = machine.client.set_parameters("ik_node", values)
    assert result.successful, result.reason


def reason_against(machine, **values):
    result = machine.client.set_parameters("ik_node", values)
    assert not result.successful
    return result.reason


def teach(machine, on):
    answer = machine.client.call(SetBool, "ik_node/teach_mode", SetBool.Request(data=on))
    assert answer.success
    machine.client.wait_for(lambda: machine.states[-1].teach_mode == on, "the teach mode")


def wait_for_limit(machine, speed):
    machine.client.wait_for(lambda: machine.states[-1].platform_speed_limit == speed, "the limit")


def largest_speed(commands):
    """Return the largest speed of the platform in commands [m/s]."""
    return max(
        math.hypot(*KINEMATICS.forward_velocity(message.position, message.velocity)[1])
        for message in commands
    )


def speed_of_move(machine, position):
    """Move, and return the largest speed of the platform on the way [m/s]."""
    machine.catch_up()
    first = len(machine.commands)
    machine.move(position)
    return largest_speed(machine.commands[first:])


def test_the_effort_of_a_resting_machine_is_its_weight(running_machine):
    machine, client = running_machine, running_machine.client
    diagnostics = client.record(DiagnosticArray, "/diagnostics")
    assert len(machine.commands[-1].effort) == 0
    set_up(machine, **MASSES)
    client.wait_for(lambda: machine.commands[-1].effort, "efforts")
    expected = weight(0.5, machine.heights())
    assert list(machine.commands[-1].effort) == pytest.approx(expected, abs=1e-9)

    def told():
        values = map(values_of, client.statuses(diagnostics))
        return [each[name] for each in values if name in each]

    name = "continuous force of slider 3 [N]"
    client.wait_for(told, "the continuous force")
    assert float(told()[0]) == pytest.approx(expected[2], rel=1e-5)
    set_up(machine, payload=2.0)
    expected = weight(2.0, machine.heights())
    client.wait_for(
        lambda: list(machine.commands[-1].effort) == pytest.approx(expected, abs=1e-9), "payload"
    )
    set_up(machine, **NO_MASSES)
    client.wait_for(lambda: not machine.commands[-1].effort, "no efforts")


def test_force_limits_hold_for_the_efforts_and_have_to_hold_the_weight(running_machine):
    machine = running_machine
    text = reason_against(machine, force_limit_up=UP)
    assert "force_limit_up = [45, 45, 50] N needs masses" in text
    text = reason_against(machine, payload=0.5)
    assert "carriage_masses[0] = 0 kg must be greater than 0 kg, as payload = 0.5 kg" in text
    set_up(machine, **MASSES)
    machine.client.wait_for(lambda: machine.commands[-1].effort, "efforts")
    machine.move(LOW)
    free = len(machine.commands)
    machine.move(HIGH)
    machine.catch_up()
    assert max(message.effort[0] for message in machine.commands[free:]) > 50.0
    set_up(machine, force_limit_up=UP)
    text = reason_against(machine, payload=10.0)
    assert "cannot hold the weight: slider" in text
    text = reason_against(machine, force_limit_up=[45.0, 20.0, 50.0])
    assert "force_limit_up[1] = 20 N cannot hold the weight: slider 2 needs" in text
    machine.move(LOW)
    first = len(machine.commands)
    machine.move(HIGH)
    machine.catch_up()
    parts = [
        force / limit
        for message in machine.commands[first:]
        for force, limit in zip(message.effort, UP)
    ]
    assert 0.9 < max(parts) <= 1.0 + ROUNDING
    # A payload that comes in mid-motion.
    machine.get_going(LOW, 0.3)
    set_up(machine, payload=0.8)
    machine.wait_for_state("idle")
    now = machine.client.now()
    machine.move(HIGH)
    machine.catch_up()
    parts = [
        force / limit
        for message in machine.commands_since(now)
        for force, limit in zip(message.effort, UP)
    ]
    assert 0.9 < max(parts) <= 1.0 + ROUNDING
    heavy = [*machine.commands[-1].effort]
    assert heavy == pytest.approx(weight(0.8, machine.heights()), abs=1e-9)
    set_up(machine, **NO_MASSES, force_limit_up=NO_LIMIT)


def test_the_lower_one_of_teach_mode_and_speed_limit_holds(running_machine):
    machine = running_machine
    assert machine.states[-1].platform_speed_limit == 0.0
    machine.move(LOW)
    assert speed_of_move(machine, HIGH) > 2.0 * TEACH_SPEED
    # In mid-motion, it slows down.
    machine.get_going(LOW, 0.6)
    teach(machine, True)
    wait_for_limit(machine, TEACH_SPEED)
    now = machine.client.now()
    machine.wait_for_state("idle")
    machine.catch_up()
    assert largest_speed(machine.commands_since(now)) <= TEACH_SPEED * (1.0 + ROUNDING)
    assert 0.95 * TEACH_SPEED < speed_of_move(machine, NEAR) <= TEACH_SPEED * (1.0 + ROUNDING)
    # A jog that asks for more.
    machine.catch_up()
    first = len(machine.commands)
    asked = (0.0, 0.0, -2.0 * TEACH_SPEED)

    def jogged():
        machine.client.send_twist(asked)
        return largest_speed(machine.commands[first:] or machine.commands[-1:]) > 0.2

    machine.client.wait_for(jogged, "a jog")
    machine.wait_for_state("idle")
    machine.catch_up()
    jog = largest_speed(machine.commands[first:])
    assert jog <= TEACH_SPEED * (1.0 + ROUNDING)
    set_up(machine, platform_speed_limit=0.4)
    assert 0.8 * TEACH_SPEED < speed_of_move(machine, LOW) <= TEACH_SPEED * (1.0 + ROUNDING)
    set_up(machine, platform_speed_limit=0.15)
    wait_for_limit(machine, 0.15)
    assert 0.95 * 0.15 < speed_of_move(machine, NEAR) <= 0.15 * (1.0 + ROUNDING)
    set_up(machine, platform_speed_limit=0.4)
    wait_for_limit(machine, TEACH_SPEED)
    teach(machine, False)
    wait_for_limit(machine, 0.4)
    assert 0.95 * 0.4 < speed_of_move(machine, LOW) <= 0.4 * (1.0 + ROUNDING)
    set_up(machine, platform_speed_limit=0.0)
    wait_for_limit(machine, 0.0)


def test_a_node_does_not_start_with_force_limits_that_it_cannot_keep(nodes):
    node = nodes.start("ik_node", {**MASSES, "force_limit_up": [20.0, 0.0, 0.0]})
    node.exit_codes = (1,)
    assert node.process.wait(60.0) == 1
    assert "force_limit_up[0] = 20 N cannot hold" in node.output


def test_a_simulated_machine_with_masses_is_driven_by_efforts(running_machine):
    """Its drives hold the weight with the feed-forward, and the moves end where they should."""
    machine = running_machine
    drives = {"drive_stiffness": [20000.0] * 3, "drive_damping": [400.0] * 3}
    answer = machine.client.set_parameters("simulator_node", drives)
    assert not answer.successful
    assert "drive_stiffness = [20000, 20000, 20000] N/m needs masses" in answer.reason
    set_up(machine, **MASSES)
    machine.client.wait_for(lambda: machine.commands[-1].effort, "efforts")
    answer = machine.client.set_parameters("simulator_node", {**MASSES, **drives})
    assert answer.successful, answer.reason
    machine.client.wait_for(lambda: machine.measured[-1].effort, "forces of the drives")
    machine.move(HIGH)
    machine.move(LOW)
    machine.wait_for_measured_rest()
    expected = weight(0.5, machine.heights())
    machine.client.wait_for(
        lambda: list(machine.measured[-1].effort) == pytest.approx(expected, abs=0.05), "rest"
    )
    assert list(machine.measured[-1].position) == pytest.approx(machine.heights(), abs=1e-5)
    off = {name: NO_LIMIT for name in drives}
    assert machine.client.set_parameters("simulator_node", {**NO_MASSES, **off}).successful
    machine.client.wait_for(lambda: not machine.measured[-1].effort, "no forces")
    set_up(machine, **NO_MASSES)
